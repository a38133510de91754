// Random scenes that are solved by every solver and judged by an active-set method: are accepted steps near the answer?
//
//   wild_scenes --scenes 2000 --seed 1 --json wild.json
//   wild_scenes --scenes 1 --seed 17 --solvers nlgs        # the scene of seed 17 alone
#include <CLI/CLI.hpp>
#include <fstream>

#include "table.hpp"

namespace {

// Whether an accepted step is beyond what is stated, by the scene or by its worst component.
bool any_beyond(const std::vector<wild::Judged>& judged, double distance, double made) {
    return std::ranges::any_of(judged, [&](const wild::Judged& j) {
        const wild::Verdict& v = j.verdict;
        return j.report.converged && (v.distance > distance || v.component > distance || v.made_component > made);
    });
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app("Judges accepted steps of random scenes by an independent active-set method.");
    int scenes = 100, worst = 10;
    std::uint64_t seed = 1;
    std::string json;
    wild::Task task{.family = {}, .solvers = wild::solver_names};
    double distance = std::numeric_limits<double>::infinity(), made = distance;
    app.add_option("--scenes", scenes, "Number of scenes")->capture_default_str();
    app.add_option("--seed", seed, "Of the first scene; the next ones follow")->capture_default_str();
    app.add_option("--solvers", task.solvers, "Names, separated by commas")
        ->delimiter(',')
        ->check(CLI::IsMember(wild::solver_names))
        ->capture_default_str();
    std::vector<std::string> families;
    for (const auto& one : wild::all_families<scenes::SmoothDisks>) families.push_back(one.name);
    app.add_option("--family", task.family, "Scenes of this family alone")->check(CLI::IsMember(families));
    app.add_option("--max-iterations", task.max_iterations, "Of each solve")->capture_default_str();
    app.add_option("--worst", worst, "Number of accepted steps to list")->capture_default_str();
    app.add_option("--json", json, "File to write every step to");
    app.add_option("--distance", distance, "Exit with 1 if an accepted step is farther from the answer than this");
    app.add_option("--energy-made", made, "Exit with 1 if a component of an accepted step makes more energy than this");
    CLI11_PARSE(app, argc, argv);
    try {
        wild::Tally tally;
        std::vector<wild::Judged> judged;
        for (int k = 0; k < scenes; ++k) wild::judge_seed(seed + static_cast<std::uint64_t>(k), task, tally, judged);
        wild::print_table(judged, tally, worst);
        if (!json.empty()) {
            std::ofstream file(json);
            file << wild::to_json(judged, tally).dump(1) << '\n';
            if (!file.flush()) throw std::runtime_error(json + ": cannot be written");
        }
        return any_beyond(judged, distance, made) ? 1 : 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "wild_scenes: %s\n", error.what());
        return 1;
    }
}
