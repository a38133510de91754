#include "model/run_json.hpp"

#include <algorithm>

#include "files/load.hpp"
#include "files/over_ranks.hpp"
#include "registry/registry.hpp"

namespace nscdd {

namespace {

using Json = nlohmann::json;

// By operation what messages(n) and seconds(n) make of the n-th column of what was communicated.
Json by_operation(auto&& messages, auto&& seconds) {
    constexpr std::size_t operations = detail::operation_names.size();
    Json json;
    for (std::size_t o = 0; o < operations; ++o)
        json[detail::operation_names[o]] = {{"messages", messages(2 + o)},
                                            {"wait", seconds(2 + operations + o)},
                                            {"transfer", seconds(2 + 2 * operations + o)}};
    return json;
}

// What figure(step) is of every step.
Json list(const RunResult& result, auto&& figure) {
    Json values = Json::array();
    for (const StepReport& step : result.steps) values.push_back(figure(step));
    return values;
}

Json costs_json(const RunResult& result) {
    const Rows &ranks = result.costs, processes = result.costs_of_processes();
    const auto spread = [&](std::size_t column) { return over_ranks(processes.values, processes.columns, column); };
    const auto sum = [&](std::size_t column) { return processes.sum(column); };
    const double count = double(processes.count()), per = result.iterations() > 0 ? 1 / result.iterations() : 0;
    using namespace cost_column;
    Json json = {{"neighbours", over_ranks(ranks.values, ranks.columns, neighbours)},
                 {"messages", sum(messages)},
                 {"bytes", sum(bytes)},
                 {"messages_per_iteration", sum(messages) * per},
                 {"bytes_per_iteration", sum(bytes) * per},
                 {"operations", by_operation([&](std::size_t c) { return sum(messages + c); },
                                             [&](std::size_t c) { return spread(messages + c); })}};
    for (std::size_t at = work; at < ranks.values.size(); at += ranks.columns)
        json["work_per_rank"].push_back(ranks.values[at]);
    double wait = 0, transfer = 0;
    for (std::size_t p = 0; p < phase_names.size(); ++p) {
        const char* name = phase_names[p];
        const std::size_t at = first_phase_column + 3 * p;
        json["seconds"][name] = sum(at) / count;
        json["mpi_seconds"][name] = {{"wait", spread(at + 1)}, {"transfer", spread(at + 2)}};
        wait += sum(at + 1) / count;
        transfer += sum(at + 2) / count;
    }
    json["seconds"]["total"] = spread(total)["largest"];
    json["seconds"]["solver_cpu"] = sum(solver_cpu) / count;
    json["seconds"]["mpi_wait"] = wait;
    json["seconds"]["mpi_transfer"] = transfer;
    json["mpi_fraction"] = sum(total) > 0 ? count * (wait + transfer) / sum(total) : 0;
    return json;
}

// What every step has come to, a list for each figure.
Json steps_json(const RunResult& result) {
    Json json;
    json["iterations"] = list(result, [](const StepReport& s) { return s.solve.iterations; });
    json["solves"] = list(result, [](const StepReport& s) { return s.attempts; });
    json["residual"] = list(result, [](const StepReport& s) { return s.solve.residual; });
    for (const detail::BoundOption& bound : detail::bound_options)
        json[bound.figure_name] = list(result, [&](const StepReport& s) { return result.figure(bound, s.solve); });
    json["scene_distance"] = list(result, [](const StepReport& s) { return s.solve.scene_distance; });
    json["newton_contacts"] = list(result, [](const StepReport& s) { return s.solve.newton_contacts; });
    json["rebounds_given_up"] = list(result, [](const StepReport& s) { return s.solve.rebounds_given_up; });
    json["contacts"] = list(result, [](const StepReport& s) { return s.contacts; });
    return json;
}

Json energy_json(const RunResult& result) {
    const auto of = [&result](auto&& part) {
        return list(result, [&part](const StepReport& step) { return part(step.energy); });
    };
    return {{"before", of([](const StepReport::Energy& e) { return e.before; })},
            {"kinetic", of([](const StepReport::Energy& e) { return e.kinetic; })},
            {"external", of([](const StepReport::Energy& e) { return e.external; })},
            {"walls", of([](const StepReport::Energy& e) { return e.walls; })},
            {"normal", of([](const StepReport::Energy& e) { return e.normal; })},
            {"friction", of([](const StepReport::Energy& e) { return e.friction; })},
            {"round_off", of([](const StepReport::Energy& e) { return e.round_off(); })}};
}

Json final_json(const FinalMeasures& final) {
    const bool boxed = final.volume > 0;
    Json json = {{"kinetic_energy", final.kinetic_energy},
                 {"momentum", final.momentum},
                 {"angular_momentum", final.angular_momentum},
                 {"max_overlap", final.overlap},
                 {"coordination", final.coordination},
                 {"free_velocity_norm", final.free_velocity_norm},
                 {"turned_velocity_norm", final.velocity_change_norm},
                 {boxed ? "stress" : "virial", final.stress}};
    if (boxed) json["solid_fraction"] = final.grains_volume / final.volume;
    return json;
}

Json options_json(const SolveOptions& options) {
    Json json;
    detail::visit_options(options,
                          [&json](const detail::OptionInfo& info, const auto& value) { json[info.name] = value; });
    return json;
}

}  // namespace

nlohmann::json run_json(const RunRequest& request, const RunResult& result) {
    double interface_grains = 0;
    for (const StepReport& step : result.steps) interface_grains += step.interface_grains;
    const double steps = double(result.steps.size());
    const int processes = request.over_mpi ? request.share.parts : 1, unconverged = result.unconverged_steps();
    Json json = request.provenance;
    json["load"] = load_json(result.load, *request.threads);
    json.update(costs_json(result));
    json.update(options_json(result.options));
    json.update(steps_json(result));
    json.update({{"schema", "nscdd.run/1"},
                 {"scene", request.scene.name},
                 {"problem", result.problem},
                 {"answer", result.answer},
                 {"notes", result.notes},
                 {"dimension", result.dimension},
                 {"grains", result.grains},
                 {"model", result.model},
                 {"friction", result.friction},
                 {"subdomains", result.ranks},
                 {"threads", *request.threads},
                 {"scheme", *request.scheme},
                 {"interface", result.interface},
                 {"partition", result.partition},
                 {"transport", request.over_mpi              ? "mpi"
                               : sequential(*request.scheme) ? "sequential"
                                                             : "in-process"},
                 {"processes", processes},
                 {"ranks_measured", processes == result.ranks && processes <= request.provenance.machine.cores},
                 {"steps", result.steps.size()},
                 {"start_step", request.start_step},
                 {"h", request.scene.step.h},
                 {"energy", energy_json(result)},
                 {"interface_grains", interface_grains / steps},
                 {"interface_share", interface_grains / steps / std::max(1.0, double(result.grains))},
                 {"peak_memory", {{"total", result.memory}, {"largest", result.most_memory}}},
                 {"multiplicity", result.multiplicity},
                 {"converged", unconverged == 0},
                 {"unconverged_steps", unconverged},
                 {"densities", result.densities},
                 {"wall_masses", result.wall_masses},
                 {"repeats", result.repeats},
                 {"final", final_json(result.final)}});
    if (request.goes_on()) json["from"] = *request.start.from;
    if (!result.so_far.came.empty()) {
        const auto amounts = [](const std::vector<double>& of) -> Json {
            return {{"grains", static_cast<std::int64_t>(of[0])}, {"mass", of[1]}, {"kinetic_energy", of[2]}};
        };
        json["exchange"] = {{"inserted", amounts(result.so_far.came)},
                            {"removed", amounts(result.so_far.left)},
                            {"grains_left", result.grains_left}};
    }
    if (const auto& stopped = result.stopped_by)
        json["stopped_by"] = {{"condition", stopped->condition}, {"value", stopped->value}, {"bound", stopped->bound}};
    return json;
}

nlohmann::json window_json(const RunRequest& request, const RunResult& result) {
    const WindowResult& window = result.window.value();
    const Rows& rows = window.rows;
    Json json = request.provenance;
    json.update({{"scene", request.scene.name},
                 {"model", result.model},
                 {"grains", result.grains},
                 {"scheme", *request.scheme},
                 {"interface", result.interface},
                 {"partition", result.partition},
                 {"window", result.options.window},
                 {"ranks", result.ranks},
                 {"contacts", window.contacts},
                 {"skip", request.window->skip},
                 {"iterations", request.window->iterations},
                 {"repeats", request.window->repeat},
                 {"seconds_per_iteration", window.median()},
                 {"all_repeats", window.repeats},
                 {"load", load_json(window.load, 1)}});
    const auto spread = [&](std::size_t column) { return over_ranks(rows.values, rows.columns, column); };
    for (std::size_t c = 1; c < window_names.size(); ++c) json["per_iteration"][window_names[c]] = spread(c);
    const auto sent = [&](std::size_t c) { return spread(first_communicated + c); };
    json["operations_per_iteration"] = by_operation(sent, sent);
    for (std::size_t w = 0; w < detail::work_names.size(); ++w)
        json["work_per_iteration"][detail::work_names[w]] = spread(first_work + w);
    return json;
}

}  // namespace nscdd
