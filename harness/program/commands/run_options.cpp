#include "commands/run_options.hpp"

#include "commands/number_option.hpp"

namespace nscdd {
namespace {

void read_threads(const std::string& text, RunArguments& run) {
    run.thread_a_core = text == "auto";
    if (run.thread_a_core) return;
    int threads = 0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), threads);
    if (fault != std::errc() || end != text.data() + text.size() || threads < 1 || threads > largest_subdomains)
        throw InputError(
            fmt::format("--threads '{}': expected auto or a whole number from 1 to {}", text, largest_subdomains));
    run.threads = threads;
}

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

// An option for every field of SolveOptions; under the name that it had in earlier programs too.
void add_solve_options(CLI::App& command, SolveSettings& solver) {
    const SolveOptions defaults = default_options(Method::accelerated);
    detail::visit_options(defaults, [&](const detail::OptionInfo& info, auto value) {
        const std::function<void(const decltype(value)&)> take = [&solver, name = info.name](const auto& given) {
            solver.given[name] = given;
        };
        CLI::Option* option = add_table_option(command, info, fmt::format("the scene's, or {}", value), take);
        detail::OptionInfo earlier = info;
        earlier.name = earlier_name(info.name);
        if (!earlier.name) return;
        const std::string now = "now " + dashed(info.name);
        earlier.meaning = now.c_str();
        const auto alone = [=](const auto& given) {
            if (option->count() > 0)
                throw CLI::ValidationError(
                    dashed(earlier.name),
                    fmt::format("is the earlier name of {}, which is given too", dashed(info.name)));
            take(given);
        };
        add_table_option<std::remove_cv_t<decltype(value)>>(command, earlier, "", alone)->group("Earlier names");
    });
}

void add_subdomain_options(CLI::App& command, RunArguments& run) {
    command
        .add_option("-n,--subdomains", run.subdomains,
                    "Subdomains; under mpirun dealt to its processes, of which each needs one (default: 1 a thread of "
                    "each process)")
        ->check(whole_number(1, largest_subdomains));
    add_text(command, "--threads",
             "That share the subdomains of a process, a subdomain each unless -n says more; auto: one a core that the "
             "process may use, over MPI one (default: 1)",
             [&run](const std::string& text) { read_threads(text, run); });
    add_grid_option(command, run);
    command
        .add_option("--imbalance", run.partition.given_imbalance,
                    fmt::format("Contacts of the busiest subdomain over the mean, beyond which bisection and metis "
                                "divide anew (default: {:g})",
                                detail::default_imbalance))
        ->check(number_in({1, 1e6}));
    add_within_node_option(command, run);
    add_choice(command, "--transport", transport_names, "auto: mpi when started by mpirun (default: auto)",
               [&run](Transport value) { run.transport = value; });
}

void add_output_options(CLI::App& command, RunArguments::Outputs& outputs) {
    command.add_option("--json", outputs.json, "Results to write, see reports/run.schema.json")->check(file_name());
    command
        .add_option("--state", outputs.state,
                    "Last state to write (HDF5), with an .xdmf beside it for ParaView; where a step is refused, the "
                    "one before it")
        ->check(file_name());
    command
        .add_option("--series", outputs.series,
                    "Time series to write, a row a step: strain, stress, energy and more, see reports/series.md. The "
                    "name ends in .h5 or .csv; may be given for each")
        ->allow_extra_args(false);
    command
        .add_option("--frames", outputs.frames,
                    "Grains, contacts with their forces, and walls to write on the way; may be given for each of: a "
                    "name that ends in .pvd, for ParaView, with .contacts.pvd and .walls.pvd beside it; .h5, all in "
                    "one HDF5 file. Frames can be read at any time, also of a run that is killed")
        ->allow_extra_args(false);
    command.add_option("--frame-every", outputs.frame_every, "Steps between frames (default: 1)")
        ->check(whole_number());
    command
        .add_option("--log-every", outputs.log_every,
                    "Steps between lines with step, time, iterations, eta, contacts, kinetic energy and stress, on "
                    "standard error and in --log (default: 100 lines, with --log)")
        ->check(whole_number());
    command.add_option("--log", outputs.log, "File to append these lines to")->check(file_name());
    command
        .add_option("--checkpoint", outputs.checkpoint,
                    "State to write on the way, from which --from goes on to the end of this run, to the last bit "
                    "on as many subdomains; it may be the file of --from. On SIGUSR1, to any rank, it is "
                    "written and the run stops, exit code 4, with series and frames so far and no other "
                    "results")
        ->check(file_name());
    add_text(command, "--every",
             "Steps between checkpoints, such as 50, or seconds, such as 60s (default: on SIGUSR1 alone)",
             [&outputs](const std::string& text) { outputs.every = read_checkpoint_every(text); });
}

}  // namespace

void add_source_options(CLI::App& command, RunArguments& run, const std::string& going_on) {
    command.add_option("scene", run.start.scene, "Scene (TOML)")->required()->check(file_name());
    command.add_option("--packing", run.start.packing, "HDF5 packing instead of the scene's own")->check(file_name());
    command.add_option("--from", run.start.from, going_on)->check(file_name());
    command.add_flag("--adopt", run.start.adopt, "Go on from the state of another scene with as many walls");
}

void add_scheme_options(CLI::App& command, RunArguments& run, bool (*wanted)(const SchemeInfo&)) {
    const auto every = [](const PartitionInfo&) { return true; };
    const char* by_number = run.scheme ? "" : " (default: nlgs, and dcs of several subdomains)";
    command.add_option("--scheme", run.scheme, help_of(offered_schemes(), wanted) + by_number)
        ->check(CLI::IsMember(names_of(offered_schemes(), wanted)))
        ->default_str(run.scheme.value_or(""));
    add_choice(command, "--interface", interface_names,
               "How the interface problem is solved (default: ccs factorised, dcs closed-form)",
               [&run](Interface value) { run.interface = value; });
    add_choice(command, "--multiplicity", multiplicity_names,
               "Copies of a grain that share its mass and are glued: minimal, those with a contact; predicted, those "
               "with a candidate of the last broad phase, as in the paper (default: minimal)",
               [&run](Multiplicity value) { run.multiplicity = value; });
    command
        .add_option("--partition", run.partition.kind,
                    "How space is dealt to subdomains: " + help_of(offered_partitions(), every) +
                        " (default: bisection, with --grid grid)")
        ->check(CLI::IsMember(names_of(offered_partitions(), every)));
    add_choice(command, "--method", method_names,
               "auto: accelerated; paper: Alg. 1 of the paper as it is written (default: the scene's, or auto)",
               [&run](Method value) { run.solver.method = value; });
}

void add_grid_option(CLI::App& command, RunArguments& run) {
    add_text(command, "--grid", "Cells per axis, e.g. 2x2x1 (default: nearest to cubes)",
             [&run](const std::string& text) { run.partition.grid = read_grid(text); });
}

void add_within_node_option(CLI::App& command, RunArguments& run) {
    add_choice(command, "--within-node", node_transport_names,
               "How processes of one node send each other messages of the iteration: memory that they share, or "
               "messages of MPI (default: memory)",
               [&run](NodeTransport value) { run.within_node = value; });
}

CLI::App* add_run(CLI::App& app, RunArguments& run) {
    CLI::App* command =
        app.add_subcommand("run", "Step a scene by sequential NLGS or Newton, or by NSCDD in-process or under mpirun");
    add_source_options(
        *command, run,
        "Go on from a state that --state or --checkpoint wrote: to the last bit on as many subdomains. From a "
        "checkpoint the run makes the steps that were left, unless --steps says otherwise. The state of "
        "another scene is refused: names of scene, materials and walls, densities, normals, and number, "
        "radii and materials of the grains must be the same. Forces and motions, friction, "
        "restitution, h and the solver may change");
    add_scheme_options(*command, run, [](const SchemeInfo&) { return true; });
    add_subdomain_options(*command, run);
    command->add_option("--steps", run.steps, "Instead of the scene's")->check(whole_number());
    add_solve_options(*command, run.solver);
    command
        ->add_option("--repeat", run.repeat,
                     "Runs from the start, to keep the one with the median CPU time of the solver")
        ->check(whole_number())
        ->capture_default_str();
    add_output_options(*command, run.outputs);
    command->add_flag("--quiet", run.quiet, "No progress, no summary");
    return command;
}

}  // namespace nscdd
