#include "table.hpp"

#include <fmt/core.h>

#include <set>

namespace wild {

namespace {

std::string name_of(const Judged& j) { return j.ranks > 1 ? fmt::format("{} -n {}", j.solver, j.ranks) : j.solver; }

struct Row {
    int solved = 0, accepted = 0, beyond_03 = 0, beyond_02 = 0, part_03 = 0, part_02 = 0, makes = 0, refused = 0,
        near = 0;
    double worst = 0, worst_part = 0;
    std::vector<int> iterations;

    void add(const Judged& j) {
        ++solved;
        const Verdict& v = j.verdict;
        if (!j.report.converged) {
            ++refused, near += j.judged && v.component <= 0.3;
            return;
        }
        ++accepted, iterations.push_back(j.report.iterations);
        makes += v.made_component > 1e-3;
        if (!j.judged) return;
        beyond_03 += v.distance > 0.3, beyond_02 += v.distance > 0.2;
        part_03 += v.component > 0.3, part_02 += v.component > 0.2;
        worst = std::max(worst, v.distance), worst_part = std::max(worst_part, v.component);
    }
    int median() {
        if (iterations.empty()) return 0;
        const auto middle = iterations.begin() + static_cast<std::ptrdiff_t>(iterations.size() / 2);
        std::ranges::nth_element(iterations, middle);
        return *middle;
    }
    void print(const std::string& name) {
        fmt::print("{:<22}{:>7}{:>9}{:>6}{:>6}{:>8.3f}{:>7}{:>6}{:>8.3f}{:>7}{:>9}{:>6}{:>9}\n", name, solved, accepted,
                   beyond_03, beyond_02, worst, part_03, part_02, worst_part, makes, refused, near, median());
    }
};

void print_rows(const std::vector<Judged>& judged, const char* title, auto&& key) {
    fmt::print("\n{:<22}{:>7}{:>9}{:>6}{:>6}{:>8}{:>7}{:>6}{:>8}{:>7}{:>9}{:>6}{:>9}\n", title, "steps", "accepted",
               ">0.3", ">0.2", "worst", "c>0.3", ">0.2", "worst", "makes", "refused", "near", "median");
    std::map<std::string, Row> rows;
    Row all;
    for (const Judged& j : judged) rows[key(j)].add(j), all.add(j);
    for (auto& [name, row] : rows) row.print(name);
    all.print("all");
}

}  // namespace

void print_table(const std::vector<Judged>& judged, const Tally& tally, int worst) {
    fmt::print(
        "{} scenes, {} steps; answers: violation at most {:.1e}, distance certified to {:.1e}\n"
        "not judged: {} without room, {} without an answer, {} refused at the start or by the step, {} without "
        "contact\n"
        "distance |V - V*|_M over |V* - V_free|_M of the scene, and (c) of its worst component; makes: energy made by "
        "a "
        "component above 1e-3;\nnear: refused within 0.3 of the answer; median: of the iterations of accepted steps\n",
        tally.scenes, judged.size(), tally.worst_violation, tally.worst_certificate, tally.no_room, tally.unsolved,
        tally.refused, tally.no_contact);
    print_rows(judged, "solver", [](const Judged& j) { return j.solver; });
    print_rows(judged, "family", [](const Judged& j) { return j.family; });
    std::vector<Judged> order;
    std::ranges::copy_if(judged, std::back_inserter(order),
                         [](const Judged& j) { return j.report.converged && j.judged; });
    std::ranges::sort(order, std::greater{}, [](const Judged& j) { return j.verdict.component; });
    if (order.size() > static_cast<std::size_t>(worst)) order.resize(static_cast<std::size_t>(worst));
    fmt::print("\naccepted, worst first\n{:>8} {:<18} {:<22}{:>3}{:>7}{:>9}{:>11}{:>12}{:>10}{:>10}{:>7}\n", "seed",
               "family", "solver", "d", "grains", "contacts", "iterations", "vel. error", "distance", "component",
               "of");
    for (const Judged& j : order)
        fmt::print("{:>8} {:<18} {:<22}{:>3}{:>7}{:>9}{:>11}{:>12.2e}{:>10.3f}{:>10.3f}{:>7}\n", j.seed, j.family,
                   name_of(j), j.dimension, j.grains, j.contacts, j.report.iterations, j.report.velocity_error,
                   j.verdict.distance, j.verdict.component, j.verdict.worst_size);
    double jump = 0, inconsistent = 0;
    for (const Judged& j : judged) jump = std::max(jump, j.jump), inconsistent = std::max(inconsistent, j.inconsistent);
    fmt::print(
        "\ncopies of a body differ by {:.1e} of the largest velocity; velocities from those of the impulses by "
        "{:.1e}\n",
        jump, inconsistent);
}

nlohmann::json to_json(const std::vector<Judged>& judged, const Tally& tally) {
    nlohmann::json steps = nlohmann::json::array();
    for (const Judged& j : judged) {
        nlohmann::json step{{"seed", j.seed},
                            {"family", j.family},
                            {"solver", j.solver},
                            {"ranks", j.ranks},
                            {"dimension", j.dimension},
                            {"friction", j.friction},
                            {"grains", j.grains},
                            {"contacts", j.contacts},
                            {"step", j.step},
                            {"converged", j.report.converged},
                            {"iterations", j.report.iterations},
                            {"eta", j.report.residual},
                            {"velocity_error", j.report.velocity_error},
                            {"energy_made", j.report.energy_made},
                            {"penetration", j.report.penetration},
                            {"components", j.verdict.components},
                            {"made", j.verdict.made},
                            {"made_component", j.verdict.made_component}};
        if (j.judged)
            step.update({{"distance", j.verdict.distance},
                         {"distance_component", j.verdict.component},
                         {"contacts_component", j.verdict.worst_size},
                         {"kinetic_excess", j.verdict.kinetic}});
        steps.push_back(std::move(step));
    }
    return {{"scenes", tally.scenes},
            {"no_room", tally.no_room},
            {"no_answer", tally.unsolved},
            {"refused", tally.refused},
            {"no_contact", tally.no_contact},
            {"worst_violation", tally.worst_violation},
            {"worst_certificate", tally.worst_certificate},
            {"steps", std::move(steps)}};
}

}  // namespace wild
