#include "model/prepare_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "files/frames.hpp"
#include "files/series.hpp"
#include "model/same_scene.hpp"
#include "nscdd/comm/allowed_cores.hpp"
#include "registry/registry.hpp"

namespace nscdd {

namespace {

// What options ask for that they cannot have together.
void check_outputs_asked(const RunArguments& arguments) {
    const RunArguments::Outputs& outputs = arguments.outputs;
    for (const auto& path : outputs.series) SeriesWriter::check_name(path);
    for (const auto& path : outputs.frames) check_frames_name(path);
    if (outputs.frame_every && outputs.frames.empty()) throw InputError("--frame-every is of frames: give --frames");
    if (outputs.every && !outputs.checkpoint) throw InputError("--every is of checkpoints: give --checkpoint");
    if (outputs.checkpoint && arguments.repeat > 1) throw InputError("--checkpoint is of one run, not of --repeat");
    if (arguments.start.adopt && !arguments.start.from)
        throw InputError("--adopt is of a state to go on from: give --from");
}

void check_scheme(const RunRequest& request) {
    if (sweeps(*request.scheme)) return;
    std::string option = request.solver.method ? "--method" : "";
    detail::visit_options(SolveOptions{}, [&](const detail::OptionInfo& info, auto) {
        if (info.of_sweeps && option.empty() && request.solver.given.contains(info.name)) option = dashed(info.name);
    });
    if (!option.empty())
        throw InputError(fmt::format("{} is of sweeps, which --scheme {} does not make", option, *request.scheme));
}

// Sets subdomains, threads of a process and, unless it is given, the scheme. Threads alone have a subdomain each.
void deal_subdomains(RunRequest& request) {
    const int processes = request.share.parts;
    int threads = request.threads.value_or(1);
    if (request.thread_a_core) {
        const int cores = std::max(1, detail::allowed_cores());
        threads = request.over_mpi ? 1 : std::min(cores, request.subdomains.value_or(cores));
    }
    const bool by_threads = !request.subdomains && processes == 1;
    const int subdomains = request.subdomains.value_or(request.over_mpi ? processes * threads : threads);
    request.undivided = request.scheme && !sequential(*request.scheme) && !request.subdomains && subdomains == 1;
    if (!request.scheme) request.scheme = subdomains > 1 ? "dcs" : "nlgs";
    request.subdomains = subdomains;
    request.threads = threads;
    if (request.over_mpi && subdomains < processes)
        throw InputError(fmt::format("--subdomains {}: mpirun started {} processes, which need at least one each",
                                     subdomains, processes));
    if (!request.over_mpi && processes > 1)
        throw InputError("--transport in-process runs in one process, not under mpirun");
    if (sequential(*request.scheme) && subdomains > 1)
        throw InputError(
            fmt::format("--scheme {} is sequential: give {} for more than one {}", *request.scheme,
                        fmt::join(names_of(offered_schemes(), [](const auto& s) { return s.decomposed; }), " or "),
                        by_threads ? "thread" : "subdomain"));
    if (processes * threads > subdomains)
        throw InputError(fmt::format("--threads {}: subdomains are dealt to them, and there {} {}{}", threads,
                                     subdomains == 1 ? "is" : "are", subdomains,
                                     processes > 1 ? fmt::format(" for {} processes", processes) : ""));
}

void check_partition(const RunRequest& request) {
    const PartitionChoice& partition = request.partition;
    const bool grid = partition.chosen() == "grid";
    if (!partition.grid.empty() && !grid)
        throw InputError(fmt::format("--grid is not of --partition {}", partition.chosen()));
    if (partition.given_imbalance && grid) throw InputError("--imbalance is not of --partition grid");
    if (partition.grid.empty()) return;
    double product = 1;  // never overflows, and is exact where it could be the number of subdomains
    for (int cells : partition.grid) product *= cells;
    if (product != *request.subdomains)
        throw InputError(fmt::format("--grid {}: {:.0f} cells for {} subdomains", fmt::join(partition.grid, "x"),
                                     product, *request.subdomains));
}

bool may_have_fixed(const RunRequest& request) {
    return !request.scene.fixed.empty() || request.from.has_fixed || request.packing.has_fixed ||
           std::ranges::any_of(request.scene.grains, &SceneGrain::fixed);
}

// Reads what the run starts from: its share of a state or of a packing.
void read_start(RunRequest& request) {
    const RunArguments::Start& start = request.start;
    Scene& scene = request.scene;
    Share share = request.share;
    if (request.goes_on()) {
        request.from = read_state(*start.from, share);
        require_fitting_state(request.from, *start.from, scene);
        if (!request.steps && request.from.steps_left > 0) scene.step.count = static_cast<int>(request.from.steps_left);
        share.dealt =
            request.from.packing.total();  // the same rows of the packing, which are compared with those of the state
    }
    // a run that goes on from a state needs no packing: that of the scene is compared if its file is still there
    const std::optional<std::string>& packing = start.packing ? start.packing : scene.packing_file;
    if (packing && (!request.goes_on() || start.packing || std::filesystem::exists(*packing))) {
        if (!std::filesystem::exists(*packing))
            throw InputError(fmt::format(
                "{}: {} asks for this packing: cannot open: No such file or directory; nscdd pack makes one", *packing,
                start.packing ? "--packing" : scene.file));
        request.packing = read_packing(*packing, share);
        fit_packing(request.packing, *packing, scene);
    }
    request.box = request.goes_on() ? request.from.packing.box : request.packing.box;
    if (!request.goes_on()) return;
    if (start.adopt)
        adopt_state(request.from, *start.from, scene);
    else
        require_same_scene(request.from, *start.from, scene, request.packing);
    request.packing = {};
    request.so_far = request.from.so_far;
    request.start_step = request.from.step;
    request.start_time = request.from.time;
}

// All that does not depend on scene and packing.
RunRequest begin_request(const RunArguments& arguments, const Provenance& provenance, Share share, bool over_mpi) {
    RunRequest request;
    static_cast<RunArguments&>(request) = arguments;
    request.share = share;
    request.provenance = provenance;
    request.over_mpi = over_mpi;
    check_outputs_asked(arguments);
    deal_subdomains(request);
    check_scheme(request);
    check_partition(request);
    return request;
}

// Lets the arguments change the scene.
void set_scene(RunRequest& request, Scene scene) {
    request.scene = std::move(scene);
    if (request.steps) request.scene.step.count = *request.steps;
    request.scene.solver.override_by(request.solver);
    if (request.scene.solver.method == Method::paper && request.solver.given.contains("max_newton_contacts"))
        throw InputError("--max-newton-contacts is not of the method paper, which hands nothing over");
}

}  // namespace

RunRequest prepare_run(const RunArguments& arguments, const Provenance& provenance, Share share, bool over_mpi) {
    RunRequest request = begin_request(arguments, provenance, share, over_mpi);
    set_scene(request, read_scene(arguments.start.scene));
    read_start(request);
    request.has_fixed = may_have_fixed(request);
    if (request.scene.step.count < 1 && !arguments.caller_counts)
        throw InputError(request.scene.file + ": step: count is missing: give it, or --steps");
    const std::int64_t last_step = request.start_step + request.scene.step.count;
    const int every = request.frame_every();
    if (!request.outputs.frames.empty() && last_step / every == request.start_step / every)
        throw InputError(fmt::format("--frame-every {}: the run makes steps {} to {}, of which none is a multiple",
                                     every, request.start_step + 1, last_step));
    return request;
}

RunRequest prepare_run(const RunArguments& arguments, Scene scene, Packing packing, Share share, bool over_mpi) {
    RunRequest request = begin_request(arguments, {}, share, over_mpi);
    set_scene(request, std::move(scene));
    if (request.goes_on()) {
        read_start(request);
    } else {
        if (packing.total() > 0) fit_packing(packing, request.scene.file, request.scene);
        request.box = packing.box;
        request.packing = std::move(packing);
    }
    request.has_fixed = may_have_fixed(request);
    return request;
}

std::vector<NamedFile> inputs_of(const RunArguments& arguments, const Scene& scene) {
    const RunArguments::Start& start = arguments.start;
    std::vector<NamedFile> inputs = {{"the scene", start.scene},
                                     {"the packing", start.packing ? start.packing : scene.packing_file},
                                     {"--from", start.from}};
    for (const SceneWall& wall : scene.walls)
        if (!wall.path.file.empty()) inputs.push_back({fmt::format("the motion of '{}'", wall.name), wall.path.file});
    for (const SceneObstacle& obstacle : scene.obstacles)
        for (const std::string& file : {obstacle.file, obstacle.path.file})
            if (!file.empty()) inputs.push_back({fmt::format("a file of obstacle '{}'", obstacle.name), file});
    return inputs;
}

}  // namespace nscdd
