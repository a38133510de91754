// The steps of a scene by one solver, each judged.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>

#include "make_scene.hpp"
#include "verdict.hpp"

namespace wild {

struct Judged {  // one step by one solver
    std::uint64_t seed = 0;
    std::string family, solver;
    int dimension = 2, grains = 0, ranks = 1, step = 1;
    double contacts = 0;
    bool friction = false, judged = false;  // judged: against an answer
    nscdd::SolveReport report;
    Verdict verdict;
    double inconsistent = 0, jump = 0;  // Captured
};

struct Tally {  // of what was not judged
    int scenes = 0, no_room = 0, unsolved = 0, refused = 0, no_contact = 0;
    double worst_violation = 0, worst_certificate = 0;  // of the answers

    void add(const Tally& more) {
        scenes += more.scenes, no_room += more.no_room, unsolved += more.unsolved;
        refused += more.refused, no_contact += more.no_contact;
        worst_violation = std::max(worst_violation, more.worst_violation);
        worst_certificate = std::max(worst_certificate, more.worst_certificate);
    }
};

inline const std::vector<std::string> solver_names{
    "nlgs", "nlgs-accelerated", "dcs", "dcs-accelerated", "ccs", "ccs-accelerated", "spg", "apgd", "newton"};

// Whether the solver runs on several ranks.
inline bool decomposed(const std::string& name) { return name.starts_with("dcs") || name.starts_with("ccs"); }

// Its default, 2,000 factorisations, are minutes in a few scenes.
inline nscdd::NewtonOptions newton_options() {
    nscdd::NewtonOptions options;
    options.max_iterations = 300;
    return options;
}

template <class M>
nscdd::AnyStepSolver<M> make_solver(const std::string& name, int max_iterations) {
    using namespace nscdd;
    SolveOptions options = name.ends_with("-accelerated") ? SolveOptions{}.accelerated() : SolveOptions{};
    options.max_iterations = max_iterations;
    if (name.starts_with("nlgs")) return by_nlgs<M>(options);
    if (name.starts_with("dcs")) return by_nscdd<Dcs<M>>(options);
    if (name.starts_with("ccs")) return by_nscdd<Ccs<M>>(options);
    if (name == "spg") return by_gradient<M>(options, Descent::spectral);
    if (name == "apgd") return by_gradient<M>(options, Descent::nesterov);
    if (name == "newton") return by_newton<M>(newton_options());
    throw std::invalid_argument("there is no solver '" + name + "'");
}

// Where the judged steps begin; nothing if the step before is refused.
template <class M>
std::optional<Scene<M>> start(Scene<M> scene) {
    if (!scene.tight || scene.warm_steps == 0) return scene;
    try {
        nscdd::InProcess comm(1);
        const auto outcome = scenes::run<M>(scene, comm, scene.warm_steps, nscdd::by_newton<M>(newton_options()));
        scene.settings.walls = outcome.walls;
        for (const auto& g : outcome.grains) scene.grains[static_cast<std::size_t>(g.grain.id)] = g.grain;
        scene.impulses.clear();
        for (const auto& c : outcome.contacts) scene.impulses.push_back(c.pair());
    } catch (const std::runtime_error&) {
        return std::nullopt;
    }
    scene.warm_steps = 0;
    if (scene.forget) scene.impulses.clear();
    return scene;
}

// Answers of steps that were judged before; several solvers take the same step.
class Answers {
  public:
    const Answer& of(const Quadratic& problem) {
        for (const auto& [known, answer] : known_)
            if (same_problem(known, problem)) return answer;
        return known_.emplace_back(problem, solve(problem)).second;
    }

  private:
    std::vector<std::pair<Quadratic, Answer>> known_;
};

inline void judge_step(const Captured& found, bool friction, Judged one, Answers& answers, Tally& tally,
                       std::vector<Judged>& judged) {
    one.contacts = double(found.r.size()), one.inconsistent = found.inconsistent, one.jump = found.jump;
    one.verdict = judge_energy(found);
    if (!friction) {
        const Answer& answer = answers.of(found.problem);
        tally.no_room += !answer.room, tally.unsolved += answer.room && !answer.solved;
        one.judged = answer.solved && answer.room;
        if (one.judged) {
            one.verdict = judge(found, answer);
            tally.worst_violation = std::max(tally.worst_violation, answer.violation);
            tally.worst_certificate = std::max(tally.worst_certificate, answer.certificate);
        }
    }
    judged.push_back(one);
}

struct NotConverged {};  // ends a step: another attempt, with more contacts, would not either

template <class M>
void judge_solver(const Scene<M>& scene, const Judged& about, int max_iterations, Answers& answers, Tally& tally,
                  std::vector<Judged>& judged) {
    const nscdd::AnyStepSolver<M> solve_step = make_solver<M>(about.solver, max_iterations);
    nscdd::InProcess comm(about.ranks);
    try {
        nscdd::Simulation<M> simulation(comm, scene.settings, scene.grains, scene.impulses);
        std::optional<Captured> found;
        nscdd::SolveReport report;  // of one attempt; that of the step has the iterations of all
        const nscdd::AnyStepSolver<M> witness = [&](std::span<nscdd::Subdomain<M>> parts, nscdd::Communicator& among,
                                                    nscdd::PhaseSeconds& seconds) {
            Vector start;
            if constexpr (!M::friction) start = by_impulses(capture<M>(parts, simulation.settings()));
            report = solve_step(parts, among, seconds);
            found = capture<M>(parts, simulation.settings(), start);
            if (!report.converged) throw NotConverged{};
            return report;
        };
        for (int step = 1; step <= scene.warm_steps + scene.judged_steps; ++step) {
            found.reset();
            try {
                simulation.step(witness);
            } catch (const NotConverged&) {
            }
            if (step > scene.warm_steps) {
                Judged one = about;
                one.step = step - scene.warm_steps, one.report = report;
                found ? judge_step(*found, M::friction, one, answers, tally, judged) : void(++tally.no_contact);
            } else if (found && !report.converged) {
                ++tally.refused;
            }
            if (found && !report.converged) break;
        }
    } catch (const std::runtime_error&) {  // grains overlap too much or pass each other: nothing to judge
        ++tally.refused;
    }
}

struct Task {
    std::string family;  // empty: any
    std::vector<std::string> solvers;
    int max_iterations = 20000;
};

// What the solvers make of the scene of a seed.
template <class M>
void judge_scene(std::uint64_t seed, const Task& task, Tally& tally, std::vector<Judged>& judged) {
    ++tally.scenes;
    const std::optional<Scene<M>> scene = start(make_scene<M>(seed, task.family));
    if (!scene) {
        ++tally.refused;
        return;
    }
    Answers answers;
    Draw draw(seed ^ 0x9e3779b97f4a7c15u);
    for (const std::string& name : task.solvers) {
        Judged about;
        about.seed = seed, about.family = scene->name, about.solver = name;
        about.dimension = M::dim, about.friction = M::friction, about.grains = static_cast<int>(scene->grains.size());
        const int ranks = draw.integer(2, 16);
        about.ranks = decomposed(name) ? ranks : 1;
        judge_solver(*scene, about, task.max_iterations, answers, tally, judged);
    }
}

// Every fourth scene is in 3D. Every tenth has friction, and is judged by its energy alone.
inline void judge_seed(std::uint64_t seed, const Task& task, Tally& tally, std::vector<Judged>& judged) {
    const bool spatial = seed % 4 == 3, rough = seed % 10 == 9;
    if (rough)
        (spatial ? judge_scene<scenes::Spheres> : judge_scene<scenes::Disks>)(seed, task, tally, judged);
    else
        (spatial ? judge_scene<scenes::SmoothSpheres> : judge_scene<scenes::SmoothDisks>)(seed, task, tally, judged);
}

}  // namespace wild
