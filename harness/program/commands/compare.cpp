#include "commands/compare.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "commands/number_option.hpp"
#include "files/say.hpp"
#include "files/verdict.hpp"

namespace nscdd {

namespace {

// Path of a run's state file, which its JSON names relative to itself.
std::string state_file(const RunReport& run) {
    return (std::filesystem::path(run.file).parent_path() / run.state).string();
}

State state_of(const RunReport& run) {
    const std::string file = state_file(run);
    State state = read_state(file);
    require_state_of(run, state, file);
    if (checksum(read_file(file)) != run.state_checksum)
        throw InputError(fmt::format("{}: is not the state that {} was written with: another run, or a change since",
                                     file, run.file));
    return state;
}

}  // namespace

CLI::App* add_compare(CLI::App& app, CompareArguments& arguments) {
    CLI::App* command = app.add_subcommand("compare", "Does a run agree with its reference?");
    command->add_option("reference", arguments.reference, "JSON of the reference run")->required()->check(file_name());
    command->add_option("candidate", arguments.candidate, "JSON of the run to judge")->required()->check(file_name());
    command->add_option("--json", arguments.json, "Table to write, see reports/compare.schema.json")
        ->check(file_name());
    return command;
}

int compare(const CompareArguments& arguments, const Provenance& provenance) {
    const auto& [reference_file, candidate_file, json_file] = arguments;
    Run reference{read_run_report(reference_file, read_file(reference_file)), {}},
        candidate{read_run_report(candidate_file, read_file(candidate_file)), {}};
    const std::string theirs = state_file(reference.report), ours = state_file(candidate.report);
    check_outputs({{"--json", json_file}}, {{"the reference", reference_file},
                                            {"the candidate", candidate_file},
                                            {"the reference's state", theirs},
                                            {"the candidate's state", ours}});
    std::error_code none;
    if (std::filesystem::equivalent(theirs, ours, none))
        throw InputError(fmt::format("{}: is the state of both {} and {}", ours, reference_file, candidate_file));
    reference.state = state_of(reference.report);
    candidate.state = state_of(candidate.report);

    const std::vector<AgreementRow> found = agreement(reference, candidate);
    nlohmann::json rows = nlohmann::json::array();
    for (const AgreementRow& row : found) {
        rows.push_back({{"quantity", row.quantity}, {"value", row.value}, {"bound", row.bound}, {"ok", row.ok()}});
        say("{:<62} {:>10.3g}  <= {:<8g} {}\n", row.quantity, row.value, row.bound, row.ok() ? "ok" : "DISAGREES");
    }
    const Verdict judged = verdict(reference.report, candidate.report, found);
    if (!judged.why.empty()) fmt::print("{}: {}\n", judged.name, one_line(judged.why));
    const RunReport &a = reference.report, &b = candidate.report;
    nlohmann::json result = provenance;
    result.update({{"schema", "nscdd.compare/1"},
                   {"reference", reference_file},
                   {"candidate", candidate_file},
                   {"scene", a.scene},
                   {"scheme", b.scheme},
                   {"subdomains", b.subdomains},
                   {"transport", b.transport},
                   {"steps", std::min(a.steps, b.steps)},
                   {"last_step", a.last_step()},
                   {"rows", rows},
                   {"verdict", judged.name},
                   {"ok", judged.exit_code == 0}});
    if (json_file) write_json(*json_file, result);
    return judged.exit_code;
}

}  // namespace nscdd
