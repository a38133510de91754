// The program `nscdd`: pack, run, compare, exchange of contact problems as FCLIB, and simulated machines.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <span>

#include "calibrate.hpp"
#include "compare.hpp"
#include "export_fclib.hpp"
#include "launch.hpp"
#include "libraries.hpp"
#include "pack.hpp"
#include "run_options.hpp"
#include "say.hpp"
#include "scale.hpp"
#include "solve_fclib.hpp"
#include "window.hpp"

int main(int argc, char** argv) {
    nscdd::survive_streams_and_limits();
    CLI::App app{"nscdd: Nonsmooth Contact Domain Decomposition for disks and spheres"};
    app.require_subcommand(1);
    app.set_version_flag("--version", [] {
        const nscdd::Provenance me = nscdd::provenance(0, nullptr);
        return fmt::format("nscdd, commit {}, {}, {} doubles a vector{}", me.commit, me.machine.compiler,
                           me.machine.lanes,
                           me.machine.fused ? "" : ", no fused products: its counts are not those of other machines");
    });
    app.footer(R"(Examples:
  nscdd pack cases/packings/triaxial.toml -o spheres.h5
  nscdd run cases/reduced/triaxial.toml --packing spheres.h5 --json nlgs.json --state nlgs.h5
  nscdd run cases/reduced/triaxial.toml --packing spheres.h5 --scheme dcs --subdomains 8 --json dcs.json --state dcs.h5
  mpirun -np 2 nscdd run cases/reduced/triaxial.toml --packing spheres.h5 --scheme ccs --json ccs.json --state ccs.h5
  nscdd compare nlgs.json dcs.json
  nscdd export-fclib cases/reduced/triaxial.toml --packing spheres.h5 --step 10 -o step10.hdf5
  nscdd solve-fclib step10.hdf5 --tolerance 1e-6
  nscdd calibrate cases/reduced/triaxial.toml --packing spheres.h5 -o costs.json
  nscdd scale cases/reduced/triaxial.toml --packing spheres.h5 --ranks 1,2,4,8 --platform cases/platforms/node48.xml
      --costs costs.json --json scale.json

Files to write are checked before the first step: they are regular files or new ones, in folders that can be written, and
neither an input nor another output. All of a command's files are written before the first takes its place: the old ones
stay, whole, where one fails. Frames and checkpoints alone take their place on the way, each whole. A symbolic link stays
and the file that it leads to is replaced. Grains, [[grain]]s and rows of data sets are counted from 0 in messages.

Exit codes: 0 done; 1 bad input, or a file that cannot be written; 2 compare found a disagreement; 3 the run is complete,
but steps hit the cap of iterations, or a problem was not solved to tolerance; 4 the run was stopped by SIGUSR1 and goes
on from its checkpoint; 5 compare found another answer: the runs differ, and each is exact to 1e-8.)");

    nscdd::PackArguments pack;
    auto* pack_command = app.add_subcommand(
        "pack", "Generate a packing: by LAMMPS where it is, else by our own contact dynamics; checked");
    pack_command
        ->add_option("specification", pack.specification,
                     "TOML: dimension, grains, radius, spread, aspect, seed, solid_fraction, generator")
        ->required();
    pack_command->add_option("-o,--output", pack.output, "HDF5 file to write (x, radius, box)")->required();
    pack_command
        ->add_option("--generator", pack.generator,
                     "auto: LAMMPS if lmp is on PATH; lammps; own. Default: the specification's, or auto")
        ->check(CLI::IsMember({"auto", "lammps", "own"}));
    pack_command->add_flag("--quiet", pack.quiet, "No progress");

    nscdd::RunArguments run;
    auto* run_command = add_run(app, run);

    std::string reference, candidate, compare_json;
    auto* compare_command = app.add_subcommand("compare", "Does a run agree with its reference?");
    compare_command->add_option("reference", reference, "JSON of the reference run")->required();
    compare_command->add_option("candidate", candidate, "JSON of the run to judge")->required();
    compare_command->add_option("--json", compare_json, "Table to write, see reports/compare.schema.json");

    nscdd::ExportFclibArguments export_fclib;
    auto* export_fclib_command = add_export_fclib(app, export_fclib);
    nscdd::SolveFclibArguments solve_fclib;
    auto* solve_fclib_command = add_solve_fclib(app, solve_fclib);
    nscdd::WindowArguments window;
    auto* window_command = add_window(app, window);
    nscdd::CalibrateArguments calibrate;
    auto* calibrate_command = add_calibrate(app, calibrate);
    nscdd::ScaleArguments scale;
    auto* scale_command = add_scale(app, scale);

    const std::span<char*> words(argv, static_cast<std::size_t>(argc));
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const auto check = [&error](int) {
            if (error.get_exit_code() != 0) throw nscdd::InputError(fmt::format("{}; see --help", error.what()));
        };
        return nscdd::begin_together(words, false, check, [&](const nscdd::Session&, int rank) {
            return rank == 0 ? app.exit(error) : 0;  // prints the help or the version
        });
    }
    try {
        nscdd::Provenance provenance = nscdd::provenance(argc, argv);
        provenance.machine.libraries = nscdd::libraries();
        if (*run_command || *window_command)
            return nscdd::begin_together(
                words, *window_command || run.transport == "mpi", [](int) {},
                [&](const nscdd::Session& session, int) {
                    return *run_command ? nscdd::run(run, provenance, session)
                                        : nscdd::window(window, provenance, session);
                });
        const auto alone = [&](int ranks) {
            if (ranks > 1)
                throw nscdd::InputError(
                    fmt::format("{} is of one process, and {} were started: start it without mpirun",
                                app.get_subcommands()[0]->get_name(), ranks));
        };
        if (nscdd::begin_together(words, false, alone, [](const nscdd::Session&, int) { return 0; }) != 0) return 1;
        if (*pack_command) return nscdd::pack(pack, provenance);
        if (*compare_command) return nscdd::compare(reference, candidate, compare_json, provenance);
        if (*export_fclib_command) return nscdd::export_fclib(export_fclib, provenance);
        if (*solve_fclib_command) return nscdd::solve_fclib(solve_fclib, provenance);
        if (*calibrate_command) return nscdd::calibrate(calibrate, provenance);
        if (*scale_command) return nscdd::scale(scale, provenance);
    } catch (const std::bad_alloc&) {
        nscdd::say(stderr, "nscdd: out of memory\n");
    } catch (const std::exception& error) {
        nscdd::say(stderr, "nscdd: {}\n", nscdd::one_line(error.what()));
    }
    return 1;
}
