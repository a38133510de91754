// Projected gradients: exact answers, agreement with NLGS on bodies, the law on a stored W, an end where there is no
// answer.
#include "solver_problems.hpp"

using namespace nscdd;
using scenes::Disks;
using scenes::SmoothDisks;
using scenes::SmoothSpheres;
using scenes::Spheres;

namespace {

// How accurate an answer to ask for: Nesterov's iteration slows down below.
double attainable(Descent descent) { return descent == Descent::spectral ? 1e-8 : 1e-4; }

}  // namespace

TEMPLATE_TEST_CASE("dense scenes from zero impulses, and what NLGS finds", "[gradient]", EVERY_MODEL) {
    using M = TestType;
    const Descent descent = GENERATE(Descent::spectral, Descent::nesterov);
    const double tolerance = attainable(descent);
    for (scenes::Scene<M>& scene : scenes::dense_scenes<M>()) {
        INFO(scene.name);
        ContactProblem<M> problem = test::next_problem(scene), reference = problem;
        REQUIRE(problem.contact_count() > 60);
        const SolveReport report =
            projected_gradient(problem, {.tolerance = tolerance, .max_iterations = 10000}, descent);
        INFO(report.iterations << " iterations, eta " << report.residual);
        CHECK(report.converged);
        CHECK(residual_parts(problem).eta() <= tolerance);
        const SolveReport sweeps = nlgs(reference, {.tolerance = 1e-9, .max_iterations = 200000});
        REQUIRE(sweeps.converged);
        CHECK(test::velocity_difference(problem, reference) <= 1e3 * tolerance);
    }
}

TEMPLATE_TEST_CASE("a column under its weight: impulses known exactly", "[gradient]", SmoothDisks, Spheres) {
    using M = TestType;
    constexpr int count = 10;
    SimulationSettings<M> settings;
    settings.walls.resize(1);
    settings.walls[0].normal = M::Vec::Unit(M::dim - 1);
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    settings.gravity[M::dim - 1] = -10;
    settings.h = 0.01;
    std::vector<Grain<M>> grains;
    for (int k = 0; k < count; ++k) grains.push_back(make_grain<M>(k, 0.5, 1.0, (0.5 + k) * M::Vec::Unit(M::dim - 1)));
    for (const Descent descent : {Descent::spectral, Descent::nesterov}) {
        InProcess comm(1);
        Simulation<M> simulation(comm, settings, grains);
        const StepReport report = simulation.step(by_gradient<M>({.tolerance = 1e-11}, descent));
        INFO(report.solve.iterations << " iterations");
        REQUIRE(report.solve.converged);
        CHECK(report.solve.iterations <= 1000);
        for (const auto& c :
             gather_contacts(simulation))  // eta is at most 100 times below the error, by the least mode
            CHECK(c.impulse.norm() ==
                  Approx((c.j < 0 ? count : count - std::max(c.i, c.j)) * grains[0].mass * 0.1).epsilon(1e-9));
    }
}

TEMPLATE_TEST_CASE("a stored W of low rank, blocks full, by projected gradients", "[gradient]",
                   (std::integral_constant<int, 2>), (std::integral_constant<int, 3>)) {
    constexpr int dim = TestType::value;
    test::Random random(5);
    test::Statuses count;
    for (int trial = 0; trial < 10; ++trial) {
        const auto problem = test::random_problem<dim>(random, 30, 25);
        std::vector<typename DelassusProblem<dim>::Vec> r(30, DelassusProblem<dim>::Vec::Zero());
        const SolveReport report =
            projected_gradient(problem, r, {.tolerance = 1e-11}, Descent::spectral,
                               [&](const auto& now) { return detail::stopping_error(problem, now); });
        INFO("trial " << trial << ", " << report.iterations << " iterations, natural map " << report.residual);
        REQUIRE(report.converged);
        test::check_law(problem, r, 1e-8, count);
    }
    CHECK(count.sliding > 0);
    CHECK(count.sticking > 0);
    CHECK(count.open > 0);
}

TEST_CASE("projected gradients refuse what is not finite, or that nothing can move", "[gradient]") {
    ContactProblem<Spheres> bodies = test::next_problem(scenes::settled(scenes::heap<Spheres>(false), 100));
    bodies.bodies[7].v[1] = std::nan("");
    CHECK_THROWS_AS(projected_gradient(bodies, {}), std::invalid_argument);

    test::Random random(7);
    auto problem = test::random_problem<2>(random, 5, 8);
    std::vector<DelassusProblem<2>::Vec> r(5, DelassusProblem<2>::Vec::Zero());
    problem.blocks[static_cast<std::size_t>(problem.diagonal[3])].setZero();
    CHECK_THROWS_AS(projected_gradient(problem, r, {}, Descent::spectral, [](const auto&) { return 1.0; }),
                    std::invalid_argument);
}

TEMPLATE_TEST_CASE("walls that leave no room stop projected gradients at the cap", "[gradient]", SmoothDisks, Spheres) {
    using M = TestType;
    SimulationSettings<M> settings{.h = 1e-3};
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    for (const double sign : {1.0, -1.0}) {
        Wall<M>& wall = settings.walls.emplace_back();
        wall.normal = sign * M::Vec::Unit(0);
        wall.offset = -0.5;
        wall.velocity = wall.normal;
    }
    const std::vector<Grain<M>> grains{make_grain<M>(0, 0.5, 1.0, M::Vec::Zero())};
    for (const Descent descent : {Descent::spectral, Descent::nesterov}) {
        InProcess comm(1);
        const SolveReport report =
            Simulation<M>(comm, settings, grains)
                .step(by_gradient<M>({.bounds = {.max_penetration = 1e-6}, .max_iterations = 200}, descent))
                .solve;
        CHECK_FALSE(report.converged);
        CHECK(report.iterations == 200);
        CHECK(std::isfinite(report.residual));
    }
}
