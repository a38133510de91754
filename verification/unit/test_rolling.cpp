// The law with rolling and twisting resistance: exact answers, the law at every contact of an answer, all schemes
// beside NLGS, and the fast sweep beside the plain one.
#include <cmath>

#include "random_scenes.hpp"
#include "scratch.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

using Disks = Model<2, Rolling>;
using Spheres = Model<3, Rolling>;

const double radius = 0.5, gravity = 10, time_step = 1e-3, mu_r = 0.02, mu_tw = 0.03;  // [m], [m/s^2], [s], [m], [m]

const SolveOptions tight{
    .tolerance = 1e-12, .bounds = {.max_velocity_error = 1e-11, .max_energy_gain = 1e-10}, .max_iterations = 200000};

template <class M>
SimulationSettings<M> in_space(double friction) {
    SimulationSettings<M> settings;
    settings.h = time_step;
    settings.materials.set(0, 0, {.friction = friction, .rolling = mu_r, .twisting = mu_tw});
    return settings;
}
// The floor of a slope of this tangent.
template <class M>
SimulationSettings<M> on_slope(double slope) {
    auto settings = in_space<M>(0.8);
    settings.gravity = gravity / std::hypot(1, slope) * (slope * M::Vec::Unit(0) - M::Vec::Unit(M::dim - 1));
    settings.walls.emplace_back().normal = M::Vec::Unit(M::dim - 1);
    return settings;
}
template <class M>
Grain<M> ball(int id = 0, const typename M::Vec& at = radius * M::Vec::Unit(M::dim - 1)) {
    return make_grain<M>(id, radius, 1000, at);
}

template <class M>
AnyStepSolver<M> solver(int ranks, const SolveOptions& options = tight, bool centralised = false) {
    return ranks == 1 ? by_nlgs<M>(options) : centralised ? by_nscdd<Ccs<M>>(options) : by_nscdd<Dcs<M>>(options);
}

// One grain after some steps by NLGS, accelerated or not.
template <class M>
Grain<M> after(int steps, const SimulationSettings<M>& settings, const Grain<M>& grain, bool accelerated = false) {
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, std::vector{grain});
    for (int step = 0; step < steps; ++step) {
        const StepReport report = simulation.step(by_nlgs<M>(accelerated ? tight.accelerated() : tight));
        CHECK(report.solve.converged);
        CHECK(std::abs(report.energy.round_off()) < 1e-12 * (1 + report.energy.before));
        CHECK(report.energy.friction < 1e-12);
    }
    return gather_grains(simulation)[0].grain;
}

}  // namespace

TEMPLATE_TEST_CASE("a ball on a slope begins to roll at mu_r/R, with the exact acceleration", "[law]", Disks, Spheres) {
    using M = TestType;
    const bool accelerated = GENERATE(false, true);
    const Grain<M> grain = ball<M>();
    CHECK(after<M>(20, on_slope<M>(0.99 * mu_r / radius), grain, accelerated).velocity.norm() < 1e-10);
    const double slope = 1.01 * mu_r / radius;
    const Grain<M> rolls = after<M>(20, on_slope<M>(slope), grain, accelerated);
    const double share = grain.inertia / (grain.mass * radius * radius);
    const double expected = gravity / std::hypot(1, slope) * (slope - mu_r / radius) / (1 + share) * 20 * time_step;
    CHECK(rolls.velocity[0] == Approx(expected).epsilon(1e-7));
    CHECK(std::abs(rolls.velocity[M::dim == 3 ? 4 : 2]) == Approx(expected / radius).epsilon(1e-7));
}

TEMPLATE_TEST_CASE("a ball that rolls comes to rest in the exact time", "[law]", Disks, Spheres) {
    using M = TestType;
    Grain<M> grain = ball<M>();
    const double share = grain.inertia / (grain.mass * radius * radius);
    const double slows = mu_r / radius * gravity / (1 + share), speed = 10.5 * time_step * slows;
    grain.velocity[0] = speed;
    grain.velocity[M::dim == 3 ? 4 : 2] = (M::dim == 3 ? 1 : -1) * speed / radius;
    CHECK(after<M>(10, on_slope<M>(0), grain).velocity[0] == Approx(0.5 * time_step * slows).epsilon(1e-7));
    CHECK(after<M>(11, on_slope<M>(0), grain).velocity.norm() < 1e-11);
}

TEST_CASE("a sphere that spins about the normal comes to rest in the exact time", "[law]") {
    Grain<Spheres> grain = ball<Spheres>();
    const double slows = mu_tw * grain.mass * gravity / grain.inertia;
    grain.velocity[5] = 10.5 * time_step * slows;
    CHECK(after(10, on_slope<Spheres>(0), grain).velocity[5] == Approx(0.5 * time_step * slows).epsilon(1e-9));
    CHECK(after(11, on_slope<Spheres>(0), grain).velocity.norm() < 1e-11);
}

TEST_CASE("a turntable spins up a sphere on its axis by twisting, in the exact time", "[law]") {
    using M = Spheres;
    auto settings = in_space<M>(0.5);
    settings.gravity = {0, 0, -gravity};
    using F = Facet<M>;
    settings.obstacles.push_back(
        {.surface = make_surface<M>(std::vector<F>{{M::Vec(-5, -5, 0), M::Vec(5, -5, 0), M::Vec(5, 5, 0)},
                                                   {M::Vec(-5, -5, 0), M::Vec(5, 5, 0), M::Vec(-5, 5, 0)}})});
    settings.obstacles[0].turn.rate = 2;
    const Grain<M> sphere = ball<M>();
    const double gained = mu_tw * sphere.mass * gravity / sphere.inertia * time_step;  // in a step
    const int whole = static_cast<int>(2 / gained);
    const bool accelerated = GENERATE(false, true);
    CHECK(after(whole, settings, sphere, accelerated).velocity[5] == Approx(whole * gained));
    CHECK(after(whole + 2, settings, sphere, accelerated).velocity[5] == Approx(2));
}

TEST_CASE("a couple passes along a chain of spheres, whatever cuts it", "[law]") {
    const int ranks = GENERATE(1, 2, 3);
    const bool centralised = GENERATE(false, true), accelerated = GENERATE(false, true);
    CAPTURE(ranks, centralised, accelerated);
    const double push = 100;  // [N]
    std::vector<Grain<Spheres>> grains;
    for (int k = 0; k < 3; ++k) grains.push_back(ball<Spheres>(k, {2 * radius * k, 0, 0}));
    grains[0].load[0] = push, grains[2].load[0] = -push;
    grains[0].velocity[3] = 10;  // about the line of centres
    InProcess comm(ranks);
    Simulation<Spheres> simulation(comm, in_space<Spheres>(0.3), grains);
    const StepReport report =
        simulation.step(solver<Spheres>(ranks, accelerated ? tight.accelerated() : tight, centralised));
    CHECK(report.solve.converged);
    CHECK((report.interface_grains > 0) == (ranks > 1));
    const double change = mu_tw * push * time_step / grains[0].inertia;  // the others turn as one
    const auto found = gather_grains(simulation);
    CHECK(found[0].grain.velocity[3] == Approx(10 - change).epsilon(1e-10));
    for (const std::size_t k : {1, 2}) CHECK(found[k].grain.velocity[3] == Approx(0.5 * change).epsilon(1e-8));
    CHECK(gather_contacts(simulation)[0].couple[0] == Approx(-mu_tw * push * time_step).epsilon(1e-9));
}

TEMPLATE_TEST_CASE("couples satisfy the law at every contact of a heap, by every scheme", "[law]", Disks, Spheres) {
    using M = TestType;
    const double friction = 0.3;
    Random random(17);
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 40; ++k) {  // of several sizes, so that friction and couples act on one another
        typename M::Vec at = 1.1 * radius * M::Vec::Ones();
        at[0] += 2.2 * radius * (k % 4), at[1] += 2.2 * radius * (k / 4 % (M::dim == 3 ? 4 : 10));
        if constexpr (M::dim == 3) at[2] += 2.2 * radius * (k / 16);
        grains.push_back(make_grain<M>(k, uniform(random, 0.6, 1.0) * radius, 1000, at));
        grains.back().velocity = random_vector<typename M::Velocity>(random, 1.0);
    }
    const auto solved = [&](int ranks, const AnyStepSolver<M>& solve, int steps) {
        InProcess comm(ranks);
        auto settings = in_space<M>(friction);
        settings.h = 0.02;
        for (int d = 0; d < M::dim; ++d) {
            settings.walls.emplace_back().normal = M::Vec::Unit(d);
            settings.gravity[d] = -gravity / (1 + d);
        }
        Simulation<M> simulation(comm, settings, grains);
        for (int step = 0; step < steps; ++step) {
            const StepReport report = simulation.step(solve);
            CHECK(report.solve.converged);
            CHECK(std::abs(report.energy.round_off()) < 1e-10 * report.energy.before);
        }
        return std::pair(gather_grains(simulation), gather_contacts(simulation));
    };
    constexpr int few = 12;
    const SolveOptions good{.tolerance = 1e-9, .bounds = {.max_velocity_error = 1e-8}, .max_iterations = 200000};
    const auto [expected, contacts] = solved(1, by_nlgs<M>(good), few);
    int held = 0, rolling = 0;
    for (const auto& c : contacts) {
        const auto spin_of = [&](int g) -> typename M::Spin {
            if (g < 0) return M::Spin::Zero();
            return expected[static_cast<std::size_t>(g)].grain.velocity.template tail<M::spins>();
        };
        const typename M::Spin spin = spin_of(c.i) - spin_of(c.j);
        const auto check = [&](const auto& couple, const auto& slip, double coefficient) {
            const double most = coefficient * c.normal_impulse;
            CHECK(couple.norm() <= most * (1 + 1e-9) + 1e-12);
            if (c.normal_impulse < 1e-3) return;
            const bool slides = slip.norm() > 1e-4;
            ++(slides ? rolling : held);
            if (slides) CHECK((couple + most / slip.norm() * slip).norm() < 1e-3 * most);
        };
        if constexpr (M::dim == 3) {
            const typename M::Vec twist = c.couple.dot(c.normal) * c.normal, twists = spin.dot(c.normal) * c.normal;
            check(typename M::Vec(c.couple - twist), typename M::Vec(spin - twists), mu_r);
            check(twist, twists, mu_tw);
        } else {
            check(c.couple, spin, mu_r);
        }
    }
    CHECK(held + rolling > 15);
    CHECK(rolling > 5);
    for (const bool centralised : {false, true}) {
        const auto one = solved(1, by_nlgs<M>(good), 3).first;
        const auto found = solved(3, solver<M>(3, good.accelerated(), centralised), 3).first;
        double difference = 0, all = 0;
        for (std::size_t g = 0; g < found.size(); ++g) {
            difference += (found[g].grain.velocity - one[g].grain.velocity).squaredNorm();
            all += one[g].grain.velocity.squaredNorm();
        }
        CHECK(std::sqrt(difference / all) < 0.03);
    }
}

TEMPLATE_TEST_CASE("the fast sweep and its residual are those of contacts one by one", "[law]", Disks, Spheres) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    Random random(23);
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 60; ++k) {
        typename M::Vec at = radius * M::Vec::Ones();
        at[0] += 2 * radius * (k % 4), at[1] += 2 * radius * (k / 4 % (M::dim == 3 ? 4 : 15));
        if constexpr (M::dim == 3) at[2] += 2 * radius * (k / 16);
        grains.push_back(make_grain<M>(k, radius * uniform(random, 0.97, 1.0), 1000, at));
    }
    InProcess comm(1);
    auto settings = in_space<M>(0.3);
    settings.gravity[M::dim - 1] = -gravity;
    auto& floor = settings.walls.emplace_back();
    floor.normal = M::Vec::Unit(M::dim - 1);
    floor.driven = driven, floor.mass = driven ? 5000 : 0;
    settings.h = 0.05;
    Simulation<M> simulation(comm, settings, grains);
    REQUIRE(simulation.step(by_nlgs<M>(SolveOptions{})).contacts > 60);
    ContactProblem<M> fast = simulation.parts()[0].problem;
    for (auto& body : fast.bodies) body.v += random_vector<typename M::Velocity>(random, 0.3);
    fast.walls[0].spin.value = random_vector<typename M::Spin>(random, 0.3);

    Sweeper<M> sweeper;
    sweeper.load(fast, 0.9);
    REQUIRE(sweeper.batched());
    ContactProblem<M> plain = fast;
    const auto sort = [](std::vector<Contact<M>>& contacts, const std::vector<int>& order) {
        std::vector<Contact<M>> sorted;
        for (const int c : order)
            if (c >= 0) sorted.push_back(contacts[static_cast<std::size_t>(c)]);
        contacts = sorted;
    };
    sort(plain.contacts, sweeper.order());
    sort(plain.wall_contacts, sweeper.wall_order());
    prepare_contacts(plain, 0.9);
    const auto free = detail::free_velocities(plain);
    for (int sweeps = 0; sweeps < 3; ++sweeps) {
        sweeper.sweep(fast);
        sweep(plain);
    }
    const ResidualParts parts = sweeper.residual(fast), expected = residual_parts(plain, free);
    sweeper.store(fast);
    for (std::size_t b = 0; b < fast.bodies.size(); ++b)
        CHECK((fast.bodies[b].v - plain.bodies[b].v).norm() < 1e-11 * plain.bodies[b].v.norm());
    CHECK(parts.change == Approx(expected.change).epsilon(1e-9));
    CHECK(parts.energy == Approx(expected.energy).epsilon(1e-9));
    CHECK(parts.next_energy == Approx(expected.next_energy).epsilon(1e-9));
    CHECK(parts.work == Approx(expected.work).epsilon(1e-9));
    CHECK(parts.made == Approx(expected.made).epsilon(1e-9));
    CHECK(parts.miss == Approx(expected.miss).epsilon(1e-9));
    CHECK(parts.velocity_change.energy == Approx(expected.velocity_change.energy).epsilon(1e-9));
}

TEMPLATE_TEST_CASE("the block of a contact says what impulse and couple do", "[law]", Disks, Spheres) {
    using M = TestType;
    Random random(3);
    ContactProblem<M> problem;
    for (int b = 0; b < 2; ++b) {
        auto& body = problem.bodies.emplace_back();
        body.inv_mass = uniform(random, 0.5, 2), body.inv_inertia = uniform(random, 0.5, 4);
    }
    problem.walls.emplace_back();
    Contact<M> c;
    c.i = 0, c.normal = random_unit<M>(random), c.lever_i = 0.7;
    const auto check = [&](auto kind) {
        const detail::DelassusDiagonal w = detail::delassus(problem, c, true, kind);
        const auto before = relative_velocity(problem, c, kind);
        const auto dr = random_vector<typename M::Impulse>(random);
        apply_impulse(problem, c, dr, kind);
        const typename M::Impulse change = relative_velocity(problem, c, kind) - before;
        const typename M::Vec force = detail::force_of<M>(dr), normal = force.dot(c.normal) * c.normal;
        const typename M::Spin couple = detail::couple_of<M>(dr);
        const typename M::Vec expected =
            w.normal * normal + w.tangential * (force - normal) - w.coupling * detail::spin_cross<M>(couple, c.normal);
        CHECK((detail::force_of<M>(change) - expected).norm() < 1e-14);
        CHECK((detail::couple_of<M>(change) - w.spin * couple + w.coupling * detail::arm_cross<M>(c.normal, force))
                  .norm() < 1e-14);
        CHECK(w.coupling * w.coupling < w.tangential * w.spin);
    };
    c.j = 0;
    check(WithWall{});
    c.j = 1, c.lever_j = 0.4;
    check(BetweenGrains{});
}

TEST_CASE("coefficients of rolling and twisting are not negative", "[law]") {
    Materials<Model<3, Rolling>> table;
    const auto refused = [&](const Rolling::Pairing& pairing) {
        return complaint<std::invalid_argument>([&] { table.set(0, 0, pairing); });
    };
    CHECK(refused({.rolling = -1}) == "rolling must be >= 0 and finite");
    CHECK(refused({.twisting = NAN}) == "twisting must be >= 0 and finite");
    CHECK(refused({.friction = 1, .restitution = 0.5, .rolling = 1, .twisting = 1}) == "");
}
