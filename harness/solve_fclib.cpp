#include "solve_fclib.hpp"

#include <ctime>
#include <filesystem>

#include "local_form.hpp"
#include "number_option.hpp"
#include "replace_file.hpp"
#include "suitesparse.hpp"

namespace nscdd {

namespace {

nlohmann::json to_json(const ErrorMeasures& e) {
    return {{"natural_map", e.natural_map},
            {"natural_map_velocity", e.natural_map_velocity},
            {"natural_map_impulse", e.natural_map_impulse},
            {"eta", e.eta},
            {"least_normal_impulse", e.least_normal_impulse},
            {"cone_excess", e.cone_excess},
            {"least_normal_velocity", e.least_normal_velocity},
            {"complementarity", e.complementarity},
            {"dissipation", e.dissipation},
            {"worst_contact", e.worst_contact},
            {"worst", e.worst}};
}

// Whether a solver takes many cheap steps, tested now and then.
bool iterates(const std::string& solver) { return solver != "newton" && solver != "none"; }

struct Solved {
    FclibSolution solution;
    SolveReport report;
    ErrorMeasures measures;
    std::size_t blocks;
    double cpu;  // [s]
};

template <int dim>
Solved solve(const LocalProblem& local, const SolveFclibArguments& arguments) {
    const DelassusProblem<dim> problem = to_blocks<dim>(local);
    LocalVectors<dim> r(problem.contact_count(), DelassusProblem<dim>::Vec::Zero());
    Solved solved;
    const auto measure = [&](const LocalVectors<dim>& now) { return natural_map_error(problem, now); };
    const std::clock_t began = std::clock();
    if (arguments.solver == "none") {
        r = by_contact<dim>(read_fclib_impulses(arguments.file, local.q.size()));
        solved.report.residual = measure(r);
        solved.report.converged = solved.report.residual <= arguments.tolerance;
    } else if (arguments.solver == "newton") {
        solved.report = newton_solve<UmfPack>(problem, r, {.tolerance = arguments.tolerance}, measure);
    } else if (arguments.solver == "spg" || arguments.solver == "apgd") {
        solved.report = projected_gradient(problem, r,
                                           {.tolerance = arguments.tolerance,
                                            .check_every = arguments.check_every,
                                            .max_iterations = arguments.max_sweeps},
                                           arguments.solver == "spg" ? Descent::spectral : Descent::nesterov, measure);
    } else {
        solved.report = block_nlgs(problem, r,
                                   {.tolerance = arguments.tolerance,
                                    .check_every = arguments.check_every,
                                    .max_iterations = arguments.max_sweeps});
    }
    solved.cpu = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
    solved.measures = error_measures(problem, r);
    solved.solution = to_solution(problem, r, solved.measures, arguments.solver);
    solved.blocks = problem.blocks.size();
    return solved;
}

}  // namespace

CLI::App* add_solve_fclib(CLI::App& app, SolveFclibArguments& arguments) {
    CLI::App* command = app.add_subcommand("solve-fclib", "Solve an FCLIB problem, local or global, of any code");
    command->add_option("file", arguments.file, "FCLIB problem (HDF5)")->required();
    command
        ->add_option(
            "--solver", arguments.solver,
            "nlgs: Gauss-Seidel in the file's order, from zero; newton: slow and accurate; spg, apgd: projected "
            "gradients; none: judge the file's own /solution")
        ->check(CLI::IsMember({"nlgs", "newton", "spg", "apgd", "none"}))
        ->capture_default_str();
    command->add_option("--tolerance", arguments.tolerance, "On the natural map, normalised as Siconos 4.4 does")
        ->check(positive_number())
        ->capture_default_str();
    auto* max_sweeps = command->add_option("--max-sweeps", arguments.max_sweeps, "Cap on sweeps or gradient steps")
                           ->check(CLI::PositiveNumber)
                           ->capture_default_str();
    auto* check_every = command
                            ->add_option("--check-every", arguments.check_every,
                                         "Sweeps or gradient steps between two tests; 1 for studies of counts")
                            ->check(CLI::PositiveNumber)
                            ->capture_default_str();
    command->parse_complete_callback([&arguments, max_sweeps, check_every] {
        for (const auto* option : {max_sweeps, check_every})
            if (option->count() > 0 && !iterates(arguments.solver))
                throw CLI::ValidationError(option->get_name(),
                                           "is of sweeps, which --solver " + arguments.solver + " does not make");
    });
    command->add_option("-o,--output", arguments.output, "HDF5 file to write: the problem with our /solution");
    command->add_option("--json", arguments.json, "Measures to write, see reports/fclib.schema.json");
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
    Solved solved;
    LocalProblem local;
    try {
        local = global ? condense(*global) : std::get<LocalProblem>(problem);
        solved = local.dim == 2 ? solve<2>(local, arguments) : solve<3>(local, arguments);
        if (global) solved.solution.v = body_velocities(*global, solved.solution.r);
    } catch (const std::runtime_error& error) {
        throw InputError(fmt::format("{}: {}", arguments.file, error.what()));
    }
    FileSet files;
    if (!arguments.output.empty()) write_fclib_solution(files, arguments.output, arguments.file, solved.solution);

    const ErrorMeasures& e = solved.measures;
    if (!arguments.json.empty()) {
        nlohmann::json json = provenance;
        if (iterates(arguments.solver)) json["check_every"] = arguments.check_every;
        json.update({{"schema", "nscdd.fclib/1"},
                     {"file", arguments.file},
                     {"form", global ? "global" : "local"},
                     {"dimension", local.dim},
                     {"contacts", local.friction.size()},
                     {"blocks", solved.blocks},
                     {"solver", arguments.solver},
                     {"tolerance", arguments.tolerance},
                     {"iterations", solved.report.iterations},
                     {"solver_cpu", solved.cpu},
                     {"converged", solved.report.converged},
                     {"measures", to_json(e)}});
        write_json(files, arguments.json, json);
    }
    files.commit();
    fmt::print(
        "{}: {} contacts in {}D, {} {}: natural map {:.3g}, eta {:.3g}, cone {:.3g}, complementarity {:.3g}, "
        "dissipation {:.3g}, worst contact {} ({:.3g}){}\n",
        arguments.file, local.friction.size(), local.dim, solved.report.iterations,
        arguments.solver == "newton" ? "Newton steps"
        : arguments.solver == "nlgs" ? "sweeps"
                                     : "iterations",
        e.natural_map, e.eta, e.cone_excess, e.complementarity, e.dissipation, e.worst_contact, e.worst,
        solved.report.converged ? "" : ": NOT CONVERGED");
    return solved.report.converged ? 0 : 3;
}

}  // namespace nscdd
