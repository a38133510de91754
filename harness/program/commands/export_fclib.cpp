#include "commands/export_fclib.hpp"

#include <fmt/format.h>

#include "commands/number_option.hpp"
#include "commands/run_options.hpp"
#include "files/say.hpp"
#include "nscdd/comm/in_process.hpp"

namespace nscdd {

CLI::App* add_export_fclib(CLI::App& app, ExportFclibArguments& arguments) {
    CLI::App* command =
        app.add_subcommand("export-fclib", "Write a step's contact problem as FCLIB, with its solution");
    add_source_options(*command, arguments.run, "Go on from a state that `nscdd run --state` wrote");
    command->add_option("--step", arguments.step, "Step to export, counted from 1")
        ->check(whole_number())
        ->capture_default_str();
    command
        ->add_option("--tolerance", arguments.tolerance,
                     "On eta, of the step exported; those before it have the scene's")
        ->check(positive_number())
        ->capture_default_str();
    command->add_option("--max-iterations", arguments.max_iterations, "Cap of the step exported")
        ->check(whole_number())
        ->capture_default_str();
    command->add_option("--form", arguments.form, "local: u = W r + q; global: M v = H r + f, u = H^T v + w")
        ->check(CLI::IsMember({"local", "global"}))
        ->capture_default_str();
    command->add_option("-o,--output", arguments.output, "HDF5 file to write (/fclib_local or another, /solution)")
        ->required()
        ->check(file_name());
    command->add_flag("--quiet", arguments.run.quiet, "No progress, no summary");
    command->footer(
        "Example:\n  nscdd export-fclib cases/reduced/triaxial.toml --packing spheres.h5 --step 10 -o step10.hdf5");
    return command;
}

int export_fclib(const ExportFclibArguments& arguments, const Provenance& provenance) {
    RunArguments run = arguments.run;
    run.steps = arguments.step;
    RunRequest request = prepare_run(run, provenance, {}, false);
    check_outputs({{"--output", arguments.output}}, inputs_of(run, request.scene));
    request.export_request = {.options = SolveOptions{.tolerance = arguments.tolerance,
                                                      .check_every = request.scene.solver.options(true).check_every,
                                                      .max_iterations = arguments.max_iterations}
                                             .accelerated(),
                              .global = arguments.form == "global"};
    InProcess comm(1);
    FileSet none;
    const RunResult result = choose_model(request.scene)(request, comm, none);
    const auto& [problem, solution, report] = result.exported.value();
    const auto contacts = std::visit([](const auto& any) { return any.friction.size(); }, problem);
    if (contacts == 0)
        throw InputError(fmt::format("{}: step {} has no contacts, there is nothing to export",
                                     arguments.run.start.scene, arguments.step));
    write_fclib(arguments.output, problem, solution,
                {.title = fmt::format("{}, step {}", request.scene.name, result.last_step),
                 .description = fmt::format("Moreau-Jean, h = {}; r are impulses, u velocities at the end of the step "
                                            "with g+/h, or e times those before, in q_N. /solution: {}, natural map "
                                            "{:.3g}, eta {:.3g}. nscdd {}: {}",
                                            request.scene.step.h, solution.solver, solution.natural_map, solution.eta,
                                            provenance.commit, provenance.command),
                 .math_info = arguments.form == "local" ? "W symmetric positive semi-definite"
                                                        : "M diagonal and positive definite"});
    if (!arguments.run.quiet)
        say("{}: {} contacts, {} more iterations: natural map {:.3g}, eta {:.3g}{}\n", arguments.output, contacts,
            report.iterations, solution.natural_map, solution.eta, report.converged ? "" : ": NOT CONVERGED");
    return report.converged ? 0 : 3;
}

}  // namespace nscdd
