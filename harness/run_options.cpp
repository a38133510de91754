#include "run_options.hpp"

#include "nscdd/iterate/anderson.hpp"
#include "number_option.hpp"

namespace nscdd {

void add_source_options(CLI::App& command, RunArguments& run, const std::string& going_on) {
    command.add_option("scene", run.scene, "Scene (TOML)")->required();
    command.add_option("--packing", run.packing, "HDF5 packing instead of the scene's own");
    command.add_option("--from", run.from, going_on);
    command.add_flag("--adopt", run.adopt, "Go on from the state of another scene with as many walls");
}

void add_scheme_options(CLI::App& command, RunArguments& run, bool (*wanted)(const SchemeInfo&)) {
    const auto every = [](const PartitionInfo&) { return true; };
    command.add_option("--scheme", run.scheme, help_of(offered_schemes(), wanted))
        ->check(CLI::IsMember(names_of(offered_schemes(), wanted)))
        ->capture_default_str();
    command
        .add_option("--interface", run.interface,
                    "How the interface problem is solved (default: ccs factorised, dcs closed-form)")
        ->check(CLI::IsMember({"closed-form", "factorised"}));
    command
        .add_option("--multiplicity", run.multiplicity,
                    "Copies of a grain that share its mass and are glued: minimal, those with a contact; predicted, "
                    "those with a candidate of the last rough detection, as in the paper")
        ->check(CLI::IsMember({"minimal", "predicted"}))
        ->capture_default_str();
    command
        .add_option("--partition", run.partition,
                    "How space is dealt to subdomains: " + help_of(offered_partitions(), every) +
                        " (default: bisection, with --grid grid)")
        ->check(CLI::IsMember(names_of(offered_partitions(), every)));
    command
        .add_option("--method", run.method,
                    "auto: accelerated; paper: Alg. 1 of the paper as it is written (default: the scene's, or auto)")
        ->check(CLI::IsMember({"auto", "paper"}));
}

void add_within_node_option(CLI::App& command, RunArguments& run) {
    command
        .add_option("--within-node", run.within_node,
                    "How processes of one node send each other messages of the iteration: memory that they share, or "
                    "messages of MPI")
        ->check(CLI::IsMember({"memory", "messages"}))
        ->capture_default_str();
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
    command
        ->add_option("-n,--subdomains", run.subdomains,
                     "Subdomains; under mpirun dealt to its processes, of which each needs one (default: 1 a process)")
        ->check(whole_number(1, largest_subdomains));
    command->add_option("--threads", run.threads, "That share the in-process subdomains (default: 1); same results")
        ->check(whole_number());
    command->add_option("--grid", run.grid, "Cells per axis, e.g. 2x2x1 (default: nearest to cubes)");
    command
        ->add_option("--imbalance", run.imbalance,
                     "Contacts of the busiest subdomain over the mean, beyond which bisection and metis divide anew "
                     "(default: 1.1)")
        ->check(between(1, 1e6, true));
    add_within_node_option(*command, run);
    command->add_option("--transport", run.transport, "auto: mpi when started by mpirun")
        ->check(CLI::IsMember({"auto", "in-process", "mpi"}))
        ->capture_default_str();
    command->add_option("--steps", run.steps, "Instead of the scene's")->check(whole_number());
    command->add_option("--tolerance", run.tolerance, "On eta, instead of the scene's")->check(positive_number());
    command
        ->add_option("--velocity-error", run.velocity_error,
                     "Largest velocity error of a step, instead of the scene's (default: 0.1)")
        ->check(positive_number());
    command
        ->add_option(
            "--energy-made", run.energy_made,
            "Largest share of energy that contacts may make in a step, of the scene and of each component, instead of "
            "the scene's (default: 1e-3)")
        ->check(positive_number());
    command
        ->add_option(
            "--penetration", run.penetration,
            "Deepest that a step may close a contact, over the least radius, instead of the scene's (default: 1e-3)")
        ->check(positive_number());
    command
        ->add_option(
            "--gap-error", run.gap_error,
            "Proven: a step is exact for gaps that differ by at most this share of the contact's least radius, "
            "instead of the scene's (default: 1e-3)")
        ->check(positive_number());
    command
        ->add_option("--distance", run.distance,
                     "Estimated: distance of the velocities from an answer over what contacts change, of the worst "
                     "component, instead of the scene's (default: 0.3)")
        ->check(positive_number());
    command->add_option("--check-every", run.check_every, "Iterations between two tests; 1 for studies of counts")
        ->check(whole_number());
    command
        ->add_option("--max-iterations", run.max_iterations,
                     "Cap of each attempt at a step, also where fewer than --check-every are left")
        ->check(whole_number());
    command
        ->add_option("--newton-contacts", run.newton_contacts,
                     "Where sweeps get nowhere, Newton's method solves components of at most so many contacts, instead "
                     "of the scene's (default: 2000, none by --method paper)")
        ->check(whole_number(0));
    command->add_option("--sweeps", run.sweeps, "Sweeps per iteration, n_GS")->check(whole_number());
    command->add_option("--window", run.window, "Earlier iterates that Anderson acceleration combines")
        ->check(whole_number(0, Anderson::largest_window));
    command->add_option("--relaxation", run.relaxation, "Of every contact's step, omega")->check(between(0, 2));
    command
        ->add_option("--repeat", run.repeat,
                     "Runs from the start, to keep the one with the median CPU time of the solver")
        ->check(whole_number())
        ->capture_default_str();
    command->add_option("--json", run.json, "Results to write, see reports/run.schema.json");
    command->add_option(
        "--state", run.state,
        "Last state to write (HDF5), with an .xdmf beside it for ParaView; where a step is refused, the one before it");
    command
        ->add_option("--series", run.series,
                     "Time series to write, a row a step: strain, stress, energy and more, see reports/series.md. The "
                     "name ends in .h5 or .csv; may be given for each")
        ->allow_extra_args(false);
    command->add_option(
        "--frames", run.frames,
        "Grains and contacts with their forces to write on the way (HDF5), all frames in one file, with "
        "an .xdmf beside it for ParaView; they can be read at any time, also of a run that is killed");
    command->add_option("--frame-every", run.frame_every, "Steps between frames (default: 1)")->check(whole_number());
    command->add_option("--checkpoint", run.checkpoint,
                        "State to write on the way, from which --from goes on to the end of this run, to the last bit "
                        "on as many subdomains; it may be the file of --from. On SIGUSR1, to any rank, it is "
                        "written and the run stops, exit code 4, with series and frames so far and no other "
                        "results");
    command->add_option("--every", run.every,
                        "Steps between checkpoints, such as 50, or seconds, such as 60s (default: on SIGUSR1 alone)");
    command->add_flag("--quiet", run.quiet, "No progress, no summary");
    return command;
}

}  // namespace nscdd
