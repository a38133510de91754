// The run of one model. Included by the generated run_model_*.cpp only.
#pragma once

#include <time.h>

#include <map>

#include "calibrate_model.hpp"
#include "local_form.hpp"
#include "notes.hpp"
#include "problem.hpp"
#include "progress.hpp"
#include "recorder.hpp"
#include "registry/schemes.hpp"
#include "run_costs.hpp"
#include "window_model.hpp"

namespace nscdd {

namespace run_detail {

inline SolveOptions solve_options(const SolverSettings& solver, const std::string& scheme) {
    SolveOptions options;
    options.tolerance = solver.tolerance;
    options.velocity_error = solver.velocity_error;
    options.energy_made = solver.energy_made;
    options.penetration = solver.penetration;
    options.gap_error = solver.gap_error;
    options.distance = solver.distance;
    options.check_every = solver.check_every;
    options.max_iterations = solver.max_iterations;
    if (!sweeps(scheme)) return options;
    options.sweeps = solver.sweeps;
    if (solver.method == "auto") {
        options = options.accelerated();
        options.newton_contacts = solver.newton_contacts;
    }
    if (solver.window) options.window = *solver.window;
    options.relaxation = solver.relaxation;
    return options;
}

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
nlohmann::json final_measures(const Simulation<M>& simulation) {
    const Measures<M> m = measure(simulation);
    const double volume = box_edges<M>(simulation.walls()).prod();
    nlohmann::json json = {
        {"kinetic_energy", m.kinetic_energy},
        {"momentum", std::vector<double>(m.momentum.data(), m.momentum.data() + M::dim)},
        {"angular_momentum", std::vector<double>(m.angular_momentum.data(), m.angular_momentum.data() + m.rotations)},
        {"max_overlap", std::max(0.0, m.largest_overlap) / simulation.least_radius()},
        {"coordination", m.coordination()}};
    nlohmann::json rows = nlohmann::json::array();
    for (int i = 0; i < M::dim; ++i) {
        std::vector<double> row;
        for (int j = 0; j < M::dim; ++j) row.push_back(volume > 0 ? m.virial(i, j) / volume : m.virial(i, j));
        rows.push_back(row);
    }
    json[volume > 0 ? "stress" : "virial"] = rows;
    if (volume > 0) json["solid_fraction"] = m.grains_volume / volume;
    return json;
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

// StepEnergy of every step, by name.
struct EnergySeries {
    std::vector<double> before, kinetic, external, walls, normal, friction, round_off;

    void add(const StepEnergy& e) {
        before.push_back(e.before);
        kinetic.push_back(e.kinetic);
        external.push_back(e.external);
        walls.push_back(e.walls);
        normal.push_back(e.normal);
        friction.push_back(e.friction);
        round_off.push_back(e.round_off());
    }
};
inline void to_json(nlohmann::json& json, const EnergySeries& e) {
    json = {{"before", e.before}, {"kinetic", e.kinetic},   {"external", e.external},  {"walls", e.walls},
            {"normal", e.normal}, {"friction", e.friction}, {"round_off", e.round_off}};
}

// The problem of a step that sequential NLGS has solved, solved on to `options`.
template <class M>
ExportedProblem solve_on(ContactProblem<M> problem, const SolveOptions& options) {
    ExportedProblem out;
    out.report = nlgs(problem, options);
    const DelassusProblem<M::dim> local = assemble(problem);
    const LocalVectors<M::dim> r = local_impulses(problem);
    out.problem = to_sparse(local);
    out.solution = to_solution(local, r, error_measures(local, r), "nlgs");
    return out;
}

// Collective. With an .xdmf for ParaView.
template <class M>
State write_last_state(const Simulation<M>& simulation, const RunRequest& request, FileSet& files) {
    const State head = state_head(simulation, request);
    if (!request.state.empty()) {
        write_state(simulation, head, files, request.state);
        write_on_first(simulation.comm(), [&] { write_xdmf(files, request.state, head, simulation.grain_count()); });
    }
    return head;
}

// After a step that was refused: the state with which it began, series and frames take their places, and the reason is
// told with the names of the walls. `before`: the simulation before the step, if a state is asked for. Collective.
template <class M>
[[noreturn]] void end_refused(Refusal refusal, const Simulation<M>& simulation,
                              const std::optional<Simulation<M>>& before, const RunRequest& request,
                              Recorder<M>& recorder, FileSet& files) {
    refusal.step += static_cast<int>(request.start_step);
    std::vector<std::string> walls;
    for (const auto& wall : request.scene.walls) walls.push_back(wall.name);
    std::string told = describe(refusal, walls);
    if (simulation.steps() > 0) {
        if (before)
            told += fmt::format("; the state before it, of step {}, is in {}",
                                write_last_state(*before, request, files).step, request.state);
        recorder.save();
        write_on_first(simulation.comm(), [&] { files.commit(); });
    }
    throw InputError(told);
}

}  // namespace run_detail

template <class M>
RunResult run_model(RunRequest& request, Communicator& comm, FileSet& files) {
    using namespace run_detail;
    const Scene& scene = request.scene;
    if (request.export_options && !SolvedOnCone<typename M::Law>)
        throw InputError(fmt::format("{}: FCLIB has no contact law {}", scene.file, M::Law::name));
    BuiltScene<M> built = build_scene<M>(request, comm);
    request.packing = {};
    request.from = {};
    const bool steps = !request.window && !request.calibration;
    Problem problem;
    std::vector<std::string> said;
    if (steps) {
        problem = problem_of<M>(built, scene, comm);
        said = notes(request, problem.grains_of);
        if (request.says_notes && comm.ranks()[0] == 0)
            for (const std::string& note : said)
                std::fputs(fmt::format("nscdd: note: {}\n", one_line(note)).c_str(), stderr);
    }
    const SolveOptions options = solve_options(scene.solver, request.scheme);
    const auto [solve, interface] = choose_solver<M>(request, options);

    RunResult result;
    std::vector<int> iterations;
    std::vector<double> residual, velocity_error, energy_made, penetration, gap_error, distance, scene_distance,
        rebounds_given_up, newton_contacts, contacts;
    EnergySeries energy;
    double interface_grains = 0, free_norm = 0, velocity_change_norm = 0, total_iterations = 0;
    Buffer solving(communicated_columns);
    double solver_cpu = 0;
    const auto counted = [&](std::span<Subdomain<M>> parts, Communicator& c, PhaseSeconds& seconds) {
        const Buffer before = communicated(c);
        const double cpu = cpu_seconds();
        const SolveReport report = solve(parts, c, seconds);
        solver_cpu += cpu_seconds() - cpu;
        const Buffer after = communicated(c);
        for (std::size_t n = 0; n < after.size(); ++n) solving[n] += after[n] - before[n];
        return report;
    };

    std::vector<double> densities, wall_masses;
    for (const auto& material : scene.materials) densities.push_back(material.density);
    for (const auto& wall : built.settings.walls) wall_masses.push_back(wall.mass);

    const double began = comm.now();
    const LoadMeter load;
    Simulation<M> simulation(comm, std::move(built.settings), built.grains, built.impulses,
                             built.rough ? &*built.rough : nullptr);
    const double grains = static_cast<double>(simulation.grain_count());
    built = {};
    if (!steps) {
        push_walls<M>(scene, simulation.walls());
        result.json = request.provenance;
        result.json.update(
            {{"scene", scene.name},
             {"model", model_name<M>()},
             {"grains", grains},
             {"scheme", request.scheme},
             {"interface", interface},
             {"partition", sequential(request.scheme) ? "none" : simulation.broad_phase().partition().name()},
             {"window", options.window},
             {"ranks", comm.size()}});
        const auto solver = [&](const SolveOptions& o) { return choose_solver<M>(request, o).solve; };
        result.json.update(request.window ? time_window(simulation, *request.window, options, solver)
                                          : calibrate_work(simulation, *request.calibration, options));
        return result;
    }
    Progress progress(request.progress && comm.ranks()[0] == 0, scene.step.count);
    std::optional<Checkpoints> checkpoints;
    if (!request.checkpoint.empty()) checkpoints.emplace(comm, request.every);
    Recorder<M> recorder(simulation, request, files);
    std::optional<Simulation<M>> before;  // the step under way
    for (int step = 1; step <= scene.step.count; ++step) {
        if (!request.state.empty()) before.emplace(simulation);
        push_walls<M>(scene, simulation.walls());
        StepReport report;
        try {
            report = simulation.step(counted);
        } catch (const StepRefused& refused) {
            end_refused<M>(refused.refusal, simulation, before, request, recorder, files);
        }
        iterations.push_back(report.solve.iterations);
        residual.push_back(report.solve.residual);
        velocity_error.push_back(report.solve.velocity_error);
        energy_made.push_back(report.solve.energy_made);
        energy.add(report.energy);
        penetration.push_back(report.solve.penetration / simulation.least_radius());
        gap_error.push_back(report.solve.gap_error);
        distance.push_back(report.solve.distance);
        scene_distance.push_back(report.solve.scene_distance);
        newton_contacts.push_back(report.solve.newton_contacts);
        rebounds_given_up.push_back(report.solve.rebounds_given_up);
        contacts.push_back(report.contacts);
        interface_grains += report.interface_grains;
        free_norm = report.free_norm;
        velocity_change_norm = report.solve.velocity_change_norm;
        total_iterations += report.solve.iterations;
        result.unconverged_steps += !report.solve.converged;
        recorder.after(report);
        progress.show(step, fmt::format("{} iterations", report.solve.iterations));
        if (!checkpoints || step == scene.step.count) continue;
        const auto due = checkpoints->after(request.start_step + step);
        if (due != Checkpoints::Due::no) write_checkpoint(simulation, request, scene.step.count - step);
        result.last_step = request.start_step + step;
        result.stopped = due == Checkpoints::Due::write_and_stop;
        if (!result.stopped) continue;
        recorder.save();
        return result;
    }
    recorder.save();
    const double total = comm.now() - began;

    nlohmann::json json = request.provenance;
    json["load"] = load_of(load, comm, request.threads);
    json.update(costs(simulation, total, solver_cpu, solving, total_iterations));
    nlohmann::json measures = final_measures(simulation);
    measures["free_velocity_norm"] = free_norm;
    measures["turned_velocity_norm"] = velocity_change_norm;
    result.last_step = write_last_state(simulation, request, files).step;
    const int processes = request.over_mpi ? request.share.parts : 1;
    json.update({{"schema", "nscdd.run/1"},
                 {"scene", scene.name},
                 {"problem", problem.checksum},
                 {"answer", answer_checksum(simulation)},
                 {"notes", said},
                 {"dimension", M::dim},
                 {"grains", simulation.grain_count()},
                 {"model", model_name<M>(simulation.walls())},
                 {"friction", M::friction},
                 {"subdomains", comm.size()},
                 {"threads", request.threads},
                 {"scheme", request.scheme},
                 {"interface", interface},
                 {"partition", sequential(request.scheme) ? "none" : simulation.broad_phase().partition().name()},
                 {"transport", request.over_mpi             ? "mpi"
                               : sequential(request.scheme) ? "sequential"
                                                            : "in-process"},
                 {"processes", processes},
                 {"ranks_measured", processes == comm.size() && processes <= request.provenance.machine.cores},
                 {"steps", scene.step.count},
                 {"start_step", request.start_step},
                 {"h", scene.step.h},
                 {"tolerance", options.tolerance},
                 {"check_every", options.check_every},
                 {"sweeps", options.sweeps},
                 {"window", options.window},
                 {"relaxation", options.relaxation},
                 {"iterations", iterations},
                 {"residual", residual},
                 {"velocity_error", velocity_error},
                 {"velocity_error_allowed", options.velocity_error},
                 {"energy_made", energy_made},
                 {"energy_made_allowed", options.energy_made},
                 {"energy", energy},
                 {"penetration", penetration},
                 {"penetration_allowed", options.penetration},
                 {"gap_error", gap_error},
                 {"gap_error_allowed", options.gap_error},
                 {"distance", distance},
                 {"scene_distance", scene_distance},
                 {"distance_allowed", options.distance},
                 {"newton_contacts", newton_contacts},
                 {"rebounds_given_up", rebounds_given_up},
                 {"contacts", contacts},
                 {"interface_grains", interface_grains / scene.step.count},
                 {"interface_share", interface_grains / scene.step.count / grains},
                 {"peak_memory", peak_memory(comm)},
                 {"multiplicity", multiplicities(simulation)},
                 {"converged", result.unconverged_steps == 0},
                 {"unconverged_steps", result.unconverged_steps},
                 {"densities", densities},
                 {"wall_masses", wall_masses},
                 {"final", measures}});
    if constexpr (SolvedOnCone<typename M::Law>)
        if (request.export_options) result.exported = solve_on(simulation.parts()[0].problem, *request.export_options);
    if (request.goes_on()) json["from"] = request.from_file;
    result.json = std::move(json);
    return result;
}

}  // namespace nscdd
