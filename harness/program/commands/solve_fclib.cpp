#include "commands/solve_fclib.hpp"

#include <algorithm>
#include <filesystem>

#include "commands/number_option.hpp"
#include "files/load.hpp"
#include "files/replace_file.hpp"
#include "files/say.hpp"
#include "model/solve_local.hpp"
#include "registry/registry.hpp"

namespace nscdd {

namespace {

nlohmann::json to_json(const ErrorMeasures& e) {
    return {{"natural_map", e.natural_map},
            {"natural_map_velocity", e.natural_map_velocity},
            {"natural_map_impulse", e.natural_map_impulse},
            {"eta", e.eta},
            {"least_normal_impulse", e.least_normal_impulse},
            {"unilateral", e.unilateral},
            {"cone_excess", e.cone_excess},
            {"least_normal_velocity", e.least_normal_velocity},
            {"complementarity", e.complementarity},
            {"dissipation", e.dissipation},
            {"worst_contact", e.worst_contact},
            {"worst", e.worst}};
}

// Of a name that the command line has let pass.
const LocalSolverInfo& offered_solver(const std::string& name) {
    return *std::ranges::find(offered_local_solvers(), name, &LocalSolverInfo::name);
}

}  // namespace

CLI::App* add_solve_fclib(CLI::App& app, SolveFclibArguments& arguments) {
    CLI::App* command = app.add_subcommand("solve-fclib", "Solve an FCLIB problem, local or global, of any code");
    command->add_option("file", arguments.file, "FCLIB problem (HDF5)")->required()->check(file_name());
    const auto all = [](const LocalSolverInfo&) { return true; };
    command->add_option("--solver", arguments.solver, help_of(offered_local_solvers(), all))
        ->check(CLI::IsMember(names_of(offered_local_solvers(), all)))
        ->capture_default_str();
    command
        ->add_option(
            "--tolerance", arguments.tolerance,
            "On the natural map, as Siconos 4.4 normalises it, and on that of velocities, which knows no units")
        ->check(positive_number())
        ->capture_default_str();
    auto* max_sweeps = command->add_option("--max-sweeps", arguments.max_sweeps, "Cap on sweeps or gradient steps")
                           ->check(whole_number())
                           ->capture_default_str();
    auto* check_every = command
                            ->add_option("--check-every", arguments.check_every,
                                         "Sweeps or gradient steps between two tests; 1 for studies of counts")
                            ->check(whole_number())
                            ->capture_default_str();
    command->parse_complete_callback([&arguments, max_sweeps, check_every] {
        for (const auto* option : {max_sweeps, check_every})
            if (option->count() > 0 && !offered_solver(arguments.solver).capped)
                throw CLI::ValidationError(option->get_name(),
                                           "is of sweeps, which --solver " + arguments.solver + " does not make");
    });
    command->add_option("-o,--output", arguments.output, "HDF5 file to write: the problem with our /solution")
        ->check(file_name());
    command->add_option("--json", arguments.json, "Measures to write, see reports/fclib.schema.json")
        ->check(file_name());
    command->footer("Example:\n  nscdd solve-fclib problem.hdf5 --tolerance 1e-6 -o solved.hdf5 --json solved.json");
    return command;
}

int solve_fclib(const SolveFclibArguments& arguments, const Provenance& provenance) {
    std::error_code none;
    const auto size = std::filesystem::file_size(arguments.file, none);
    check_outputs({{"--output", arguments.output, none ? 0 : 2 * size}, {"--json", arguments.json}},
                  {{"the problem", arguments.file}});
    const auto problem = read_fclib(arguments.file);
    const auto* global = std::get_if<GlobalProblem>(&problem);
    SolvedLocal solved;
    LocalProblem local;
    try {
        local = global ? condense(*global) : std::get<LocalProblem>(problem);
        Eigen::VectorXd start;
        if (arguments.solver == "none") start = read_fclib_impulses(arguments.file, local.q.size());
        solved = solve_local(local, arguments.solver,
                             {arguments.tolerance, arguments.check_every, arguments.max_sweeps}, start);
        if (global) solved.solution.v = body_velocities(*global, solved.solution.r);
    } catch (const std::runtime_error& error) {
        throw InputError(fmt::format("{}: {}", arguments.file, error.what()));
    }
    FileSet files;
    if (arguments.output) write_fclib_solution(files, *arguments.output, arguments.file, solved.solution);

    const ErrorMeasures& e = solved.measures;
    if (arguments.json) {
        nlohmann::json json = provenance;
        if (offered_solver(arguments.solver).capped) json["check_every"] = arguments.check_every;
        json.update({{"schema", "nscdd.fclib/1"},
                     {"file", arguments.file},
                     {"form", global ? "global" : "local"},
                     {"dimension", local.dim},
                     {"rolling", local.rolls()},
                     {"contacts", local.friction.size()},
                     {"blocks", solved.blocks},
                     {"solver", arguments.solver},
                     {"tolerance", arguments.tolerance},
                     {"iterations", solved.report.iterations},
                     {"solver_cpu", solved.cpu},
                     {"load", load_json(solved.load, 1)},
                     {"converged", solved.report.converged},
                     {"measures", to_json(e)}});
        write_json(files, *arguments.json, json);
    }
    files.commit();
    say("{}: {} contacts in {}D{}, {} {}: natural map {:.3g}, of velocities {:.3g}, of impulses {:.3g}, unilateral "
        "{:.3g}, eta {:.3g}, cone {:.3g}, complementarity {:.3g}, dissipation {:.3g}, worst contact {} ({:.3g}){}\n",
        arguments.file, local.friction.size(), local.dim, local.rolls() ? " that resist rolling" : "",
        solved.report.iterations, offered_solver(arguments.solver).iterations, e.natural_map, e.natural_map_velocity,
        e.natural_map_impulse, e.unilateral, e.eta, e.cone_excess, e.complementarity, e.dissipation, e.worst_contact,
        e.worst, solved.report.converged ? "" : ": NOT CONVERGED");
    return solved.report.converged ? 0 : 3;
}

}  // namespace nscdd
