#include "commands/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "commands/number_option.hpp"
#include "commands/run_options.hpp"
#include "files/costs.hpp"
#include "files/replace_file.hpp"
#include "files/say.hpp"
#include "nscdd/comm/in_process.hpp"

namespace nscdd {

CLI::App* add_calibrate(CLI::App& app, CalibrateArguments& arguments) {
    CLI::App* command = app.add_subcommand(
        "calibrate", "Measure what work costs on this core, by kind and size, for simulated machines (nscdd scale)");
    RunArguments& run = arguments.run;
    add_source_options(*command, run, "Go on from a state that `nscdd run --state` wrote: of its next step");
    command
        ->add_option("--subdomains", arguments.subdomains,
                     "How many subdomains the scene is divided into, for the sizes that one rank would have; as many "
                     "cores are busy as this machine has and there are subdomains")
        ->delimiter(',')
        ->allow_extra_args(false)  // what follows is the scene
        ->check(whole_number())
        ->capture_default_str();
    command->add_option("--seconds", arguments.seconds, "Of a measurement, the median of five of which counts")
        ->check(positive_number())
        ->capture_default_str();
    command->add_option("-o,--output", arguments.output, "JSON file to write")->required()->check(file_name());
    command->add_flag("--quiet", run.quiet, "No progress, no summary");
    return command;
}

int calibrate(const CalibrateArguments& arguments, const Provenance& provenance) {
    Costs costs;
    nlohmann::json json = provenance;
    RunArguments run = arguments.run;
    run.scheme = "dcs";
    for (const int subdomains : arguments.subdomains) {
        run.subdomains = subdomains;
        RunRequest request = prepare_run(run, provenance, {}, false);
        check_outputs({{"--output", arguments.output}}, inputs_of(run, request.scene));
        request.calibration = CalibrationRequest{arguments.seconds, provenance.machine.cores};
        InProcess comm(subdomains);
        FileSet none;
        const RunResult result = choose_model(request.scene)(request, comm, none);
        const CalibrationResult& measured = result.calibration.value();
        if (measured.costs.empty()) {
            if (!run.quiet) say(stderr, "{} subdomains: left out, the one to measure has no contact\n", subdomains);
            continue;
        }
        costs.model = result.model;
        json["scene"] = request.scene.name;
        json["grains"] = result.grains;
        std::string told;
        for (const MeasuredCost& cost : measured.costs) {
            const auto kind = static_cast<std::size_t>(cost.kind);
            costs.units[kind].push_back({cost.bytes, cost.ns});
            told += fmt::format("  {} {:.2f}", detail::work_names[kind], cost.ns);
        }
        if (!run.quiet)
            say(stderr, "{} subdomains, {:.0f} contacts each, ns:{}\n", subdomains, measured.contacts, told);
    }
    for (std::size_t k = 0; k < detail::work_names.size(); ++k) {
        if (costs.units[k].empty() && !may_lack(k))
            throw InputError(
                fmt::format("--subdomains: no grain is shared by two, so that the cost of {} is not measured",
                            detail::work_names[k]));
        std::ranges::sort(costs.units[k], {}, &CostPoint::bytes);
        const auto same = std::ranges::unique(costs.units[k], {}, &CostPoint::bytes);
        costs.units[k].erase(same.begin(), same.end());
    }
    json["schema"] = "nscdd.costs/1";
    json["seconds"] = arguments.seconds;
    json.update(nlohmann::json(costs));
    write_json(arguments.output, json);
    if (!run.quiet) say("{}: costs of {}, {}\n", arguments.output, provenance.machine.cpu, costs.model);
    return 0;
}

}  // namespace nscdd
