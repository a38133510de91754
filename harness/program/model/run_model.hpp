// The run of one model. Included by the generated run_model_*.cpp only.
#pragma once

#include <map>

#include "files/progress.hpp"
#include "files/say.hpp"
#include "model/calibrate_model.hpp"
#include "model/global_form.hpp"
#include "model/local_form.hpp"
#include "model/notes.hpp"
#include "model/problem.hpp"
#include "model/recorder.hpp"
#include "model/run_costs.hpp"
#include "model/simulation_exchange.hpp"
#include "model/simulation_stop.hpp"
#include "model/window_model.hpp"
#include "registry/schemes.hpp"

namespace nscdd {

namespace run_detail {

template <class M>
std::string model_name() {
    return std::to_string(M::dim) + "D " + M::Law::name;
}
template <class M>
std::string model_name(std::span<const Wall<M>> walls) {
    const bool driven = std::any_of(walls.begin(), walls.end(), [](const Wall<M>& wall) { return wall.driven; });
    return model_name<M>() + (driven ? ", driven walls" : ", kinematic walls");
}

template <class M>
FinalMeasures final_measures(const Simulation<M>& simulation, const StepReport& last) {
    const Measures<M> m = measure(simulation);
    FinalMeasures final;
    final.kinetic_energy = m.kinetic_energy;
    final.free_velocity_norm = last.free_norm;
    final.velocity_change_norm = last.solve.velocity_change_norm;
    final.coordination = m.coordination();
    final.overlap = std::max(0.0, m.largest_overlap) / simulation.least_radius();
    final.momentum.assign(m.momentum.data(), m.momentum.data() + M::dim);
    final.angular_momentum.assign(m.angular_momentum.data(), m.angular_momentum.data() + m.rotations);
    final.volume = box_edges<M>(simulation.settings()).prod();
    final.grains_volume = m.grains_volume;
    for (int i = 0; i < M::dim; ++i) {
        std::vector<double>& row = final.stress.emplace_back();
        for (int j = 0; j < M::dim; ++j)
            row.push_back(final.volume > 0 ? m.virial(i, j) / final.volume : m.virial(i, j));
    }
    return final;
}

// Numbers of grains by their multiplicity in the last step.
template <class M>
std::map<std::string, std::int64_t> multiplicities(const Simulation<M>& simulation) {
    const auto visit = [&simulation](std::size_t k, auto&& count) {
        const Subdomain<M>& part = simulation.parts()[k];
        for (std::size_t g = 0; g < part.grains.size(); ++g)
            if (part.primary(g)) count(static_cast<std::size_t>(part.problem.multiplicity[g]));
    };
    const double most = reduce(simulation.comm(), 0, [&visit](std::size_t k) {
        Buffer largest{1};
        visit(k, [&largest](std::size_t m) { largest[0] = std::max(largest[0], double(m)); });
        return largest;
    })[0];
    const auto size = static_cast<std::size_t>(most);
    const std::span<const double> counts = reduce(simulation.comm(), size, [&](std::size_t k) {
        Buffer own(size);
        visit(k, [&own](std::size_t m) { ++own[m - 1]; });
        return own;
    });
    std::map<std::string, std::int64_t> found;
    for (std::size_t m = 1; m <= size; ++m)
        if (counts[m - 1] > 0) found[std::to_string(m)] = static_cast<std::int64_t>(counts[m - 1]);
    return found;
}

// What FCLIB cannot say is refused before the steps are made.
template <class M>
void check_export(const Scene& scene) {
    if constexpr (!detail::InLocalForm<typename M::Law>)
        throw InputError(fmt::format("{}: FCLIB has no contact law {}", scene.file, M::Law::name));
    if constexpr (M::rolling && M::dim == 3)
        for (const ScenePair& pair : scene.pairs)
            if (const auto twisting = pair.coefficients.find("twisting");
                twisting != pair.coefficients.end() && twisting->second > 0)
                throw InputError(fmt::format("{}: pair '{}'-'{}': FCLIB has no resistance to twisting: leave it out",
                                             scene.file, scene.materials[static_cast<std::size_t>(pair.a)].name,
                                             scene.materials[static_cast<std::size_t>(pair.b)].name));
}

// The problem of a step that sequential NLGS has solved, solved on to the options of the request.
template <class M>
ExportedProblem solve_on(ContactProblem<M> problem, const ExportRequest& request) {
    ExportedProblem out;
    out.report = nlgs(problem, request.options);
    const detail::LocalForm<M> local = assemble(problem);
    const auto r = local_impulses(problem);
    out.solution = to_solution(local, r, error_measures(local, r), "nlgs");
    if (request.global) {
        GlobalProblem global = global_form(problem);
        out.solution.v = body_velocities(global, out.solution.r);
        out.problem = std::move(global);
    } else {
        out.problem = to_sparse(local);
    }
    return out;
}

// Collective. With an .xdmf for ParaView.
template <class M>
State write_last_state(const Simulation<M>& simulation, const RunRequest& request, FileSet& files) {
    const State head = state_head(simulation, request);
    if (request.outputs.state) {
        write_state(simulation, head, files, *request.outputs.state);
        write_on_first(simulation.comm(),
                       [&] { write_xdmf(files, *request.outputs.state, head, simulation.grain_count()); });
    }
    return head;
}

// After a step that was refused: the state with which it began, series and frames take their places, and the reason is
// told with the names of the walls. `before`: the simulation before the step, if a state is asked for. steps: those
// made. Collective.
template <class M>
[[noreturn]] void end_refused(StepRefused::Refusal refusal, const Simulation<M>& simulation,
                              const std::optional<Simulation<M>>& before, const std::vector<StepReport>& steps,
                              const RunRequest& request, Recorder<M>& recorder, FileSet& files) {
    refusal.step += static_cast<int>(request.start_step);
    std::vector<std::string> walls;
    for (const auto& wall : request.scene.walls) walls.push_back(wall.name);
    for (std::size_t o = 0; o < request.scene.obstacles.size(); ++o)
        walls.resize(walls.size() + simulation.settings().obstacles[o].surface->size(),
                     request.scene.obstacles[o].name);
    std::string told = StepRefused::describe(refusal, walls);
    if (const auto failed = std::ranges::count(steps, false, [](const StepReport& s) { return s.solve.converged; }))
        told += fmt::format("; {} of the {} steps before it did not converge", failed, steps.size());
    if (simulation.steps() > 0) {
        if (before)
            told += fmt::format("; the state before it, of step {}, is in {}",
                                write_last_state(*before, request, files).step, *request.outputs.state);
        recorder.save();
        write_on_first(simulation.comm(), [&] { files.commit(); });
    }
    throw InputError(told);
}

// The step solver, which also adds up what it communicates and spends.
template <class M>
class MeteredSolver {
  public:
    MeteredSolver(AnyStepSolver<M> solve) : solve_(std::move(solve)), communicated_(communicated_columns) {}
    SolveReport operator()(std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
        const Buffer before = communicated(comm);
        const double cpu = cpu_seconds();
        const SolveReport report = solve_(parts, comm, seconds);
        cpu_ += cpu_seconds() - cpu;
        const Buffer after = communicated(comm);
        for (std::size_t n = 0; n < after.size(); ++n) communicated_[n] += after[n] - before[n];
        return report;
    }
    double cpu() const { return cpu_; }  // [s]
    const Buffer& traffic() const { return communicated_; }

  private:
    AnyStepSolver<M> solve_;
    Buffer communicated_;
    double cpu_ = 0;
};

// Makes the steps of the run into `result`: all of them, or those up to where [stop] or SIGUSR1 ended it. Collective.
template <class M>
void make_steps(Simulation<M>& simulation, MeteredSolver<M>& solver, RunRequest& request, FileSet& files,
                RunResult& result) {
    const Scene& scene = request.scene;
    Communicator& comm = simulation.comm();
    Progress progress(!request.quiet && comm.ranks()[0] == 0, scene.step.count);
    std::optional<Checkpoints> checkpoints;
    if (request.outputs.checkpoint) checkpoints.emplace(comm, request.outputs.every.value_or(CheckpointEvery{}));
    Recorder<M> recorder(simulation, request, files);
    Exchange<M> exchange(scene, request.so_far);
    StopTest<M> stop(simulation, scene, request.so_far);
    std::optional<Simulation<M>> before;  // the step under way
    for (int step = 1; step <= scene.step.count && !result.stopped && !result.stopped_by; ++step) {
        if (request.outputs.state) before.emplace(simulation);
        const State::SoFar so_far_before = request.so_far;
        exchange.before_step(simulation, time_now(simulation, request), request.start_step + step);
        push_walls(scene, simulation);
        try {
            result.steps.push_back(simulation.step(std::ref(solver)));
        } catch (const StepRefused& refused) {
            request.so_far = so_far_before;
            end_refused<M>(refused.refusal, simulation, before, result.steps, request, recorder, files);
        }
        result.stopped_by = stop.after(simulation, time_now(simulation, request));
        recorder.after(result.steps.back(), result.stopped_by.has_value());
        progress.show(step, fmt::format("{} iterations", result.steps.back().solve.iterations));
        if (!checkpoints || step == scene.step.count || result.stopped_by) continue;
        const auto due = checkpoints->after(request.start_step + step);
        if (due != Checkpoints::Due::no) write_checkpoint(simulation, request, scene.step.count - step);
        result.last_step = request.start_step + step;
        result.stopped = due == Checkpoints::Due::write_and_stop;
    }
    recorder.save();
}

// A line for each obstacle that goes farther in a step than the smallest grain's radius. Collective.
template <class M>
std::vector<std::string> fast_obstacles(const BuiltScene<M>& built, const Scene& scene, Communicator& comm) {
    std::vector<std::string> lines;
    if (scene.obstacles.empty()) return lines;
    struct Least {
        double minus_radius = -std::numeric_limits<double>::infinity();
        auto summed() { return std::tie(); }
        auto largest() { return std::tie(minus_radius); }
    };
    const double least = -reduce<Least>(comm, [&built](std::size_t k) {
                              Least own;
                              for (const Grain<M>& grain : built.grains)
                                  if (k == 0) own.minus_radius = std::max(own.minus_radius, -grain.radius);
                              return own;
                          }).minus_radius;
    for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
        const double speed = automatic_detail::speed_of(scene.obstacles[o].path) +
                             automatic_detail::turning_speed(built.settings.obstacles[o]);
        if (speed * built.settings.h > least)
            lines.push_back(
                fmt::format("{}: obstacle '{}' moves by {:.2g} radii of the smallest grain in a step: its "
                            "edges may throw grains; with an h of {:.2g} s it moves by one",
                            scene.file, scene.obstacles[o].name, speed * built.settings.h / least, least / speed));
    }
    return lines;
}

// Says the notes of a run at its start, and keeps them. Collective.
template <class M>
void begin_run(const BuiltScene<M>& built, const RunRequest& request, Communicator& comm, RunResult& result) {
    const Problem problem = problem_of<M>(built, request.scene, comm);
    result.problem = problem.checksum;
    result.notes = notes(request, problem.grains_of);
    result.notes.insert(result.notes.end(), built.notes.begin(), built.notes.end());
    std::ranges::copy(fast_obstacles(built, request.scene, comm), std::back_inserter(result.notes));
    for (const auto& material : request.scene.materials) result.densities.push_back(material.density);
    for (const auto& wall : built.settings.walls) result.wall_masses.push_back(wall.mass);
    if (!request.says_notes || comm.ranks()[0] != 0) return;
    for (const std::string& note : result.notes) say(stderr, "nscdd: note: {}\n", one_line(note));
}

}  // namespace run_detail

template <class M>
RunResult run_model(RunRequest& request, Communicator& comm, FileSet& files) {
    using namespace run_detail;
    const Scene& scene = request.scene;
    if (request.export_request) check_export<M>(scene);
    BuiltScene<M> built = build_scene<M>(request, comm);
    keep_automatic_step(request, built);
    std::vector<int> periodic = std::move(request.packing.periodic);
    request.packing = {};
    request.packing.periodic = std::move(periodic);  // of which a note may tell
    request.from = {};
    const bool steps = !request.window && !request.calibration;
    RunResult result;
    result.options = scene.solver.options(sweeps(*request.scheme));
    if (steps) begin_run(built, request, comm, result);
    ChosenSolver<M> chosen = choose_solver<M>(*request.scheme, request.interface, result.options);

    const double began = comm.now();
    const LoadMeter load;
    Simulation<M> simulation(comm, std::move(built.settings), built.grains, built.impulses,
                             built.broad_phase ? &*built.broad_phase : nullptr);
    built = {};
    result.model = steps ? model_name<M>(simulation.walls()) : model_name<M>();
    result.interface = chosen.interface;
    result.partition = sequential(*request.scheme) ? "none" : simulation.broad_phase().partition().name();
    result.grains = simulation.grain_count();
    result.ranks = comm.size();
    if (!steps) {
        push_walls(scene, simulation);
        const auto solver = [&](const SolveOptions& o) {
            return choose_solver<M>(*request.scheme, request.interface, o).solve;
        };
        if (request.window) result.window = time_window(simulation, *request.window, result.options, solver);
        if (request.calibration) result.calibration = calibrate_work(simulation, *request.calibration, result.options);
        return result;
    }
    MeteredSolver<M> solver(std::move(chosen.solve));
    make_steps(simulation, solver, request, files, result);
    if (result.stopped) return result;

    const double total = comm.now() - began;
    result.load = gather_load(load, comm);
    result.costs = gather_costs(simulation, total, solver.cpu(), solver.traffic());
    result.dimension = M::dim;
    result.friction = M::friction;
    result.least_radius = simulation.least_radius();
    result.final = final_measures(simulation, result.steps.back());
    result.last_step = write_last_state(simulation, request, files).step;
    result.answer = answer_checksum(simulation);
    const Memory memory = peak_memory(comm);
    result.memory = memory.total;
    result.most_memory = memory.most;
    result.multiplicity = multiplicities(simulation);
    result.so_far = request.so_far;
    result.grains_left = simulation.grain_count();
    if constexpr (detail::InLocalForm<typename M::Law>)
        if (request.export_request) result.exported = solve_on(simulation.parts()[0].problem, *request.export_request);
    return result;
}

}  // namespace nscdd
