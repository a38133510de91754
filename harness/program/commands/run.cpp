#include "commands/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "commands/launch.hpp"
#include "commands/same_files.hpp"
#include "commands/session.hpp"
#include "files/frames.hpp"
#include "files/replace_file.hpp"
#include "files/say.hpp"
#include "model/run_json.hpp"
#include "nscdd/comm/in_process.hpp"
#include "nscdd/comm/mpi.hpp"

namespace nscdd {

namespace {

// Checks the files that a run will write. Their sizes, about: 600 bytes a grain with its contacts in a state or a
// frame, 100 a step in JSON, 1000 in a series.
void check_run_outputs(const RunRequest& request) {
    const Scene& scene = request.scene;
    const RunArguments::Outputs& asked = request.outputs;
    const std::size_t packed = std::max(request.packing.total(), request.from.packing.total());
    const std::uint64_t grains = packed + scene.grains.size(), steps = static_cast<std::uint64_t>(scene.step.count);
    std::vector<NamedFile> inputs = inputs_of(request, scene);
    // a run may go on from its own checkpoint, which is read before it is replaced
    if (asked.checkpoint && request.goes_on() && same_file(*asked.checkpoint, *request.start.from))
        std::erase_if(inputs, [](const NamedFile& input) { return input.name == "--from"; });
    std::vector<NamedFile> outputs = {
        {"--json", asked.json, 100 * steps},
        {"--checkpoint", asked.checkpoint, 600 * grains},
        {"--state", asked.state, 600 * grains},
    };
    if (asked.state) outputs.push_back({"the .xdmf beside --state", xdmf_beside(*asked.state)});
    for (const auto& path : asked.series) outputs.push_back({"--series", path, 1000 * steps});
    outputs.push_back({"--log", asked.log});
    const std::uint64_t frames = steps / static_cast<std::uint64_t>(request.frame_every());
    for (const auto& path : asked.frames) {
        outputs.push_back({"--frames", path, 2 * 600 * grains * frames});  // with the copy
        if (const auto collections = frame_collections(path)) {
            outputs.push_back({"the .contacts.pvd beside --frames", collections->at(1), 100 * frames});
            outputs.push_back({"the .walls.pvd beside --frames", collections->at(2), 100 * frames});
        }
    }
    check_outputs(outputs, inputs);
}

// The largest of a figure over all steps; NaN where one is.
double worst(const RunResult& result, auto&& figure) {
    double most = 0;
    for (const StepReport& step : result.steps) {
        const double x = figure(step.solve);
        if (std::isnan(x)) return x;
        most = std::max(most, x);
    }
    return most;
}

// The warning for steps that stopped early: bounds, and the worst figures of all steps.
std::string unconverged(const RunResult& result) {
    const auto first = result.last_step - std::ssize(result.steps) + 1 +
                       (std::ranges::find_if(result.steps, [](const StepReport& s) { return !s.solve.converged; }) -
                        result.steps.begin());
    std::string told = fmt::format(
        "{} of {} steps stopped, step {} the first, after {:.0f} iterations at most, without reaching what is asked: "
        "eta <= {:g} (worst {:.2g})",
        result.unconverged_steps(), result.steps.size(), first,
        worst(result, [](const auto& s) { return s.iterations; }), result.options.tolerance,
        worst(result, [](const auto& s) { return s.residual; }));
    for (const detail::BoundOption& bound : detail::bound_options) {
        const double figure = worst(result, [&](const SolveReport& s) { return result.figure(bound, s); });
        told += fmt::format(", {} <= {:g}{}{} ({:.2g})", spoken(bound.figure_name), result.options.bounds.*bound.limit,
                            *bound.info.unit ? " of the " : "", bound.info.unit,
                            std::isnan(figure) ? std::abs(figure) : figure);  // without its sign
    }
    return told;
}

// What Newton's method solved in the place of sweeps, and the rebounds that were given up; empty where nothing was.
std::string handed_over(const RunResult& result) {
    const auto steps_with = [&result](double SolveReport::*contacts) {
        return std::ranges::count_if(result.steps, [&](const StepReport& s) { return s.solve.*contacts > 0; });
    };
    const auto newton = steps_with(&SolveReport::newton_contacts),
               given_up = steps_with(&SolveReport::rebounds_given_up);
    if (newton == 0) return {};
    std::string said = fmt::format("in {} of {} steps sweeps got nowhere, and Newton's method solved components",
                                   newton, result.steps.size());
    if (given_up > 0)
        said += fmt::format("; in {} of them it found no answer with rebounds, which were given up", given_up);
    return said;
}

// What the grains at the end say of the steps before; empty where they hardly overlap.
std::string overlapping(const RunResult& result) {
    if (!(result.final.overlap > 0.03)) return {};
    return fmt::format(
        "grains overlap by up to {:.2g} % of a radius at the end, and a step is refused above 10 %: unless "
        "they did at the start, errors of steps add up where motion is slow, so take a smaller --tolerance; where it "
        "is fast, a smaller h",
        100 * result.final.overlap);
}

// Grains that should have come and found no place; empty where all have come.
std::string waiting(const RunRequest& request, const RunResult& result) {
    const auto& insertions = request.scene.exchange.insertions;
    const double begun =
        request.start_time + (double(result.steps.size()) - 1) * request.scene.step.h;  // the last step
    std::vector<std::string> told;
    for (std::size_t e = 0; e < insertions.size(); ++e)
        if (const double left = insertions[e].due(begun) - result.so_far.inserted[e]; left > 0)
            told.push_back(fmt::format("{:.0f} of [[insert]] {}", left, e));
    return told.empty() ? ""
                        : fmt::format("grains still wait for a free place in their boxes: {}", fmt::join(told, ", "));
}

// Runs --repeat times; the run with the median CPU time of the solver, the same on all ranks, counts. Collective.
RunResult run_and_repeat(RunRequest& request, FileSet& files) {
    const auto once = [&files](RunRequest& one) {
        if (one.over_mpi) {
            Mpi comm(MPI_COMM_WORLD, {}, *one.subdomains, within_node(one.within_node), *one.threads);
            return choose_model(one.scene)(one, comm, files);
        }
        InProcess comm(*one.subdomains, *one.threads);
        return choose_model(one.scene)(one, comm, files);
    };
    std::vector<RunResult> results;
    for (int k = 1; k < request.repeat; ++k) {
        RunRequest earlier = request;  // which says the notes, once
        earlier.outputs = {};
        results.push_back(once(earlier));
        request.says_notes = false;
    }
    results.push_back(once(request));
    const auto median = results.begin() + (request.repeat - 1) / 2;
    std::ranges::nth_element(results, median, {}, &RunResult::solver_cpu);
    median->repeats = request.repeat;
    return std::move(*median);
}

// On rank 0.
void write_results(const RunRequest& request, const RunResult& result, FileSet& files) {
    const RunArguments::Outputs& outputs = request.outputs;
    if (outputs.json) {
        nlohmann::json json = run_json(request, result);
        if (outputs.state) {
            const auto folder = std::filesystem::absolute(std::filesystem::path(".") / *outputs.json).parent_path();
            json["state"] = std::filesystem::proximate(std::filesystem::absolute(*outputs.state), folder).string();
            json["state_checksum"] = files.checksum(*outputs.state);
        }
        write_json(files, *outputs.json, json);
    }
    files.commit();
}

void say_results(const RunRequest& request, const RunResult& result) {
    const int processes = request.share.parts;
    const std::string of_each = processes > 1 ? fmt::format("{} processes of ", processes) : "";
    if (!request.quiet)
        say("{}: {} grains{}, {} steps, {} on {} subdomain{}{}: {:.0f} iterations, {:.3g} s\n", request.scene.name,
            result.grains, result.so_far.came.empty() ? "" : " at the start", result.steps.size(), *request.scheme,
            result.ranks, result.ranks == 1 ? "" : "s",
            *request.threads > 1 ? fmt::format(", {}{} threads", of_each, *request.threads) : "", result.iterations(),
            result.seconds());
    if (const State::SoFar& so_far = result.so_far; !so_far.came.empty() && !request.quiet)
        say("{}: {:.0f} grains inserted, {:.0f} removed, {} left\n", request.scene.name, so_far.came[0], so_far.left[0],
            result.grains_left);
    if (result.stopped_by && !request.quiet)
        say("{}: stopped after step {}: {}\n", request.scene.name, result.last_step, result.stopped_by->text());
    for (const std::string& said : {handed_over(result), overlapping(result), waiting(request, result)})
        if (!said.empty() && !request.quiet) say(stderr, "nscdd: note: {}\n", said);
    if (result.unconverged_steps() > 0) say(stderr, "nscdd: {}\n", unconverged(result));
}

}  // namespace

int run(const RunArguments& arguments, const Provenance& provenance, const Session& session) {
    const bool over_mpi =
        arguments.transport == Transport::mpi || (arguments.transport == Transport::automatic && launched());
    if (arguments.outputs.checkpoint) listen_for_checkpoint_signal();
    RunRequest request;
    std::vector<NamedFile> inputs;
    std::vector<std::string> sums;
    RunResult result;
    FileSet files;  // rank 0 writes
    if (!session.together([&] {
            request = prepare_run(arguments, provenance, {session.rank(), session.size()}, over_mpi);
            request.undivided = request.undivided && !launched();
            if (simulated && request.outputs.json)
                throw InputError(
                    "--json: no times are simulated of whole runs, but of windows: see nscdd scale --help");
            if (session.rank() == 0) check_run_outputs(request);
            inputs = inputs_of(arguments, request.scene);
            sums = sums_of_files(session, inputs);
        }) ||
        !session.together([&] { require_same_files(session, inputs, sums); }) ||
        !session.together([&] { result = run_and_repeat(request, files); }))
        return 1;
    if (result.stopped) {
        if (!session.together([&] { files.commit(); })) return 1;
        if (session.rank() == 0)
            say(stderr, "nscdd: stopped by SIGUSR1 after step {}, before the end: go on with --from {}\n",
                result.last_step, one_line(*request.outputs.checkpoint));
        return 4;
    }
    const bool written = session.together([&] {
        if (session.rank() == 0) write_results(request, result, files);
    });
    if (!written) return 1;
    if (session.rank() == 0) say_results(request, result);
    return result.unconverged_steps() > 0 ? 3 : 0;
}

}  // namespace nscdd
