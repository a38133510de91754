// The Newton methods: derivatives and cone algebra, exact answers out of NLGS's reach, a hyperstatic packing, agreement
// with NLGS, problems with a stored W, and an end where there is no answer. test_analytic.cpp has it on the hard cases
// that NLGS solves too.
#include "../small_scenes.hpp"
#include "solver_problems.hpp"

using namespace nscdd;
using nscdd::test::check_law;
using nscdd::test::next_problem;
using nscdd::test::Random;
using nscdd::test::random_problem;
using nscdd::test::random_unit;
using nscdd::test::random_vector;
using nscdd::test::Statuses;
using nscdd::test::uniform;
using nscdd::test::velocity_difference;
using scenes::Disks;
using scenes::SmoothDisks;
using scenes::SmoothSpheres;
using scenes::Spheres;

namespace {

constexpr NewtonOptions precise{.tolerance = 1e-10, .warm_sweeps = 0};

template <int size>
void check_derivatives(Random& random) {
    using Vec = typename detail::ProjectedImpulse<size>::Vec;
    const double step = 1e-6;
    for (int trial = 0; trial < 200; ++trial) {
        Vec n = random_vector<Vec>(random);
        n /= n.norm();
        const Vec z = random_vector<Vec>(random), dz = random_vector<Vec>(random, step);
        const double mu = size == 1 ? 0 : uniform(random, 0.1, 1);
        const auto check = [&](auto&& project) {
            const auto at = project(z, n, mu);
            const Vec change = project(z + dz, n, mu).value - at.value;
            // off the kinks, to second order in the step
            if ((project(z + dz, n, mu).derivative - at.derivative).norm() > 0.1) return;
            CHECK((change - at.derivative * dz).norm() <= 1e-9);
            CHECK(at.open == (at.value.norm() == 0));
        };
        check(detail::project_coulomb<size>);
        check(detail::project_cone<size>);
    }
}

template <int size>
void check_cone(Random& random) {
    using Vec = typename detail::Cone<size>::Vec;
    for (int trial = 0; trial < 200; ++trial) {
        detail::Cone<size> cone{random_vector<Vec>(random)};
        cone.n /= cone.n.norm();
        const auto inside = [&] {
            const Vec t = cone.tangent(random_vector<Vec>(random));
            return Vec(t + t.norm() * (1 + std::pow(10, uniform(random, -6, 1))) * cone.n + 0.1 * (size == 1) * cone.n);
        };
        const Vec s = inside(), z = inside(), d = random_vector<Vec>(random);
        const double loss = 1e-9 / std::min(cone.determinant(s), cone.determinant(z));  // to what round-off leaves
        CHECK((cone.product(s, cone.quotient(s, d)) - d).norm() <= loss);
        detail::ConeScaling<size> scaling;
        REQUIRE(scaling.compute(cone, s, z));
        CHECK((scaling.w * scaling.inverse - detail::Cone<size>::Block::Identity()).norm() <= loss);
        CHECK((scaling.inverse * s - scaling.point).norm() <= loss);
        CHECK((scaling.w * z - scaling.point).norm() <= loss);
        const auto [r, w] = cone.split(d, 0.01);
        CHECK((r - w - d).norm() <= 1e-12);
        CHECK((cone.product(r, w) - 0.01 * cone.n).norm() <= 1e-12);
        CHECK(std::min(cone.determinant(r), cone.determinant(w)) > 0);
        const double t = cone.step_limit(s, d, 1e3);
        REQUIRE(t > 0);
        if (t == 1e3) continue;
        CHECK(cone.determinant(s + 0.999 * t * d) > 0);
        CHECK((s + 0.999 * t * d).dot(cone.n) > 0);
        CHECK((cone.determinant(s + 1.001 * t * d) < 0 || (s + 1.001 * t * d).dot(cone.n) < 0));
    }
    CHECK_FALSE(detail::ConeScaling<size>().compute({Vec::Unit(0)}, Vec::Zero(), Vec::Unit(0)));
}

// 6 x 6 x 6 spheres under a heavy lid: more unknowns at contacts that carry than grains have.
ContactProblem<Spheres> pile() {
    constexpr int edge = 6;
    Random random(3);
    SimulationSettings<Spheres> settings;
    settings.gravity[2] = -1;
    settings.h = 1e-2;
    settings.materials.set(0, 0, {0.15, 0.0});
    for (int d = 0; d < 3; ++d)
        for (const double sign : {1.0, -1.0}) {
            Wall<Spheres>& wall = settings.walls.emplace_back();
            wall.normal = sign * Spheres::Vec::Unit(d);
            wall.offset = sign > 0 ? 0.0 : -1.02 * edge;
        }
    scenes::drive(settings.walls.back(), 200.0, 100.0);
    std::vector<Grain<Spheres>> grains;
    for (int id = 0; id < edge * edge * edge; ++id) {
        const Spheres::Vec cell(id % edge, id / edge % edge, id / edge / edge);
        const Spheres::Vec shift = 0.02 * random_vector<Spheres::Vec>(random);
        grains.push_back(make_grain<Spheres>(id, uniform(random, 0.4, 0.5), 1.0,
                                             1.02 * (cell + Spheres::Vec::Constant(0.5)) + shift));
    }
    InProcess comm(1);
    Simulation<Spheres> simulation(comm, settings, grains);
    for (int step = 0; step < 400; ++step) simulation.step(by_nlgs<Spheres>({.tolerance = 1e-3}));
    ContactProblem<Spheres> problem;
    simulation.step([&](std::span<Subdomain<Spheres>> parts, Communicator&, PhaseSeconds&) {
        problem = parts[0].problem;
        return nlgs(parts[0].problem, {});
    });
    detail::replace_impulses(problem, [](const auto&) { return Spheres::Impulse::Zero(); });
    return problem;
}

}  // namespace

TEST_CASE("cone algebra and scaling", "[newton]") {
    Random random(2);
    check_cone<1>(random);
    check_cone<2>(random);
    check_cone<3>(random);
}

TEST_CASE("some hundred spheres under a heavy lid, hyperstatic, from zero impulses to 1e-10", "[newton]") {
    ContactProblem<Spheres> problem = pile();
    const NewtonReport report = newton_solve(problem, precise);
    INFO(report.interior << " interior, " << report.outer << " outer, " << report.iterations << " Newton steps, eta "
                         << report.residual);
    CHECK(report.converged);
    CHECK(residual_parts(problem).eta() <= 1e-10);
    CHECK(report.interior > 0);
    CHECK(report.iterations <= 120);
    double largest = 0;
    detail::each_contact(
        problem, [&](const Contact<Spheres>& c, auto) { largest = std::max(largest, c.r.cwiseAbs().maxCoeff()); });
    std::size_t loaded = 0;
    std::vector<bool> carries(problem.bodies.size());
    detail::each_contact(problem, [&](const Contact<Spheres>& c, auto kind) {
        if (c.r.norm() <= 1e-6 * largest) return;
        ++loaded;
        carries[static_cast<std::size_t>(c.i)] = true;
        if constexpr (std::is_same_v<decltype(kind), BetweenGrains>) carries[static_cast<std::size_t>(c.j)] = true;
    });
    const auto grains = static_cast<std::size_t>(std::count(carries.begin(), carries.end(), true));
    INFO(loaded << " loaded contacts, " << grains << " grains");
    CHECK(grains > 150);
    CHECK(3 * loaded > 6 * grains);
}

TEST_CASE("projections on the law have the derivatives they say", "[newton]") {
    Random random(1);
    check_derivatives<1>(random);
    check_derivatives<2>(random);
    check_derivatives<3>(random);
}

TEMPLATE_TEST_CASE("a mass upon another, ratios to a million both ways", "[newton]", SmoothDisks, Spheres) {
    using M = TestType;
    const double ratio = GENERATE(1e-6, 1e-3, 1.0, 1e3, 1e6), g = 9.81;
    SimulationSettings<M> settings;
    settings.walls.resize(1);
    settings.walls[0].normal = M::Vec::Unit(M::dim - 1);
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    settings.gravity[M::dim - 1] = -g;
    settings.h = 0.01;
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 2; ++k) {
        auto grain = make_grain<M>(k, 0.5, 1.0, (0.5 + k) * M::Vec::Unit(M::dim - 1));
        const double mass = k == 0 ? 1 : ratio;
        grain.inertia *= mass / grain.mass;
        grain.mass = mass;
        grains.push_back(grain);
    }
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, grains);
    const StepReport report = simulation.step(by_newton<M>({.tolerance = 1e-12, .warm_sweeps = 0}));
    INFO("ratio " << ratio << ", Newton steps " << report.solve.iterations);
    REQUIRE(report.solve.converged);
    CHECK(report.solve.iterations <= 50);
    // 1e-12 of the energy is 1e-6 of the impulses where the eigenvalues of W are a million apart
    for (const auto& c : gather_contacts(simulation))
        CHECK(c.impulse.norm() == Approx((c.j < 0 ? 1 + ratio : ratio) * g * settings.h).epsilon(1e-6));
}

TEMPLATE_TEST_CASE("dense scenes from zero impulses to 1e-10, and what NLGS finds", "[newton]", EVERY_MODEL) {
    using M = TestType;
    for (scenes::Scene<M>& scene : scenes::dense_scenes<M>()) {
        INFO(scene.name);
        ContactProblem<M> problem = next_problem(scene), reference = problem;
        REQUIRE(problem.contact_count() > 60);
        const NewtonReport report = newton_solve(problem, precise);
        INFO(report.outer << " outer, " << report.iterations << " Newton steps, eta " << report.residual);
        CHECK(report.converged);
        CHECK(report.residual <= 1e-10);
        CHECK(residual_parts(problem).eta() <= 1e-10);
        CHECK(report.factorisations == report.iterations);
        const SolveReport sweeps = nlgs(reference, {.tolerance = 1e-9, .max_iterations = 200000});
        REQUIRE(sweeps.converged);
        CHECK(velocity_difference(problem, reference) <= 1e-4);
    }
}

TEMPLATE_TEST_CASE("a stored W of low rank, blocks full", "[newton]", (std::integral_constant<int, 2>),
                   (std::integral_constant<int, 3>)) {
    constexpr int dim = TestType::value;
    Random random(5);
    Statuses count;
    for (int trial = 0; trial < 10; ++trial) {
        const auto problem = random_problem<dim>(random, 30, 25);
        std::vector<typename DelassusProblem<dim>::Vec> r(30, DelassusProblem<dim>::Vec::Zero());
        const NewtonReport report = newton_solve(problem, r, {.tolerance = 1e-12});
        INFO("trial " << trial << ", " << report.outer << " outer, " << report.iterations << " Newton steps, residual "
                      << report.residual);
        REQUIRE(report.converged);
        check_law(problem, r, 1e-9, count);
    }
    CHECK(count.sliding > 0);
    CHECK(count.sticking > 0);
    CHECK(count.open > 0);
}

TEST_CASE("a measure of one's own decides when a stored W is solved", "[newton]") {
    Random random(6);
    const auto problem = random_problem<3>(random, 10, 8);
    std::vector<DelassusProblem<3>::Vec> r(10, DelassusProblem<3>::Vec::Zero());
    int calls = 0;
    const NewtonReport report = newton_solve(problem, r, {}, [&](const auto&) { return ++calls < 4 ? 1.0 : 0.0; });
    CHECK(report.converged);
    CHECK(calls == 6);  // the interior-point method hands its answer over, and Newton's method makes one step at least
    CHECK_THROWS_AS(newton_solve(problem, r, {}, [](const auto&) { return std::nan(""); }), std::runtime_error);
}

TEST_CASE("a contact that nothing can move is refused", "[newton]") {
    Random random(7);
    auto problem = random_problem<2>(random, 5, 8);
    problem.blocks[static_cast<std::size_t>(problem.diagonal[3])].setZero();
    std::vector<DelassusProblem<2>::Vec> r(5, DelassusProblem<2>::Vec::Zero());
    CHECK_THROWS_AS(newton_solve(problem, r), std::invalid_argument);
}

TEMPLATE_TEST_CASE("walls that leave no room: not converged, within the caps", "[newton]", SmoothDisks, Disks,
                   Spheres) {
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
    const NewtonOptions options{
        .bounds = {.max_penetration = 1e-6}, .max_iterations = 200, .warm_sweeps = 0, .max_outer = 50};
    NewtonReport report;
    InProcess comm(1);
    Simulation<M>(comm, settings, grains).step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) {
        report = newton_solve(parts[0].problem, options);
        return report;
    });
    INFO("eta " << report.residual << ", penetration " << report.penetration);
    CHECK_FALSE(report.converged);
    CHECK(report.iterations <= options.max_iterations);
    CHECK(report.outer <= options.max_outer);
    CHECK(std::isfinite(report.residual));
}

TEST_CASE("a problem without a least radius is not asked how deep contacts close", "[newton]") {
    // from where eta is small already and the velocity error is not
    ContactProblem<Spheres> problem = next_problem(scenes::settled(scenes::heap<Spheres>(false), 100));
    REQUIRE(nlgs(problem, {.tolerance = 1e-8, .max_iterations = 200000}).penetration > 0);
    const NewtonOptions options{.tolerance = 1e-7, .bounds = {.max_velocity_error = 1e-11}, .warm_sweeps = 0};
    for (const bool known : {true, false}) {
        CAPTURE(known);
        auto solved = problem;
        if (!known) solved.least_radius = 0;
        const NewtonReport report = newton_solve(solved, options);
        CHECK(report.converged);
        CHECK(report.iterations > 0);
    }
}

TEST_CASE("a velocity that is not a number is an error", "[newton]") {
    ContactProblem<Spheres> problem = next_problem(scenes::settled(scenes::heap<Spheres>(false), 100));
    problem.bodies[7].v[1] = std::nan("");
    CHECK_THROWS_AS(newton_solve(problem, precise), std::invalid_argument);
}
