#include "commands/window.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <vector>

#include "commands/number_option.hpp"
#include "commands/run_options.hpp"
#include "commands/same_files.hpp"
#include "commands/session.hpp"
#include "files/costs.hpp"
#include "files/replace_file.hpp"
#include "files/say.hpp"
#include "model/run_json.hpp"
#include "nscdd/comm/mpi.hpp"
#ifdef NSCDD_SIMULATED
#include <simgrid/host.h>
#endif

namespace nscdd {

namespace {

// Advances the clock of a simulated machine by this much; a real one needs no help.
void spend([[maybe_unused]] double seconds) {
#ifdef NSCDD_SIMULATED
    smpi_execute_flops(seconds * sg_host_get_speed(sg_host_self()));
#endif
}

// Cores of a simulated machine's node; 0: it is a real one.
int simulated_cores() {
#ifdef NSCDD_SIMULATED
    return sg_host_core_count(sg_host_self());
#else
    return 0;
#endif
}

// What sending or receiving takes for a message of at least so many bytes, and for each of them [s].
struct CallCost {
    double from, message, byte;
};

// What the platform's file says of this host in a property: FROM:SECONDS:SECONDS A BYTE;... as SimGrid's own smpi/os,
// FROM ascending. Nothing where it says nothing. Throws InputError.
std::vector<CallCost> calls_of_host([[maybe_unused]] const char* property, [[maybe_unused]] double latency,
                                    [[maybe_unused]] double bandwidth) {
    std::vector<CallCost> costs;
#ifdef NSCDD_SIMULATED
    const char* text = sg_host_get_property_value(sg_host_self(), property);
    std::istringstream in(text ? text : "");
    char after = ';', first = 0, second = 0;
    for (CallCost cost{}; after == ';' && in >> cost.from >> first >> cost.message >> second >> cost.byte;) {
        if (first != ':' || second != ':' || !(cost.message >= 0 && cost.byte >= 0)) break;
        costs.push_back({cost.from, latency * cost.message, cost.byte / bandwidth});
        if (!(in >> after)) after = 0;
    }
    if (text &&
        (costs.empty() || after != 0 || costs[0].from != 0 || !std::ranges::is_sorted(costs, {}, &CallCost::from)))
        throw InputError(fmt::format("{}: {} is '{}', not 0:SECONDS:SECONDS;FROM:SECONDS:SECONDS;...",
                                     sg_host_get_name(sg_host_self()), property, text));
#endif
    return costs;
}

// Counts the work of this process, and on a simulated machine takes the time that it costs.
class WorkClock {
  public:
    WorkClock(const WindowArguments& arguments, int rank) : slower_(arguments.slower), noise_(arguments.noise) {
        if (simulated) costs_ = read_costs(arguments.costs);
        calls_ = calls_of_host("call", arguments.latency, arguments.bandwidth);
        shared_ = calls_of_host("shared", arguments.latency, arguments.bandwidth);
        std::seed_seq seed{arguments.seed, static_cast<unsigned>(rank)};
        random_.seed(seed);
    }
    void operator()(Work kind, double count, double bytes) {
        done_[static_cast<std::size_t>(kind)] += count;
        if (!simulated || count == 0) return;
        // lognormal, of mean 1: work never takes less than no time
        const double factor = noise_ > 0 ? std::exp(noise_ * normal_(random_) - noise_ * noise_ / 2) : 1;
        const double time = slower_ * factor * seconds(kind, count, bytes);
        if (thread_)
            *thread_ += time;
        else
            spend(time);
    }
    // Work costs time of this thread alone, until the next call; null: of the process. It must live as long.
    void of_thread(double* seconds) { thread_ = seconds; }
    const WorkDone& done() const { return done_; }
    const Costs& costs() const { return costs_; }

  private:
    double seconds(Work kind, double count, double bytes) const {
        if (kind != Work::message && kind != Work::shared_message) return costs_.seconds(kind, count, bytes);
        double seconds = 0;
        for (const CallCost& cost : kind == Work::message ? calls_ : shared_)
            if (bytes >= cost.from) seconds = count * (cost.message + bytes * cost.byte);
        return seconds;
    }

    double slower_, noise_;
    std::vector<CallCost> calls_, shared_;  // of messages of MPI, and of those through memory
    Costs costs_;
    std::mt19937_64 random_;
    std::normal_distribution<double> normal_;
    WorkDone done_{};
    double* thread_ = nullptr;
};

// Ranks of a process on a thread each, on a simulated machine: the slowest ends a loop, which costs no more than that.
class SimulatedThreads final : public Mpi {
  public:
    SimulatedThreads(WorkClock& clock, int ranks, WithinNode within)
        : Mpi(MPI_COMM_WORLD, std::ref(clock), ranks, within), clock_(clock), seconds_(this->ranks().size()) {}
    void each_rank(const std::function<void(std::size_t)>& task) override {
        if (seconds_.size() == 1) return Mpi::each_rank(task);
        std::ranges::fill(seconds_, 0);
        Mpi::each_rank([&](std::size_t k) {
            clock_.of_thread(&seconds_[k]);
            task(k);
        });
        clock_.of_thread(nullptr);
        spend(std::ranges::max(seconds_));
    }

  private:
    WorkClock& clock_;
    std::vector<double> seconds_;
};

}  // namespace

CLI::App* add_window(CLI::App& app, WindowArguments& arguments) {
    CLI::App* command =
        app.add_subcommand("window", "Time of an iteration: a window of one step's iterations, without set-up");
    RunArguments& run = arguments.run;
    run.scheme = "dcs";
    add_source_options(*command, run, "Go on from a state that `nscdd run --state` wrote: its next step is timed");
    add_scheme_options(*command, run, [](const SchemeInfo& s) { return s.sweeps; });
    add_grid_option(*command, run);
    command->add_option("--skip", arguments.skip, "Iterations before the window")
        ->check(whole_number())
        ->capture_default_str();
    command->add_option("--iterations", arguments.iterations, "Iterations of the window")
        ->check(whole_number())
        ->capture_default_str();
    add_within_node_option(*command, run);
    command->add_option("--repeat", run.repeat, "Times that the window is measured; the median is told")
        ->check(whole_number())
        ->capture_default_str();
    command->add_option("--json", run.outputs.json, "Result to write")->check(file_name());
    command->add_flag("--quiet", run.quiet, "No summary");
    if (simulated) {
        command->add_option("--threads", run.threads, "Subdomains of a process, each on a thread (default: 1)")
            ->check(whole_number(1, largest_subdomains));
        command->add_option("--costs", arguments.costs, "What work costs: a file that `nscdd calibrate` wrote")
            ->required();
        command->add_option("--slower", arguments.slower, "Times as slow as the core that was calibrated")
            ->check(positive_number())
            ->capture_default_str();
        command
            ->add_option("--noise", arguments.noise,
                         "Standard deviation of the time of every piece of work over its mean, lognormal")
            ->check(number_in({0, 10}))
            ->capture_default_str();
        command->add_option("--latency", arguments.latency, "Factor on what sending or receiving takes for a message")
            ->check(positive_number())
            ->capture_default_str();
        command->add_option("--bandwidth", arguments.bandwidth, "Divisor of what sending or receiving takes for a byte")
            ->check(positive_number())
            ->capture_default_str();
        command->add_option("--seed", arguments.seed, "Of the noise")->check(whole_number(0))->capture_default_str();
    }
    return command;
}

int window(const WindowArguments& arguments, const Provenance& provenance, const Session& session) {
    std::optional<WorkClock> meter;
    RunRequest request;
    std::vector<NamedFile> inputs;
    std::vector<std::string> sums;
    RunResult result;
    if (!session.together([&] {
            request = prepare_run(arguments.run, provenance, {session.rank(), session.size()}, true);
            request.window = WindowRequest{arguments.skip, arguments.iterations, arguments.run.repeat, {}};
            if (simulated && *request.threads > simulated_cores())
                throw InputError(fmt::format("--threads {}: a node of the platform has {} cores", *request.threads,
                                             simulated_cores()));
            meter.emplace(arguments, session.rank());
            const auto& driven = meter->costs().units[static_cast<std::size_t>(Work::driven)];
            if (simulated && driven.empty() && std::ranges::any_of(request.scene.walls, &SceneWall::driven))
                throw InputError(
                    fmt::format("{}: has no cost of driven walls, which {} has", arguments.costs, request.scene.file));
            inputs = inputs_of(arguments.run, request.scene);
            sums = sums_of_files(session, inputs);
            if (session.rank() == 0) check_outputs({{"--json", request.outputs.json}}, inputs);
        }) ||
        !session.together([&] { require_same_files(session, inputs, sums); }))
        return 1;
    request.window->done = [&meter] { return meter->done(); };
    if (!session.together([&] {
            SimulatedThreads comm(*meter, *request.subdomains, within_node(arguments.run.within_node));
            FileSet none;
            result = choose_model(request.scene)(request, comm, none);
            if (simulated && meter->costs().model != result.model)
                throw InputError(fmt::format("{}: costs of a {} scene, {} is {}", arguments.costs, meter->costs().model,
                                             request.scene.file, result.model));
        }))
        return 1;
    return session.together([&] {
        if (session.rank() != 0) return;
        nlohmann::json json = window_json(request, result);
        json["simulated"] = simulated;
        if (simulated) json.erase("load");  // of this machine, not of the simulated one
        if (simulated)
            json["injected"] = {{"costs", arguments.costs},         {"slower", arguments.slower},
                                {"noise", arguments.noise},         {"latency", arguments.latency},
                                {"bandwidth", arguments.bandwidth}, {"seed", arguments.seed}};
        if (request.outputs.json) write_json(*request.outputs.json, json);
        if (!arguments.run.quiet)
            say("{}: {} on {} rank{}{}{}: {:.4g} us an iteration\n", request.scene.name, *request.scheme, result.ranks,
                result.ranks == 1 ? "" : "s",
                *request.threads > 1 ? fmt::format(", {} threads a process", *request.threads) : "",
                simulated ? ", simulated" : "", 1e6 * result.window->median());
    })
               ? 0
               : 1;
}

}  // namespace nscdd
