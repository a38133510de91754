// The proximal Newton method: its derivatives, exact answers out of NLGS's reach, agreement with NLGS, problems with a
// stored W, and an end where there is no answer. test_analytic.cpp has it on the hard cases that NLGS solves too.
#include "../small_scenes.hpp"
#include "random_scenes.hpp"

using namespace nscdd;
using nscdd::test::Random;
using nscdd::test::random_unit;
using nscdd::test::random_vector;
using nscdd::test::uniform;
using scenes::Disks;
using scenes::DisksDriven;
using scenes::SmoothDisks;
using scenes::SmoothDisksDriven;
using scenes::SmoothSpheres;
using scenes::SmoothSpheresDriven;
using scenes::Spheres;
using scenes::SpheresDriven;

namespace {

constexpr NewtonOptions from_zero{.tolerance = 1e-10, .warm_sweeps = 0};

// The problem of the scene's next step, without impulses: bodies have V_free.
template <class M>
ContactProblem<M> next_problem(const scenes::Scene<M>& scene) {
    InProcess comm(1);
    Simulation<M> simulation(comm, scene.settings, scene.grains);
    ContactProblem<M> problem;
    simulation.step([&](std::vector<Subdomain<M>>& parts, Communicator&, PhaseSeconds&) {
        problem = parts[0].problem;
        return nlgs(parts[0].problem, {});
    });
    return problem;
}

// Kinetic energy of the difference over that of the second.
template <class M>
double velocity_difference(const ContactProblem<M>& a, const ContactProblem<M>& b) {
    double difference = 0, total = 0;
    for (std::size_t k = 0; k < a.bodies.size(); ++k) {
        typename M::Velocity mass = M::Velocity::Constant(1 / a.bodies[k].inv_mass);
        if constexpr (M::friction) mass.template tail<M::spins>().setConstant(1 / a.bodies[k].inv_inertia);
        difference += (a.bodies[k].v - b.bodies[k].v).cwiseAbs2().dot(mass);
        total += b.bodies[k].v.cwiseAbs2().dot(mass);
    }
    return std::sqrt(difference / total);
}

struct Statuses {
    int sliding = 0, sticking = 0, open = 0;
};

// Asserts the law at every contact, within `margin` of the largest |u| and |r|; adds to the count of statuses.
template <int dim>
void check_law(const DelassusProblem<dim>& problem, const std::vector<typename DelassusProblem<dim>::Vec>& r,
               double margin, Statuses& count) {
    double largest_u = 0, largest_r = 0;
    for (std::size_t c = 0; c < r.size(); ++c) {
        largest_u = std::max({largest_u, problem.velocity(c, r).norm(), problem.q[c].norm()});
        largest_r = std::max(largest_r, r[c].norm());
    }
    REQUIRE(largest_r > 0);
    const double eps_u = margin * largest_u, eps_r = margin * largest_r;
    for (std::size_t c = 0; c < r.size(); ++c) {
        const auto u = problem.velocity(c, r);
        const auto ut = u.template tail<dim - 1>().eval(), rt = r[c].template tail<dim - 1>().eval();
        const double limit = problem.friction[c] * r[c][0];
        CHECK(u[0] >= -eps_u);
        CHECK(r[c][0] >= 0);
        CHECK(std::min(u[0] / largest_u, r[c][0] / largest_r) <= margin);
        CHECK(rt.norm() <= limit + eps_r);
        CHECK((ut.norm() * rt + limit * ut).norm() <= std::max(eps_u * largest_r, eps_r * largest_u));
        if (r[c][0] <= eps_r)
            ++count.open;
        else
            ++(ut.norm() > eps_u ? count.sliding : count.sticking);
    }
}

// W = H^T H of rank `rank`, blocks full and not diagonal, with an answer: q = H^T v plus velocities that open.
template <int dim>
DelassusProblem<dim> random_problem(Random& random, int contacts, int rank) {
    Eigen::MatrixXd h(rank, contacts * dim);
    for (double& entry : h.reshaped()) entry = uniform(random, -1, 1);
    Eigen::VectorXd v(rank);
    for (double& entry : v) entry = uniform(random, -1, 1);
    const Eigen::MatrixXd w = h.transpose() * h;
    const Eigen::VectorXd q = h.transpose() * v;
    DelassusProblem<dim> problem;
    for (int c = 0; c < contacts; ++c) {
        problem.diagonal.push_back(static_cast<int>(problem.blocks.size()) + c);
        for (int d = 0; d < contacts; ++d) {
            problem.columns.push_back(d);
            problem.blocks.push_back(w.block<dim, dim>(c * dim, d * dim));
        }
        problem.row_begin.push_back(static_cast<int>(problem.blocks.size()));
        typename DelassusProblem<dim>::Vec free = q.segment<dim>(c * dim);
        free[0] += uniform(random, 0, 0.5);
        problem.q.push_back(free);
        problem.friction.push_back(uniform(random, 0.1, 0.8));
    }
    return problem;
}

template <int size>
void check_derivatives(Random& random) {
    using Vec = typename ProjectedImpulse<size>::Vec;
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
        check(project_coulomb<size>);
        check(project_cone<size>);
    }
}

}  // namespace

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
        const NewtonReport report = proximal_newton(problem, from_zero);
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
        const NewtonReport report = proximal_newton(problem, r, {.tolerance = 1e-12});
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
    const NewtonReport report = proximal_newton(problem, r, {}, [&](const auto&) { return ++calls < 4 ? 1.0 : 0.0; });
    CHECK(report.converged);
    CHECK(report.outer == 3);
    CHECK_THROWS_AS(proximal_newton(problem, r, {}, [](const auto&) { return std::nan(""); }), std::runtime_error);
}

TEST_CASE("a contact that nothing can move is refused", "[newton]") {
    Random random(7);
    auto problem = random_problem<2>(random, 5, 8);
    problem.blocks[static_cast<std::size_t>(problem.diagonal[3])].setZero();
    std::vector<DelassusProblem<2>::Vec> r(5, DelassusProblem<2>::Vec::Zero());
    CHECK_THROWS_AS(proximal_newton(problem, r), std::invalid_argument);
}

TEMPLATE_TEST_CASE("walls that leave no room: not converged, within the caps", "[newton]", SmoothDisks, Disks,
                   Spheres) {
    using M = TestType;
    SimulationSettings<M> settings;
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    for (const double sign : {1.0, -1.0}) {
        Wall<M>& wall = settings.walls.emplace_back();
        wall.normal = sign * M::Vec::Unit(0);
        wall.offset = -0.5;
        wall.velocity = wall.normal;
    }
    const std::vector<Grain<M>> grains{make_grain<M>(0, 0.5, 1.0, M::Vec::Zero())};
    const NewtonOptions options{.penetration = 1e-6, .max_iterations = 200, .max_outer = 50, .warm_sweeps = 0};
    NewtonReport report;
    InProcess comm(1);
    Simulation<M>(comm, settings, grains).step([&](std::vector<Subdomain<M>>& parts, Communicator&, PhaseSeconds&) {
        report = proximal_newton(parts[0].problem, options);
        return report;
    });
    INFO("eta " << report.residual << ", penetration " << report.penetration);
    CHECK_FALSE(report.converged);
    CHECK(report.iterations <= options.max_iterations);
    CHECK(report.outer <= options.max_outer);
    CHECK(std::isfinite(report.residual));
}

TEST_CASE("a velocity that is not a number is an error", "[newton]") {
    ContactProblem<Spheres> problem = next_problem(scenes::settled(scenes::heap<Spheres>(), 100));
    problem.bodies[7].v[1] = std::nan("");
    CHECK_THROWS_AS(proximal_newton(problem, from_zero), std::runtime_error);
}
