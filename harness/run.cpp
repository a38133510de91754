#include "run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "launch.hpp"
#include "nscdd/comm/in_process.hpp"
#include "nscdd/comm/mpi.hpp"
#include "replace_file.hpp"
#include "same_files.hpp"
#include "same_scene.hpp"
#include "say.hpp"
#include "series.hpp"
#include "session.hpp"

namespace nscdd {

namespace {

std::vector<int> read_grid(const std::string& text) {
    std::vector<int> cells;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t cross = std::min(text.find('x', at), text.size());
        int cell = 0;
        const auto [end, error] = std::from_chars(text.data() + at, text.data() + cross, cell);
        if (error != std::errc{} || end != text.data() + cross || cell < 1)
            throw InputError(fmt::format("--grid {}: expected cells per axis, such as 2x2x1", text));
        cells.push_back(cell);
        at = cross + 1;
    }
    return cells;
}

// Checks the files that a run will write. Their sizes, about: 600 bytes a grain with its contacts in a state or a
// frame, 100 a step in JSON, 1000 in a series.
void check_run_outputs(const RunArguments& arguments, const RunRequest& request) {
    const Scene& scene = request.scene;
    const std::size_t packed = std::max(request.packing.total(), request.from.packing.total());
    const std::uint64_t grains = packed + scene.grains.size(), steps = static_cast<std::uint64_t>(scene.step.count);
    std::vector<NamedFile> inputs = inputs_of(arguments, scene);
    // a run may go on from its own checkpoint, which is read before it is replaced
    if (!arguments.checkpoint.empty() && !arguments.from.empty() && same_file(arguments.checkpoint, arguments.from))
        std::erase_if(inputs, [](const NamedFile& input) { return input.name == "--from"; });
    std::vector<NamedFile> outputs = {{"--json", arguments.json, 100 * steps},
                                      {"--checkpoint", arguments.checkpoint, 600 * grains},
                                      {"--state", arguments.state, 600 * grains},
                                      {"the .xdmf beside --state", xdmf_beside(arguments.state)}};
    for (const auto& path : arguments.series) outputs.push_back({"--series", path, 1000 * steps});
    const std::uint64_t frames = steps / static_cast<std::uint64_t>(request.frame_every);
    outputs.push_back({"--frames", arguments.frames, 2 * 600 * grains * frames});  // with the copy
    outputs.push_back({"the .xdmf beside --frames", xdmf_beside(arguments.frames), 4000 * frames});
    check_outputs(outputs, inputs);
}

// The warning for steps that stopped early: bounds, and the worst figures of all steps.
std::string unconverged(const nlohmann::json& json, int steps) {
    const auto worst = [&json](const char* key) {
        double most = 0;
        for (const double x : json[key]) {
            if (std::isnan(x)) return x;
            most = std::max(most, x);
        }
        return most;
    };
    return fmt::format(
        "{} of {} steps stopped, after {:.0f} iterations at most, without reaching what is asked: eta <= {:g} (worst "
        "{:.2g}), velocity error <= {:g} ({:.2g}), energy made <= {:g} ({:.2g}), penetration <= {:g} of the least "
        "radius ({:.2g}), gap error <= {:g} of a contact's radius ({:.2g}), distance <= {:g} ({:.2g})",
        steps, json["steps"].get<int>(), worst("iterations"), json["tolerance"].get<double>(), worst("residual"),
        json["velocity_error_allowed"].get<double>(), worst("velocity_error"),
        json["energy_made_allowed"].get<double>(), worst("energy_made"), json["penetration_allowed"].get<double>(),
        worst("penetration"), json["gap_error_allowed"].get<double>(), worst("gap_error"),
        json["distance_allowed"].get<double>(), worst("distance"));
}

// What Newton's method solved in the place of sweeps, and the rebounds that were given up; empty where nothing was.
std::string handed_over(const nlohmann::json& json) {
    const auto steps_with = [&json](const char* key) {
        return std::ranges::count_if(json[key], [](const auto& contacts) { return contacts > 0; });
    };
    const auto newton = steps_with("newton_contacts"), given_up = steps_with("rebounds_given_up");
    if (newton == 0) return {};
    std::string said = fmt::format("in {} of {} steps sweeps got nowhere, and Newton's method solved components",
                                   newton, json["steps"].get<int>());
    if (given_up > 0)
        said += fmt::format("; in {} of them it found no answer with rebounds, which were given up", given_up);
    return said;
}

double solver_cpu(const RunResult& result) { return result.json["seconds"]["solver_cpu"]; }  // the same on all ranks

}  // namespace

RunRequest prepare_run(const RunArguments& arguments, const Provenance& provenance, Share share, bool over_mpi) {
    const int processes = share.parts;
    RunRequest request;
    request.share = share;
    request.provenance = provenance;
    request.scheme = arguments.scheme;
    request.interface = arguments.interface;
    request.multiplicity = arguments.multiplicity;
    request.over_mpi = over_mpi;
    request.progress = !arguments.quiet;
    request.json = arguments.json;
    request.state = arguments.state;
    request.checkpoint = arguments.checkpoint;
    request.series = arguments.series;
    for (const auto& path : request.series) SeriesWriter::check_name(path);
    request.frames = arguments.frames;
    if (arguments.frame_every > 0 && request.frames.empty())
        throw InputError("--frame-every is of frames: give --frames");
    if (arguments.frame_every > 0) request.frame_every = arguments.frame_every;
    if (!arguments.every.empty()) request.every = read_checkpoint_every(arguments.every);
    if (!arguments.every.empty() && arguments.checkpoint.empty())
        throw InputError("--every is of checkpoints: give --checkpoint");
    if (!arguments.checkpoint.empty() && arguments.repeat > 1)
        throw InputError("--checkpoint is of one run, not of --repeat");
    request.subdomains = arguments.subdomains > 0 ? arguments.subdomains : over_mpi ? processes : 1;
    request.undivided = !sequential(request.scheme) && arguments.subdomains == 0 && processes == 1 && !launched();
    if (over_mpi && request.subdomains < processes)
        throw InputError(fmt::format("--subdomains {}: mpirun started {} processes, which need at least one each",
                                     request.subdomains, processes));
    if (!over_mpi && processes > 1) throw InputError("--transport in-process runs in one process, not under mpirun");
    if (sequential(request.scheme) && request.subdomains > 1)
        throw InputError(
            fmt::format("--scheme {} is sequential: give {} for more than one subdomain", request.scheme,
                        fmt::join(names_of(offered_schemes(), [](const auto& s) { return s.decomposed; }), " or ")));
    request.threads = std::max(arguments.threads, 1);
    if (request.threads > 1 && over_mpi)
        throw InputError("--threads is of one process: under mpirun each has one thread");
    if (request.threads > request.subdomains)
        throw InputError(fmt::format("--threads {}: subdomains are dealt to them, and there {} {}", request.threads,
                                     request.subdomains == 1 ? "is" : "are", request.subdomains));
    for (const auto& [option, given] : {std::pair("--method", !arguments.method.empty()),
                                        {"--window", arguments.window.has_value()},
                                        {"--relaxation", arguments.relaxation > 0},
                                        {"--sweeps", arguments.sweeps > 0}})
        if (given && !sweeps(request.scheme))
            throw InputError(fmt::format("{} is of sweeps, which --scheme {} does not make", option, request.scheme));
    request.partition = arguments.chosen_partition();
    if (arguments.imbalance > 0) request.imbalance = arguments.imbalance;
    for (const auto& [option, given, of_grid] :
         {std::tuple("--grid", !arguments.grid.empty(), true), {"--imbalance", arguments.imbalance > 0, false}})
        if (given && of_grid != (request.partition == "grid"))
            throw InputError(fmt::format("{} is not of --partition {}", option, request.partition));
    if (!arguments.grid.empty()) {
        request.grid = read_grid(arguments.grid);
        double product = 1;  // never overflows, and is exact where it could be the number of subdomains
        for (int cells : request.grid) product *= cells;
        if (product != request.subdomains)
            throw InputError(
                fmt::format("--grid {}: {:.0f} cells for {} subdomains", arguments.grid, product, request.subdomains));
    }

    request.scene = read_scene(arguments.scene);
    Scene& scene = request.scene;
    if (arguments.steps > 0) scene.step.count = arguments.steps;
    if (arguments.check_every > 0) scene.solver.check_every = arguments.check_every;
    if (arguments.max_iterations > 0) scene.solver.max_iterations = arguments.max_iterations;
    if (arguments.newton_contacts) scene.solver.newton_contacts = *arguments.newton_contacts;
    if (arguments.sweeps > 0) scene.solver.sweeps = arguments.sweeps;
    if (!arguments.method.empty()) scene.solver.method = arguments.method;
    if (arguments.window) scene.solver.window = arguments.window;
    if (scene.solver.window > Anderson::largest_window)
        throw InputError(fmt::format("{}: solver: window must be <= {}, found {}", scene.file, Anderson::largest_window,
                                     *scene.solver.window));
    if (arguments.relaxation > 0) scene.solver.relaxation = arguments.relaxation;
    if (arguments.tolerance > 0) scene.solver.tolerance = arguments.tolerance;
    if (arguments.velocity_error > 0) scene.solver.velocity_error = arguments.velocity_error;
    if (arguments.energy_made > 0) scene.solver.energy_made = arguments.energy_made;
    if (arguments.penetration > 0) scene.solver.penetration = arguments.penetration;
    if (arguments.gap_error > 0) scene.solver.gap_error = arguments.gap_error;
    if (arguments.distance > 0) scene.solver.distance = arguments.distance;
    if (arguments.from.empty() && arguments.adopt) throw InputError("--adopt is of a state to go on from: give --from");
    if (!arguments.from.empty()) {
        request.from = read_state(arguments.from, share);
        request.from_file = arguments.from;
        require_fitting_state(request.from, arguments.from, scene);
        if (arguments.steps == 0 && request.from.steps_left > 0)
            scene.step.count = static_cast<int>(request.from.steps_left);
        share.dealt =
            request.from.packing.total();  // the same rows of the packing, which are compared with those of the state
    }
    // a run that goes on from a state needs no packing: that of the scene is compared if its file is still there
    const std::string& packing = arguments.packing.empty() ? scene.packing_file : arguments.packing;
    if (!packing.empty() && (!request.goes_on() || !arguments.packing.empty() || std::filesystem::exists(packing))) {
        request.packing = read_packing(packing, share);
        fit_packing(request.packing, packing, scene);
    }
    if (request.goes_on()) {
        if (!arguments.adopt) require_same_scene(request.from, arguments.from, scene, request.packing);
        request.packing = {};
        request.start_step = request.from.step;
        request.start_time = request.from.time;
    }
    const std::int64_t last_step = request.start_step + scene.step.count;
    if (!request.frames.empty() && last_step / request.frame_every == request.start_step / request.frame_every)
        throw InputError(fmt::format("--frame-every {}: the run makes steps {} to {}, of which none is a multiple",
                                     request.frame_every, request.start_step + 1, last_step));
    request.box = request.goes_on() ? request.from.packing.box : request.packing.box;
    return request;
}

std::vector<NamedFile> inputs_of(const RunArguments& arguments, const Scene& scene) {
    return {{"the scene", arguments.scene},
            {"the packing", arguments.packing.empty() ? scene.packing_file : arguments.packing},
            {"--from", arguments.from}};
}

RunFunction choose_model(const Scene& scene) {
    return scene.dimension == 2 ? choose_law<2>(scene.law) : choose_law<3>(scene.law);
}

int run(const RunArguments& arguments, const Provenance& provenance, const Session& session) {
    const bool over_mpi = arguments.transport == "mpi" || (arguments.transport == "auto" && launched());
    if (!arguments.checkpoint.empty()) listen_for_checkpoint_signal();
    RunRequest request;
    std::vector<NamedFile> inputs;
    std::vector<std::string> sums;
    RunResult result;
    FileSet files;  // rank 0 writes
    if (!session.together([&] {
            request = prepare_run(arguments, provenance, {session.rank(), session.size()}, over_mpi);
            if (simulated && !request.json.empty())
                throw InputError(
                    "--json: no times are simulated of whole runs, but of windows: see nscdd scale --help");
            if (session.rank() == 0) check_run_outputs(arguments, request);
            inputs = inputs_of(arguments, request.scene);
            sums = sums_of_files(session, inputs);
        }) ||
        !session.together([&] { require_same_files(session, inputs, sums); }))
        return 1;
    if (!session.together([&] {
            const auto once = [&files, &arguments, over_mpi](RunRequest& one) {
                if (over_mpi) {
                    Mpi comm(MPI_COMM_WORLD, {}, one.subdomains, within_node(arguments.within_node));
                    return choose_model(one.scene)(one, comm, files);
                }
                InProcess comm(one.subdomains, one.threads);
                return choose_model(one.scene)(one, comm, files);
            };
            std::vector<RunResult> results;
            for (int k = 1; k < arguments.repeat; ++k) {
                RunRequest earlier = request;  // which says the notes, once
                earlier.state.clear();
                earlier.series.clear();
                earlier.frames.clear();
                results.push_back(once(earlier));
                request.says_notes = false;
            }
            results.push_back(once(request));
            const auto median = results.begin() + (arguments.repeat - 1) / 2;
            std::ranges::nth_element(results, median, {}, solver_cpu);
            result = std::move(*median);
            result.json["repeats"] = arguments.repeat;
        }))
        return 1;
    if (result.stopped) {
        if (!session.together([&] { files.commit(); })) return 1;
        if (session.rank() == 0)
            say(stderr, "nscdd: stopped by SIGUSR1 after step {}, before the end: go on with --from {}\n",
                result.last_step, one_line(request.checkpoint));
        return 4;
    }
    const bool written = session.together([&] {
        if (session.rank() != 0) return;
        if (!request.state.empty()) {
            const auto folder = std::filesystem::absolute(std::filesystem::path(".") / request.json).parent_path();
            result.json["state"] =
                std::filesystem::proximate(std::filesystem::absolute(request.state), folder).string();
            result.json["state_checksum"] = files.checksum(request.state);
        }
        if (!request.json.empty()) write_json(files, request.json, result.json);
        files.commit();
    });
    if (!written) return 1;
    if (session.rank() == 0) {
        const auto& json = result.json;
        double iterations = 0;
        for (double count : json["iterations"]) iterations += count;
        if (!arguments.quiet)
            say("{}: {} grains, {} steps, {} on {} subdomain{}: {:.0f} iterations, {:.3g} s\n", request.scene.name,
                json["grains"].get<int>(), request.scene.step.count, request.scheme, json["subdomains"].get<int>(),
                json["subdomains"] == 1 ? "" : "s", iterations, json["seconds"]["total"].get<double>());
        if (const std::string said = handed_over(json); !said.empty() && !arguments.quiet)
            say(stderr, "nscdd: note: {}\n", said);
        if (result.unconverged_steps > 0) say(stderr, "nscdd: {}\n", unconverged(json, result.unconverged_steps));
    }
    return result.unconverged_steps > 0 ? 3 : 0;
}

}  // namespace nscdd
