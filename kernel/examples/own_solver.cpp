// Your own solver of a step: any callable that fulfils the concept StepSolver (decompose/step_solver.hpp).
//
// Projected Jacobi: every contact is solved with the velocities before the pass, and all go half of the way that is
// allowed, so that the order of contacts does not matter. Checked: the velocities are those of NLGS.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nscdd/nscdd.hpp>

using Model = nscdd::Model<2, nscdd::Coulomb>;

struct Jacobi {
    double tolerance;

    nscdd::SolveReport operator()(std::span<nscdd::Subdomain<Model>> parts, nscdd::Communicator& comm,
                                  nscdd::PhaseSeconds& seconds) const {
        if (comm.size() != 1) throw std::logic_error("Jacobi runs on one rank");
        nscdd::Stopwatch watch(comm);
        nscdd::ContactProblem<Model>& problem = parts[0].problem;
        nscdd::prepare_contacts(problem);  // 1/W of each contact
        std::vector<int> touching(problem.bodies.size(), 0);
        for (const auto& c : problem.contacts)
            for (const int body : {c.i, c.j}) ++touching[static_cast<std::size_t>(body)];
        for (const auto& c : problem.wall_contacts) ++touching[static_cast<std::size_t>(c.i)];
        const double step = 1.0 / *std::max_element(touching.begin(), touching.end());  // else it may not converge

        const nscdd::SolveOptions options{.tolerance = tolerance, .max_iterations = 100000};
        nscdd::ConvergenceTest<Model> converged(problem, options);  // of the impulses that it begins with
        nscdd::SolveReport report;
        while (!converged(report)) {
            for (int pass = 0; pass < options.interval(); ++pass) {
                std::vector<Model::Impulse> change;
                solve(problem, problem.wall_contacts, nscdd::WithWall{}, step, change);
                solve(problem, problem.contacts, nscdd::BetweenGrains{}, step, change);
                auto next = change.begin();
                apply(problem, problem.wall_contacts, nscdd::WithWall{}, next);
                apply(problem, problem.contacts, nscdd::BetweenGrains{}, next);
                ++report.iterations;
            }
        }
        watch.lap(seconds.sweep);
        return report;
    }

  private:
    static void solve(auto& problem, auto& contacts, auto kind, double step, std::vector<Model::Impulse>& change) {
        for (const auto& c : contacts) {
            const Model::Impulse v = nscdd::relative_velocity(problem, c, kind);
            change.push_back(step * (nscdd::solve_contact<Model>(c, v, c.inv_wn, c.inv_wt) - c.r));
        }
    }
    static void apply(auto& problem, auto& contacts, auto kind, auto& next) {
        for (auto& c : contacts) {
            c.r += *next;
            nscdd::apply_impulse(problem, c, *next++, kind);
        }
    }
};

int main() {
    std::vector<nscdd::Grain<Model>> grains;
    for (int k = 0; k < 40; ++k) {  // rows that lie in the gaps of those below, shaken
        const int row = k / 8;
        grains.push_back(
            nscdd::make_grain<Model>(k, 0.5, 1, {0.5 + k % 8 + 0.5 * (row % 2), 0.5 + std::sqrt(0.75) * row}));
        grains.back().velocity[0] = 0.5 * std::sin(k);
    }
    nscdd::SimulationSettings<Model> settings;
    settings.h = 1e-3;
    settings.gravity = {0, -9.81};
    settings.materials.set(0, 0, {.friction = 0.3});
    settings.walls.resize(3);
    settings.walls[0].normal = {0, 1};
    settings.walls[1].normal = {1, 0};
    settings.walls[2].normal = {-1, 0};
    settings.walls[2].offset = -8.5;

    nscdd::InProcess comm(1);
    nscdd::Simulation<Model> by_jacobi(comm, settings, grains), by_nlgs(comm, settings, grains);
    int jacobi = 0, nlgs = 0;
    for (int step = 0; step < 8; ++step) {
        const auto ours = by_jacobi.step(Jacobi{1e-6});
        const auto theirs = by_nlgs.step(nscdd::by_nlgs<Model>({.tolerance = 1e-6}));
        if (!ours.solve.converged || !theirs.solve.converged) return 1;
        jacobi += ours.solve.iterations, nlgs += theirs.solve.iterations;
    }
    const auto a = nscdd::gather_grains(by_jacobi), b = nscdd::gather_grains(by_nlgs);
    double difference = 0, fastest = 0;
    for (std::size_t g = 0; g < a.size(); ++g) {
        difference = std::max(difference, (a[g].grain.velocity - b[g].grain.velocity).norm());
        fastest = std::max(fastest, b[g].grain.velocity.norm());
    }
    std::printf("Jacobi %d iterations, NLGS %d; velocities up to %.2e differ by %.1e m/s\n", jacobi, nlgs, fastest,
                difference);
    return difference < 1e-2 * fastest ? 0 : 1;
}
