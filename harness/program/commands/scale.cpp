#include "commands/scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <sstream>

#include "commands/child_process.hpp"
#include "commands/number_option.hpp"
#include "commands/run_options.hpp"
#include "files/costs.hpp"
#include "files/load.hpp"
#include "files/replace_file.hpp"
#include "files/say.hpp"
#include "model/run_json.hpp"
#include "nscdd/comm/in_process.hpp"

namespace nscdd {

namespace {

using Json = nlohmann::json;

// Factors on the simulated machine's latency and bandwidth, of links and of MPI's calls, and its noise.
struct Band {
    double latency = 1, bandwidth = 1, noise = 0;
};

class Job {
  public:
    Job(const ScaleArguments& arguments, const Provenance& provenance)
        : arguments_(arguments), provenance_(provenance), hosts_(beside(arguments.platform)) {
        const RunArguments::Start& start = arguments.run.start;
        for (const std::optional<std::string>& path :
             {std::optional(start.scene), start.packing, start.from, std::optional(arguments.costs),
              std::optional(arguments.platform), std::optional(arguments.output)})
            if (path && path->find_first_of(" \t\n*?[]'\"\\") !=
                            std::string::npos)  // smpirun lets a shell split and expand them
                throw InputError(fmt::format("{}: smpirun takes no paths with blanks, quotes or wildcards", *path));
        for (const std::string& path : {arguments.platform, hosts_, arguments.costs}) require_regular_file(path);
        if (!std::filesystem::exists(arguments.simulator))
            throw InputError(fmt::format(
                "{}: is not there: build the target nscdd_simulated, or name it by --simulator", arguments.simulator));
        read_costs(arguments.costs);
        prepare(1);
        json_ = provenance;
        json_.update({{"schema", "nscdd.scale/1"}, {"settings", settings()}, {"points", Json::array()}});
        if (std::filesystem::exists(arguments.output)) go_on();
        for (const int ranks : arguments.ranks) point(ranks);
        std::sort(json_["points"].begin(), json_["points"].end(),
                  [](const Json& a, const Json& b) { return a["ranks"] < b["ranks"]; });
    }

    void run() {
        for (Json& p : json_["points"]) count(p);
        for (Json& p : json_["points"]) simulate(p, {});
        if (arguments_.bands)
            for (Json& p : json_["points"])
                for (const Band& band :
                     {Band{0.5, 1, 0}, Band{2, 1, 0}, Band{1, 0.5, 0}, Band{1, 2, 0}, Band{1, 1, 0.05}})
                    simulate(p, band);
        // measure only after all predictions
        if (arguments_.measure)
            for (Json& p : json_["points"]) measure(p);
        std::filesystem::remove(log());
        if (!arguments_.run.quiet) print();
    }

  private:
    static std::string beside(const std::string& platform) {
        return std::filesystem::path(platform).replace_extension(".hosts").string();
    }
    // Files beside the result while it is made, named as all that nobody needs afterwards.
    std::string aside(const char* what) const { return fmt::format("{}.{}.part", arguments_.output, what); }
    std::string log() const { return aside("log"); }

    // Settings that all results of one file have in common.
    Json settings() const {
        const auto content = [](const std::optional<std::string>& path) {
            return path ? checksum(read_file(*path)) : "";
        };
        const RunArguments& run = arguments_.run;
        return {{"scene", run.start.scene},
                {"packing", run.start.packing.value_or("")},
                {"from", run.start.from.value_or("")},
                {"scheme", *run.scheme},
                {"interface", name_of(interface_names, run.interface)},
                {"multiplicity", name_of(multiplicity_names, run.multiplicity)},
                {"partition", run.partition.chosen()},
                {"method", name_of(method_names, run.solver.method)},
                {"steps", run.steps.value()},
                {"skip", arguments_.skip},
                {"iterations", arguments_.iterations},
                {"platform", arguments_.platform},
                {"costs", arguments_.costs},
                {"slower", arguments_.slower},
                {"checksums",
                 {{"scene", content(run.start.scene)},
                  {"packing", content(run.start.packing)},
                  {"from", content(run.start.from)},
                  {"platform", content(arguments_.platform)},
                  {"hosts", content(hosts_)},
                  {"costs", content(arguments_.costs)}}},
                {"commit", provenance_.commit}};
    }

    void go_on() {
        const Json old = Json::parse(read_file(arguments_.output), nullptr, false);
        if (old.is_discarded() || !old.is_object() || old.value("schema", "") != "nscdd.scale/1" ||
            !old.contains("points") || !old.contains("settings"))
            throw InputError(fmt::format("{}: is no result of nscdd scale, it is not replaced", arguments_.output));
        for (const auto& [key, value] : json_["settings"].items())
            if (!old["settings"].contains(key) || old["settings"][key] != value)
                throw InputError(fmt::format("{}: was begun with another {}, give another file to begin anew",
                                             arguments_.output, key));
        json_["points"] = old["points"];
    }

    Json& point(int ranks) {
        for (Json& p : json_["points"])
            if (p["ranks"] == ranks) return p;
        json_["points"].push_back(
            {{"ranks", ranks}, {"scheme", ranks == 1 ? "nlgs" : *arguments_.run.scheme}, {"windows", Json::array()}});
        return json_["points"].back();
    }

    void tell(const std::string& what) const {
        if (!arguments_.run.quiet) say(stderr, "scale: {}\n", what);
    }
    void save() const { write_json(arguments_.output, json_); }

    RunRequest prepare(int ranks) const {
        RunArguments run = arguments_.run;
        run.quiet = true;
        run.subdomains = ranks;
        if (ranks == 1) run.scheme = "nlgs";
        if (ranks == 1) run.interface.reset();
        RunRequest request = prepare_run(run, provenance_, {}, false);
        check_outputs({{"--json", arguments_.output}}, inputs_of(run, request.scene));
        return request;
    }

    // Counts iterations of whole steps to tolerance, in process: exact for any number of ranks.
    void count(Json& p) {
        if (p.contains("iterations")) return;
        const int ranks = p["ranks"];
        tell(fmt::format("{} rank{}: counting iterations", ranks, ranks == 1 ? "" : "s"));
        RunRequest request = prepare(ranks);
        InProcess comm(ranks, std::min(ranks, provenance_.machine.cores));
        FileSet none;
        const Json result = run_json(request, choose_model(request.scene)(request, comm, none));
        for (const char* key : {"iterations", "contacts", "converged", "interface_share"}) p[key] = result[key];
        save();
    }

    std::vector<std::string> window_words(const Json& p, const std::string& result) const {
        const RunArguments& run = arguments_.run;
        const std::string scheme = p["scheme"];
        std::vector<std::string> words{"window", run.start.scene, "--scheme", scheme, "--json", result, "--quiet"};
        const auto add = [&words](const char* option, const std::string& value) {
            if (!value.empty()) words.insert(words.end(), {option, value});
        };
        add("--packing", run.start.packing.value_or(""));
        add("--from", run.start.from.value_or(""));
        if (scheme != "nlgs") add("--interface", name_of(interface_names, run.interface));
        add("--multiplicity", name_of(multiplicity_names, run.multiplicity));
        add("--partition", scheme == "nlgs" ? "" : run.partition.chosen());
        add("--method", name_of(method_names, run.solver.method));
        add("--skip", std::to_string(arguments_.skip));
        add("--iterations", std::to_string(arguments_.iterations));
        if (run.start.adopt) words.push_back("--adopt");
        return words;
    }

    Json run_window(std::vector<std::string> words, const Json& p, const std::vector<std::string>& more) const {
        const std::string result = aside("window");
        for (const std::vector<std::string>& list : {window_words(p, result), more})
            words.insert(words.end(), list.begin(), list.end());
        run_program(words, log());
        Json window = Json::parse(read_file(result));
        std::filesystem::remove(result);
        Json kept;
        for (const char* key :
             {"command", "contacts", "seconds_per_iteration", "all_repeats", "per_iteration", "work_per_iteration"})
            kept[key] = window.at(key);
        if (window.contains("load")) kept["load"] = window["load"];  // of a measured one
        return kept;
    }

    // SMPI's option for the platform's own factors by size of message, such as 0:1;4096:20, times `more`.
    std::string factors(const std::string& name, double more) const {
        const std::string text = read_file(arguments_.platform), before = fmt::format("<prop id=\"{}\" value=\"", name);
        const std::size_t at = text.find(before);
        if (at == std::string::npos) throw InputError(fmt::format("{}: has no {}...\"/>", arguments_.platform, before));
        std::istringstream in(text.substr(at + before.size(), text.find('"', at + before.size()) - at - before.size()));
        std::string option;
        for (std::string entry; std::getline(in, entry, ';');) {
            const std::size_t colon = entry.find(':');
            double factor = 0;
            if (colon != std::string::npos)
                std::from_chars(entry.data() + colon + 1, entry.data() + entry.size(), factor);
            if (!(factor > 0))
                throw InputError(fmt::format("{}: {}: not BYTES:FACTOR: {}", arguments_.platform, name, entry));
            option += fmt::format("{}{}:{}", option.empty() ? "" : ";", entry.substr(0, colon), more * factor);
        }
        return fmt::format("--cfg={}:{}", name, option);
    }

    void simulate(Json& p, const Band& band) {
        for (const Json& window : p["windows"])
            if (window["latency"] == band.latency && window["bandwidth"] == band.bandwidth &&
                window["noise"] == band.noise)
                return;
        const int ranks = p["ranks"];
        tell(fmt::format("{} rank{}: simulating {} iterations, latency x {:g}, bandwidth x {:g}, noise {:g} %", ranks,
                         ranks == 1 ? "" : "s", arguments_.iterations, band.latency, band.bandwidth, 100 * band.noise));
        Json window =
            run_window({"smpirun", "-quiet", "-np", std::to_string(ranks), "-platform", arguments_.platform,
                        "-hostfile", hosts_, "--log=root.thres:error", factors("smpi/lat-factor", band.latency),
                        factors("smpi/bw-factor", band.bandwidth), arguments_.simulator},
                       p,
                       {"--costs", arguments_.costs, "--slower", fmt::format("{}", arguments_.slower), "--noise",
                        fmt::format("{}", band.noise), "--latency", fmt::format("{}", band.latency), "--bandwidth",
                        fmt::format("{}", band.bandwidth)});
        window.update({{"latency", band.latency}, {"bandwidth", band.bandwidth}, {"noise", band.noise}});
        p["windows"].push_back(window);
        judge();
        save();
    }

    // Measures on this machine, where it has a core for every rank: each rank keeps its core, and need not yield it
    // while it waits. Another try is made where something else took their cores.
    void measure(Json& p) {
        const int ranks = p["ranks"];
        if (ranks > provenance_.machine.cores) return;
        const auto busy = [&p] { return !p.contains("measured") || !believed(p["measured"]); };
        for (int tries = 0; busy() && tries < most_tries; ++tries) {
            tell(fmt::format("{} rank{}: measuring{}", ranks, ranks == 1 ? "" : "s",
                             tries > 0 ? " again, the machine was busy" : ""));
            p["measured"] =
                run_window({"mpirun", "-np", std::to_string(ranks), "--bind-to", "core:overload-allowed", "--mca",
                            "mpi_yield_when_idle", "0", std::filesystem::read_symlink("/proc/self/exe").string()},
                           p, {"--repeat", "5"});
            save();
        }
    }

    static bool believed(const Json& measured) {
        return !measured.contains("load") || measured["load"]["believed"] == true;  // as the page takes older records
    }

    static double iterations(const Json& p) {
        double sum = 0;
        for (const double n : p["iterations"]) sum += n;
        return sum;
    }

    // Sets the efficiencies T(NLGS) / (N T_N): of an iteration, and at equal error, with the iterations that each
    // needs.
    void judge() {
        const Json& points = json_["points"];
        if (points[0]["ranks"] != 1 || points[0]["windows"].empty()) return;
        const double alone = points[0]["windows"][0]["seconds_per_iteration"], needed = iterations(points[0]);
        for (Json& p : json_["points"])
            for (Json& window : p["windows"]) {
                const double seconds = window["seconds_per_iteration"],
                             per = alone / (seconds * p["ranks"].get<double>());
                window["efficiency_of_iteration"] = per;
                window["efficiency"] = per * needed / iterations(p);
                window["seconds"] = seconds * iterations(p);
            }
    }

    void print() const {
        say("SIMULATED {}, costs {}{}; us an iteration, counts of {} steps in process\n", arguments_.platform,
            arguments_.costs, arguments_.slower == 1 ? "" : fmt::format(" x {:g}", arguments_.slower),
            json_["points"][0]["iterations"].size());
        say("{:>6} {:>11} {:>9} {:>8} {:>8} {:>9} {:>8} {:>9} {:>10} {:>10}  {}\n", "ranks", "iterations", "simulated",
            "sweep", "largest", "interface", "wait", "transfer", "efficiency", "equal err.",
            "measured, simulated / measured");
        for (const Json& p : json_["points"])
            for (const Json& window : p["windows"]) {
                const auto us = [&window](const char* phase, const char* which) {
                    return 1e6 * window["per_iteration"][phase][which].get<double>();
                };
                const double seconds = window["seconds_per_iteration"];
                const bool given = &window == &p["windows"][0];
                std::string end;
                if (!given)
                    end = fmt::format("latency x {:g}, bandwidth x {:g}, noise {:g} %", window["latency"].get<double>(),
                                      window["bandwidth"].get<double>(), 100 * window["noise"].get<double>());
                else if (p.contains("measured"))
                    end = fmt::format("{:.4g}, {:.3f}{}", 1e6 * p["measured"]["seconds_per_iteration"].get<double>(),
                                      seconds / p["measured"]["seconds_per_iteration"].get<double>(),
                                      believed(p["measured"]) ? "" : ", THE MACHINE WAS BUSY");
                say("{:6} {:11.0f} {:9.4g} {:8.4g} {:8.4g} {:9.4g} {:8.4g} {:9.4g} {:10.3f} {:10.3f}  {}\n",
                    p["ranks"].get<int>(), iterations(p), 1e6 * seconds, us("sweep", "mean"), us("sweep", "largest"),
                    us("interface", "mean"), us("wait", "mean"), us("transfer", "mean"),
                    window["efficiency_of_iteration"].get<double>(), window["efficiency"].get<double>(), end);
            }
    }

    const ScaleArguments& arguments_;
    const Provenance& provenance_;
    std::string hosts_;
    Json json_;
};

// Beside this program where it is built, in its folder of programs for programs where it is installed.
std::string simulator() {
    const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    const std::filesystem::path installed = here / ".." / NSCDD_SIMULATOR_DIR / "nscdd_simulated";
    return std::filesystem::exists(installed) ? installed.lexically_normal() : here / "nscdd_simulated";
}

}  // namespace

CLI::App* add_scale(CLI::App& app, ScaleArguments& arguments) {
    CLI::App* command = app.add_subcommand(
        "scale", "How a scene would scale on a machine that is simulated: iterations counted, their time by SMPI");
    RunArguments& run = arguments.run;
    run.scheme = "dcs";
    run.steps = 1;
    arguments.simulator = simulator();
    add_source_options(
        *command, run,
        "Go on from a state that `nscdd run --state` wrote: steps are counted, and one timed, from there");
    add_scheme_options(*command, run, [](const SchemeInfo& s) { return s.decomposed; });
    command->add_option("--ranks", arguments.ranks, "Numbers of ranks, such as 1,2,4,8; 1 is sequential NLGS")
        ->required()
        ->delimiter(',')
        ->allow_extra_args(false)  // what follows is the scene
        ->check(whole_number());
    command->add_option("--platform", arguments.platform, "Machine: XML of SimGrid, with a .hosts beside it")
        ->required();
    command->add_option("--costs", arguments.costs, "What work costs there: a file that `nscdd calibrate` wrote")
        ->required();
    command->add_option("--slower", arguments.slower, "Times as slow as the core that was calibrated")
        ->check(positive_number())
        ->capture_default_str();
    command->add_option("--steps", run.steps, "Steps whose iterations are counted (default: 1)")->check(whole_number());
    command->add_option("--skip", arguments.skip, "Iterations of the step before those that are timed")
        ->check(whole_number())
        ->capture_default_str();
    command->add_option("--iterations", arguments.iterations, "Iterations that are timed")
        ->check(whole_number())
        ->capture_default_str();
    command->add_flag("--bands", arguments.bands,
                      "Also with half and twice the latency and the bandwidth, and with 5 % of noise on all work");
    command->add_flag("--measure", arguments.measure,
                      "Then measure on this machine, with mpirun, what has a core for every rank");
    command->add_option("--simulator", arguments.simulator, "The program nscdd_simulated")->capture_default_str();
    command->add_option("--json", arguments.output, "Result to write, or to go on with after an interruption")
        ->required();
    command->add_flag("--quiet", run.quiet, "No progress, no table");
    return command;
}

int scale(const ScaleArguments& arguments, const Provenance& provenance) {
    ScaleArguments all = arguments;
    all.ranks.push_back(1);  // what the others are compared with
    Job(all, provenance).run();
    return 0;
}

}  // namespace nscdd
