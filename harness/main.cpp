// The program `nscdd`: pack, run, compare, report, exchange of contact problems as FCLIB, and simulated machines.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "calibrate.hpp"
#include "compare.hpp"
#include "export_fclib.hpp"
#include "nscdd/solve/anderson.hpp"
#include "number_option.hpp"
#include "pack.hpp"
#include "run.hpp"
#include "scale.hpp"
#include "solve_fclib.hpp"
#include "window.hpp"

namespace {

// The page is drawn by matplotlib: hands over to the generator in reports/.
int report(const std::string& results, const std::string& out) {
    const char* chosen = std::getenv("NSCDD_PYTHON");
    const std::string python = chosen ? chosen : "/usr/bin/python3";  // Debian's, which has its h5py and matplotlib
    const std::string script = NSCDD_REPORTS "/report.py";
    execlp(python.c_str(), python.c_str(), script.c_str(), results.c_str(), "--out", out.c_str(), nullptr);
    throw nscdd::InputError(
        fmt::format("{}: cannot be started; set NSCDD_PYTHON to a Python with h5py and matplotlib", python));
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"nscdd: Nonsmooth Contact Domain Decomposition for disks and spheres"};
    app.require_subcommand(1);
    app.footer(R"(Examples:
  nscdd pack cases/packings/triaxial.toml -o spheres.h5
  nscdd run cases/reduced/triaxial.toml --packing spheres.h5 --json nlgs.json --state nlgs.h5
  nscdd run cases/reduced/triaxial.toml --packing spheres.h5 --scheme dcs --subdomains 8 --json dcs.json --state dcs.h5
  mpirun -np 2 nscdd run cases/reduced/triaxial.toml --packing spheres.h5 --scheme ccs --json ccs.json --state ccs.h5
  nscdd compare nlgs.json dcs.json
  nscdd report results --out page
  nscdd export-fclib cases/reduced/triaxial.toml --packing spheres.h5 --step 10 -o step10.hdf5
  nscdd solve-fclib step10.hdf5 --tolerance 1e-6
  nscdd calibrate cases/reduced/triaxial.toml --packing spheres.h5 -o costs.json
  nscdd scale cases/reduced/triaxial.toml --packing spheres.h5 --ranks 1,2,4,8 --platform cases/platforms/node48.xml
      --costs costs.json --json scale.json

Files to write are checked before the first step: they are regular files or new ones, in folders that can be written, and
neither an input nor another output. All of a command's files are written before the first takes its place: the old ones
stay, whole, where one fails. A symbolic link stays and the file that it leads to is replaced. Grains, [[grain]]s and rows
of data sets are counted from 0 in messages.

Exit codes: 0 done; 1 bad input, a file that cannot be written, or a report on runs that disagree; 2 compare found a
disagreement; 3 the run is complete, but steps hit the cap of iterations, or a problem was not solved to tolerance;
4 the run was stopped by SIGUSR1 and goes on from its checkpoint.)");

    nscdd::PackArguments pack;
    auto* pack_command =
        app.add_subcommand("pack", "Generate a packing: thrown at random, pressed by frictionless walls");
    pack_command
        ->add_option("specification", pack.specification,
                     "TOML: dimension, grains, radius, spread, aspect, seed, solid_fraction")
        ->required();
    pack_command->add_option("-o,--output", pack.output, "HDF5 file to write (x, radius, box)")->required();
    pack_command->add_flag("--quiet", pack.quiet, "No progress");

    nscdd::RunArguments run;
    auto* run_command =
        app.add_subcommand("run", "Step a scene by sequential NLGS or Newton, or by NSCDD in-process or under mpirun");
    run_command->add_option("scene", run.scene, "Scene (TOML)")->required();
    run_command->add_option("--packing", run.packing, "HDF5 packing instead of the scene's own");
    run_command->add_option(
        "--from", run.from,
        "Go on from a state that --state or --checkpoint wrote: to the last bit on as many subdomains. From a "
        "checkpoint the run makes the steps that were left, unless --steps says otherwise. The state of "
        "another scene is refused: names of scene, materials and walls, densities, normals, and number, "
        "radii and materials of the grains must be the same. Forces and motions, friction, "
        "restitution, h and the solver may change");
    run_command->add_flag("--adopt", run.adopt, "Go on from the state of another scene with as many walls");
    run_command
        ->add_option("--scheme", run.scheme,
                     "nlgs: sequential reference; newton: the same to high accuracy; spg, apgd: projected gradients, "
                     "spectral and accelerated; ccs, dcs: NSCDD")
        ->check(CLI::IsMember({"nlgs", "newton", "spg", "apgd", "ccs", "dcs"}))
        ->capture_default_str();
    run_command
        ->add_option("--interface", run.interface,
                     "How the interface problem is solved (default: ccs factorised, dcs closed-form)")
        ->check(CLI::IsMember({"closed-form", "factorised"}));
    run_command
        ->add_option("-n,--subdomains", run.subdomains,
                     "Subdomains; under mpirun dealt to its processes, of which each needs one (default: 1 a process)")
        ->check(CLI::PositiveNumber);
    run_command->add_option("--threads", run.threads, "That share the in-process subdomains (default: 1); same results")
        ->check(CLI::PositiveNumber);
    run_command
        ->add_option(
            "--partition", run.partition,
            "How space is dealt to subdomains: grid: equal cells, as in the paper; bisection: cut by cut, equal "
            "numbers of contacts; metis: the same with few grains shared")
        ->check(CLI::IsMember({"grid", "bisection", "metis"}))
        ->capture_default_str();
    run_command->add_option("--grid", run.grid, "Cells per axis, e.g. 2x2x1 (default: nearest to cubes)");
    run_command
        ->add_option("--imbalance", run.imbalance,
                     "Contacts of the busiest subdomain over the mean, beyond which bisection and metis divide anew "
                     "(default: 1.1)")
        ->check(CLI::Range(1.0, 1e6));
    run_command->add_option("--transport", run.transport, "auto: mpi when started by mpirun")
        ->check(CLI::IsMember({"auto", "in-process", "mpi"}))
        ->capture_default_str();
    run_command->add_option("--steps", run.steps, "Instead of the scene's")->check(CLI::PositiveNumber);
    run_command->add_option("--tolerance", run.tolerance, "On eta, instead of the scene's")
        ->check(nscdd::positive_number());
    run_command
        ->add_option("--velocity-error", run.velocity_error,
                     "Largest velocity error of a step, instead of the scene's (default: 0.1)")
        ->check(nscdd::positive_number());
    run_command
        ->add_option("--energy-made", run.energy_made,
                     "Largest share of energy that contacts may make in a step, instead of the scene's (default: 1e-3)")
        ->check(nscdd::positive_number());
    run_command->add_option("--check-every", run.check_every, "Iterations between two tests; 1 for studies of counts")
        ->check(CLI::PositiveNumber);
    run_command
        ->add_option("--max-iterations", run.max_iterations,
                     "Cap per step, also where fewer than --check-every are left")
        ->check(CLI::PositiveNumber);
    run_command->add_option("--sweeps", run.sweeps, "Sweeps per iteration, n_GS")->check(CLI::PositiveNumber);
    run_command
        ->add_option("--method", run.method,
                     "auto: accelerated; paper: Alg. 1 of the paper as it is written (default: the scene's, or auto)")
        ->check(CLI::IsMember({"auto", "paper"}));
    run_command->add_option("--window", run.window, "Earlier iterates that Anderson acceleration combines")
        ->check(CLI::Range(0, nscdd::Anderson::largest_window));
    run_command->add_option("--relaxation", run.relaxation, "Of every contact's step, omega")
        ->check(nscdd::between(0, 2));
    run_command
        ->add_option("--repeat", run.repeat,
                     "Runs from the start, to keep the one with the median CPU time of the solver")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    run_command->add_option("--json", run.json, "Results to write, see reports/run.schema.json");
    run_command->add_option("--state", run.state, "Last state to write (HDF5), with an .xdmf beside it for ParaView");
    run_command->add_option(
        "--checkpoint", run.checkpoint,
        "State to write on the way, from which --from goes on to the end of this run, to the last bit "
        "on as many subdomains; it may be the file of --from. On SIGUSR1, to any rank, it is "
        "written and the run stops, exit code 4, without results");
    run_command->add_option(
        "--every", run.every,
        "Steps between checkpoints, such as 50, or seconds, such as 60s (default: on SIGUSR1 alone)");
    run_command->add_flag("--quiet", run.quiet, "No progress, no summary");

    std::string reference, candidate, compare_json;
    auto* compare_command = app.add_subcommand("compare", "Does a run agree with its reference?");
    compare_command->add_option("reference", reference, "JSON of the reference run")->required();
    compare_command->add_option("candidate", candidate, "JSON of the run to judge")->required();
    compare_command->add_option("--json", compare_json, "Table to write, see reports/compare.schema.json");

    std::string results, page = "report";
    auto* report_command =
        app.add_subcommand("report", "One HTML page with tables and figures from a folder of results");
    report_command->add_option("results", results, "Folder with JSON files of run and compare")->required();
    report_command->add_option("--out", page, "Folder of the page")->capture_default_str();

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

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 1;
    }
    try {
        const nscdd::Provenance provenance = nscdd::provenance(argc, argv);
        if (*pack_command) return nscdd::pack(pack, provenance);
        if (*run_command) return nscdd::run(run, provenance);
        if (*compare_command) return nscdd::compare(reference, candidate, compare_json, provenance);
        if (*export_fclib_command) return nscdd::export_fclib(export_fclib, provenance);
        if (*solve_fclib_command) return nscdd::solve_fclib(solve_fclib, provenance);
        if (*report_command) return report(results, page);
        if (*window_command) return nscdd::window(window, provenance);
        if (*calibrate_command) return nscdd::calibrate(calibrate, provenance);
        if (*scale_command) return nscdd::scale(scale, provenance);
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "nscdd: out of memory\n");
    } catch (const std::exception& error) {
        fmt::print(stderr, "nscdd: {}\n", nscdd::one_line(error.what()));
    }
    return 1;
}
