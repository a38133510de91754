#include "table.hpp"

#include <fmt/core.h>

#include <map>

namespace wild {

namespace {

std::string name_of(const Judged& j) { return j.ranks > 1 ? fmt::format("{} -n {}", j.solver, j.ranks) : j.solver; }

// The smallest value that so large a part of them does not exceed; 0 of none.
double quantile(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    std::ranges::sort(values);
    const double place = std::ceil(part * double(values.size())) - 1;
    return values[static_cast<std::size_t>(std::max(place, 0.0))];
}

struct Row {
    int solved = 0, accepted = 0, refused = 0, near = 0;
    std::vector<double> scene, component, made, iterations;  // of accepted steps

    void add(const Judged& j) {
        ++solved;
        const Verdict& v = j.verdict;
        if (!j.report.converged) {
            ++refused, near += j.judged && v.component <= 0.3;
            return;
        }
        ++accepted, iterations.push_back(j.report.iterations), made.push_back(std::max(v.made_component, 0.0));
        if (j.judged) scene.push_back(v.distance), component.push_back(v.component);
    }
};

int beyond(const std::vector<double>& values, double bound) {
    return static_cast<int>(std::ranges::count_if(values, [&](double value) { return value > bound; }));
}

void print(const std::string& name, const Row& row) {
    fmt::print("{:<22}{:>7}{:>9}{:>6}{:>6}{:>8.3f}{:>7}{:>6}{:>8.3f}{:>7}{:>9}{:>6}{:>9}\n", name, row.solved,
               row.accepted, beyond(row.scene, 0.3), beyond(row.scene, 0.2), quantile(row.scene, 1),
               beyond(row.component, 0.3), beyond(row.component, 0.2), quantile(row.component, 1),
               beyond(row.made, 1e-3), row.refused, row.near, quantile(row.iterations, 0.5));
}

std::map<std::string, Row> rows_by(const std::vector<Judged>& judged, auto&& key) {
    std::map<std::string, Row> rows;
    for (const Judged& j : judged) rows[key(j)].add(j), rows["all"].add(j);
    return rows;
}

const auto by_solver = [](const Judged& j) { return j.solver; };
const auto by_family = [](const Judged& j) { return j.family; };

void print_rows(const std::vector<Judged>& judged, const char* title, auto&& key) {
    fmt::print("\n{:<22}{:>7}{:>9}{:>6}{:>6}{:>8}{:>7}{:>6}{:>8}{:>7}{:>9}{:>6}{:>9}\n", title, "steps", "accepted",
               ">0.3", ">0.2", "worst", "c>0.3", ">0.2", "worst", "makes", "refused", "near", "median");
    const auto rows = rows_by(judged, key);
    for (const auto& [name, row] : rows)
        if (name != "all") print(name, row);
    print("all", rows.at("all"));
}

std::vector<Judged> worst_of(const std::vector<Judged>& judged, std::size_t most) {
    std::vector<Judged> order;
    std::ranges::copy_if(judged, std::back_inserter(order),
                         [](const Judged& j) { return j.report.converged && j.judged; });
    std::ranges::stable_sort(order, std::greater{}, [](const Judged& j) { return j.verdict.component; });
    if (order.size() > most) order.resize(most);
    return order;
}

nlohmann::json spread(const std::vector<double>& values, double bound) {
    return {{"of", values.size()},
            {"median", quantile(values, 0.5)},
            {"of_99", quantile(values, 0.99)},
            {"largest", quantile(values, 1)},
            {"beyond", beyond(values, bound)}};
}

void add_rows(nlohmann::json& list, const std::vector<Judged>& judged, const char* kind, auto&& key) {
    for (const auto& [name, row] : rows_by(judged, key))
        list.push_back({{"by", kind},
                        {"name", name},
                        {"steps", row.solved},
                        {"accepted", row.accepted},
                        {"refused", row.refused},
                        {"refused_near", row.near},
                        {"iterations_median", quantile(row.iterations, 0.5)},
                        {"scene_distance", spread(row.scene, 0.3)},
                        {"distance", spread(row.component, 0.3)},
                        {"energy_gain", spread(row.made, 1e-3)}});
}

}  // namespace

void print_table(const std::vector<Judged>& judged, const Tally& tally, std::size_t worst) {
    fmt::print(
        "{} scenes, {} steps; answers: violation at most {:.1e}, distance certified to {:.1e}\n"
        "not judged: {} without room, {} without an answer, {} refused at the start or by the step, {} without "
        "contact\n"
        "distance |V - V*|_M over |V* - V_free|_M of the scene, and (c) of its worst component; makes: energy gain of "
        "a component above 1e-3;\nnear: refused within 0.3 of the answer; median: of the iterations of accepted "
        "steps\n",
        tally.scenes, judged.size(), tally.worst_violation, tally.worst_certificate, tally.no_room, tally.unsolved,
        tally.refused, tally.no_contact);
    if (judged.empty()) return;
    print_rows(judged, "solver", by_solver);
    print_rows(judged, "family", by_family);
    fmt::print("\naccepted, worst first\n{:>8} {:<18} {:<22}{:>3}{:>7}{:>9}{:>11}{:>10}{:>11}{:>10}{:>11}{:>7}\n",
               "seed", "family", "solver", "d", "grains", "contacts", "iterations", "estimate", "gap error", "distance",
               "component", "of");
    for (const Judged& j : worst_of(judged, worst))
        fmt::print("{:>8} {:<18} {:<22}{:>3}{:>7}{:>9}{:>11}{:>10.3f}{:>11.1e}{:>10.3f}{:>11.3f}{:>7}\n", j.seed,
                   j.family, name_of(j), j.dimension, j.grains, j.contacts, j.report.iterations, j.report.distance,
                   j.report.gap_error, j.verdict.distance, j.verdict.component, j.verdict.worst_size);
    double jump = 0, inconsistent = 0;
    for (const Judged& j : judged) jump = std::max(jump, j.jump), inconsistent = std::max(inconsistent, j.inconsistent);
    fmt::print(
        "\ncopies of a body differ by {:.1e} of the largest velocity; velocities from those of the impulses by "
        "{:.1e}\n",
        jump, inconsistent);
}

nlohmann::json to_json(const std::vector<Judged>& judged, const Tally& tally, std::size_t worst) {
    nlohmann::json rows = nlohmann::json::array(), steps = nlohmann::json::array();
    add_rows(rows, judged, "solver", by_solver);
    add_rows(rows, judged, "family", by_family);
    for (const Judged& j : worst_of(judged, worst))
        steps.push_back({{"seed", j.seed},
                         {"family", j.family},
                         {"solver", j.solver},
                         {"subdomains", j.ranks},
                         {"dimension", j.dimension},
                         {"grains", j.grains},
                         {"contacts", j.contacts},
                         {"iterations", j.report.iterations},
                         {"estimate", j.report.distance},
                         {"gap_error", j.report.gap_error},
                         {"scene_distance", j.verdict.distance},
                         {"distance", j.verdict.component},
                         {"contacts_component", j.verdict.worst_size},
                         {"energy_gain", j.verdict.made_component}});
    return {{"schema", "nscdd.wild/1"},
            {"scenes", tally.scenes},
            {"steps", judged.size()},
            {"not_judged",
             {{"no_room", tally.no_room},
              {"no_answer", tally.unsolved},
              {"refused", tally.refused},
              {"no_contact", tally.no_contact}}},
            {"rows", std::move(rows)},
            {"worst", std::move(steps)}};
}

}  // namespace wild
