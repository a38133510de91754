// The program `nscdd`: pack, run, compare, exchange of contact problems as FCLIB, and simulated machines.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <memory>
#include <span>

#include "commands/calibrate.hpp"
#include "commands/compare.hpp"
#include "commands/export_fclib.hpp"
#include "commands/launch.hpp"
#include "commands/libraries.hpp"
#include "commands/pack.hpp"
#include "commands/run_options.hpp"
#include "commands/scale.hpp"
#include "commands/solve_fclib.hpp"
#include "commands/window.hpp"
#include "files/closest.hpp"
#include "files/say.hpp"

namespace {

using namespace nscdd;

constexpr const char* footer = R"(Examples:
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
on from its checkpoint; 5 compare found another answer: the runs differ, and each is exact to 1e-8.)";

// A subcommand, and what it does. Arguments live as long as it.
struct Command {
    CLI::App* app;
    std::function<int(const Provenance&, const Session*)> act;
    std::function<bool()> starts_mpi;  // also where the process was started alone; none: the command is of one process
};

template <class Arguments>
Command of_one_process(CLI::App& app, CLI::App* (*add)(CLI::App&, Arguments&),
                       int (*act)(const Arguments&, const Provenance&)) {
    const auto arguments = std::make_shared<Arguments>();
    return {add(app, *arguments), [=](const Provenance& me, const Session*) { return act(*arguments, me); }, {}};
}

template <class Arguments>
Command of_all_ranks(CLI::App& app, CLI::App* (*add)(CLI::App&, Arguments&),
                     int (*act)(const Arguments&, const Provenance&, const Session&),
                     bool (*starts_mpi)(const Arguments&)) {
    const auto arguments = std::make_shared<Arguments>();
    return {add(app, *arguments), [=](const Provenance& me, const Session* all) { return act(*arguments, me, *all); },
            [=] { return starts_mpi(*arguments); }};
}

std::vector<Command> add_commands(CLI::App& app) {
    return {of_one_process(app, add_pack, pack),
            of_all_ranks<RunArguments>(app, add_run, run,
                                       [](const RunArguments& run) { return run.transport == Transport::mpi; }),
            of_one_process(app, add_compare, compare),
            of_one_process(app, add_export_fclib, export_fclib),
            of_one_process(app, add_solve_fclib, solve_fclib),
            of_all_ranks<WindowArguments>(app, add_window, window, [](const WindowArguments&) { return true; }),
            of_one_process(app, add_calibrate, calibrate),
            of_one_process(app, add_scale, scale)};
}

std::string version() {
    const Provenance me = provenance(0, nullptr);
    return fmt::format("nscdd, commit {}, {}, {} doubles a vector{}", me.commit, me.machine.compiler, me.machine.lanes,
                       me.machine.fused ? "" : ", no fused products: its counts are not those of other machines");
}

// What is wrong with the command line, in a line that helps.
std::string mistake(const CLI::App& app, const CLI::ParseError& error, std::span<char*> words) {
    std::vector<std::string> commands, options;
    std::string command;  // that was asked for
    for (const CLI::App* one : app.get_subcommands([](const CLI::App*) { return true; })) {
        commands.push_back(one->get_name());
        if (!one->parsed()) continue;
        command = one->get_name() + " ";
        for (const CLI::Option* option : one->get_options())
            for (const std::string& name : option->get_lnames()) options.push_back(name);
    }
    if (dynamic_cast<const CLI::RequiredError*>(&error) && command.empty() && words.size() > 1 && *words[1] != '-')
        return fmt::format("unknown command '{}'{}; see --help", words[1], did_you_mean(words[1], commands));
    if (dynamic_cast<const CLI::ExtrasError*>(&error)) {
        const std::string first = app.remaining(true).front(), name = first.substr(0, first.find('='));
        const std::string bare = name.substr(std::min(name.find_first_not_of('-'), name.size()));
        return fmt::format("{} was not expected{}; see {}--help", name, did_you_mean(bare, options, "--"), command);
    }
    return fmt::format("{}; see --help", error.what());
}

// Prints the help or the version, or says on all ranks together what is wrong with the command line.
int end_of_parsing(const CLI::App& app, const CLI::ParseError& error, std::span<char*> words) {
    const auto check = [&](int) {
        if (error.get_exit_code() != 0) throw InputError(mistake(app, error, words));
    };
    return begin_together(words, false, check,
                          [&](const Session&, int rank) { return rank == 0 ? app.exit(error) : 0; });
}

int act(const Command& command, const Provenance& me, std::span<char*> words) {
    if (command.starts_mpi)
        return begin_together(
            words, command.starts_mpi(), [](int) {},
            [&](const Session& session, int) { return command.act(me, &session); });
    const auto alone = [&](int ranks) {
        if (ranks > 1)
            throw InputError(fmt::format("{} is of one process, and {} were started: start it without mpirun",
                                         command.app->get_name(), ranks));
    };
    if (begin_together(words, false, alone, [](const Session&, int) { return 0; }) != 0) return 1;
    return command.act(me, nullptr);
}

}  // namespace

int main(int argc, char** argv) {
    survive_streams_and_limits();
    CLI::App app{"nscdd: Nonsmooth Contact Domain Decomposition for disks and spheres"};
    app.require_subcommand(1);
    app.set_version_flag("--version", version);
    app.footer(footer);
    const std::vector<Command> commands = add_commands(app);
    const std::span<char*> words(argv, static_cast<std::size_t>(argc));
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return end_of_parsing(app, error, words);
    }
    try {
        Provenance me = provenance(argc, argv);
        me.machine.libraries = libraries();
        for (const Command& command : commands)
            if (*command.app) return act(command, me, words);
    } catch (const std::bad_alloc&) {
        say(stderr, "nscdd: out of memory\n");
    } catch (const std::exception& error) {
        say(stderr, "nscdd: {}\n", one_line(error.what()));
    }
    return 1;
}
