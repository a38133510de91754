// Random scenes that are solved by every solver and judged by an active-set method: are accepted steps near the answer?
//
//   wild_scenes --scenes 2000 --seed 1 --json reports/results/wild.json --worst 50
//   wild_scenes --scenes 1 --seed 17 --solvers nlgs        # the scene of seed 17 alone
#include <CLI/CLI.hpp>
#include <atomic>
#include <mutex>
#include <thread>

#include "files/progress.hpp"
#include "files/report_json.hpp"
#include "table.hpp"

namespace {

// Whether an accepted step is beyond what is stated, by the scene or by its worst component.
bool any_beyond(const std::vector<wild::Judged>& judged, double distance, double made, double inconsistent) {
    return std::ranges::any_of(judged, [&](const wild::Judged& j) {
        const wild::Verdict& v = j.verdict;
        return j.inconsistent > inconsistent ||
               (j.report.converged && (v.distance > distance || v.component > distance || v.made_component > made));
    });
}

struct All {
    std::vector<wild::Judged> judged;  // in the order of seeds
    wild::Tally tally;
};

// Every thread takes the next scene; what is judged does not depend on their number.
All judge_all(std::uint64_t seed, int scenes, int threads, const wild::Task& task) {
    All all;
    std::mutex mutex;
    std::atomic<int> next = 0;
    std::exception_ptr failed;
    nscdd::Progress progress(true, scenes, "scene");
    const auto work = [&] {
        for (int k = next++; k < scenes; k = next++) {
            All one;
            try {
                wild::judge_seed(seed + static_cast<std::uint64_t>(k), task, one.tally, one.judged);
            } catch (...) {
                const std::lock_guard lock(mutex);
                failed = std::current_exception(), next = scenes;
                return;
            }
            const std::lock_guard lock(mutex);
            all.tally.add(one.tally);
            all.judged.insert(all.judged.end(), one.judged.begin(), one.judged.end());
            progress.show(all.tally.scenes, fmt::format("{} steps", all.judged.size()));
        }
    };
    {
        std::vector<std::jthread> crew;
        for (int k = 0; k < threads; ++k) crew.emplace_back(work);
    }
    if (failed) std::rethrow_exception(failed);
    std::ranges::stable_sort(all.judged, {}, [](const wild::Judged& j) { return j.seed; });
    return all;
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app("Judges accepted steps of random scenes by an independent active-set method.");
    int scenes = 100, threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    std::size_t worst = 10;
    std::uint64_t seed = 1;
    std::string json;
    wild::Task task{.family = {}, .solvers = wild::solver_names};
    double distance = std::numeric_limits<double>::infinity(), made = distance, inconsistent = distance;
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
    app.add_option("--threads", threads, "Scenes that are solved at a time")->check(CLI::Range(1, 1024));
    app.add_option("--json", json, "File for rows by solver and family, and the worst steps");
    app.add_option("--distance", distance, "Exit with 1 if an accepted step is farther from the answer than this");
    app.add_option("--energy-gain", made, "Exit with 1 if a component of an accepted step makes more energy than this");
    app.add_option("--inconsistent", inconsistent,
                   "Exit with 1 if velocities differ from those of the impulses by more");
    CLI11_PARSE(app, argc, argv);
    try {
        const auto [judged, tally] = judge_all(seed, scenes, threads, task);
        wild::print_table(judged, tally, worst);
        if (!json.empty()) {
            nlohmann::json record = wild::to_json(judged, tally, worst);
            record.update(nscdd::provenance(argc, argv));
            nscdd::write_json(json, record);
        }
        return any_beyond(judged, distance, made, inconsistent) ? 1 : 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "wild_scenes: %s\n", error.what());
        return 1;
    }
}
