// Hard cases with exact answers (method, section 6), by NLGS, by NSCDD and by Newton.
#include "random_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

constexpr Solver solvers[] = {
    {Scheme::nlgs, 1}, {Scheme::ccs, 2}, {Scheme::dcs, 3}, {Scheme::dcs, 4}, {Scheme::newton, 1}};
constexpr double g = 9.81, radius = 0.5;

// A floor at height 0; height is along the last axis.
template <class M>
SimulationSettings<M> on_floor(double friction, double restitution, double h) {
    SimulationSettings<M> settings;
    settings.walls.resize(1);
    settings.walls[0].normal = M::Vec::Unit(M::dim - 1);
    settings.materials.set(0, 0, {friction, restitution});
    settings.h = h;
    return settings;
}

template <class M>
Grain<M> ball(int id, double height, double mass = 1) {
    auto grain = make_grain<M>(id, radius, 1.0, height * M::Vec::Unit(M::dim - 1));
    grain.inertia *= mass / grain.mass;
    grain.mass = mass;
    return grain;
}

// 7/2 for a sphere, 3 for a disk: W_t / W_n of a contact with a wall.
template <class M>
constexpr double tangential_ratio = M::dim == 3 ? 3.5 : 3.0;

// Velocity of the lowest point along the floor.
template <class M>
typename M::Vec slip(const Grain<M>& grain) {
    typename M::Vec v = grain.velocity.template head<M::dim>();
    v[M::dim - 1] = 0;
    if constexpr (M::dim == 2) {
        v[0] += radius * grain.velocity[2];
    } else {
        v[0] -= radius * grain.velocity[4];
        v[1] += radius * grain.velocity[3];
    }
    return v;
}

}  // namespace

TEMPLATE_TEST_CASE("column of N under its weight: contact k carries (N-k) m g h", "[analytic]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    const int n = GENERATE(3, 10);
    auto settings = on_floor<M>(M::friction ? 0.3 : 0, 0, 0.01);
    settings.gravity[M::dim - 1] = -g;
    std::vector<Grain<M>> grains;
    for (int k = 0; k < n; ++k) grains.push_back(ball<M>(k, radius + k));
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", N = " << n);
        Run<M> run(solver, settings, grains);
        run.step();
        const auto contacts = gather_contacts(run.simulation);
        REQUIRE(static_cast<int>(contacts.size()) == n);
        for (const auto& c : contacts) {
            const int k = c.j < 0 ? 0 : c.j;  // contact k is below ball k; it lies between balls k-1 and k
            CHECK(c.impulse.norm() == Approx((n - k) * g * settings.h).epsilon(1e-7));
            CHECK(std::abs(c.impulse[M::dim - 1]) == Approx(c.impulse.norm()));
        }
    }
}

TEST_CASE("a mass upon another: impulses of their weights, whichever is on top", "[analytic][long]") {
    using M = SmoothSpheres;
    const double ratio = GENERATE(1.0, 1e2, 1e4);
    const bool heavy_on_top = GENERATE(false, true);
    auto settings = on_floor<M>(0, 0, 0.01);
    settings.gravity[2] = -g;
    const double below = heavy_on_top ? 1 : ratio, above = heavy_on_top ? ratio : 1;
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", " << above << " on " << below);
        Run<M> run(solver, settings, {ball<M>(0, radius, below), ball<M>(1, radius + 1, above)});
        run.options.max_iterations = 2000000;  // a column that is cut at a grain takes four times those of NLGS
        run.step();
        for (const auto& c : gather_contacts(run.simulation))
            CHECK(c.impulse.norm() == Approx((c.j < 0 ? above + below : above) * g * settings.h).epsilon(1e-5));
    }
}

TEMPLATE_TEST_CASE("from sliding to rolling", "[analytic]", FrictionDisks, FrictionSpheres) {
    using M = TestType;
    constexpr double mu = 0.3, v0 = 1, end = 0.2, ratio = tangential_ratio<M>;
    const double h = GENERATE(2e-3, 1e-3);
    auto settings = on_floor<M>(mu, 0, h);
    settings.gravity[M::dim - 1] = -g;
    auto grain = ball<M>(0, radius);
    grain.velocity[0] = v0;
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", h = " << h);
        Run<M> run(solver, settings, {grain});
        double rolls_since = 0;
        for (double t = 0; t < end - 0.5 * h; t += h) {
            run.step();
            if (slip<M>(run.grains()[0]).norm() > 1e-9) rolls_since = t + h;
        }
        const Grain<M> now = run.grains()[0];
        const double rolling = v0 * (1 - 1 / ratio),
                     starts = v0 / (ratio * mu * g);  // 5/7 v0 and 2 v0/(7 mu g) of a sphere
        CHECK(now.velocity[0] == Approx(rolling).epsilon(1e-9));
        CHECK(std::abs(rolls_since - starts) <= h);
        const double slides_for = v0 * starts - 0.5 * mu * g * starts * starts;  // 12 v0^2/(49 mu g) of a sphere
        CHECK(std::abs(now.position[0] - slides_for - rolling * (end - starts)) <= 0.2 * v0 * h);
    }
}

TEMPLATE_TEST_CASE("lands, then rolls at 5/7 or 2/3 of its speed, or slides as the impulses say", "[analytic]",
                   FrictionDisks, FrictionSpheres) {
    using M = TestType;
    constexpr double v0 = 2, ratio = tangential_ratio<M>;
    const double h = GENERATE(0.02, 0.004), e = GENERATE(0.0, 0.5), mu = GENERATE(0.02, 0.5, 5.0);
    auto settings = on_floor<M>(mu, e, h);
    settings.gravity[M::dim - 1] = -g;
    settings.largest_overlap = 0.5;  // with restitution it acts once it is in the floor, by a step's way
    auto grain = ball<M>(0, radius + 0.339);
    grain.velocity[0] = v0;
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", h = " << h << ", e = " << e << ", mu = " << mu);
        Run<M> run(solver, settings, {grain});
        const int steps = static_cast<int>(std::round(0.8 / h));
        for (int step = 0; step < steps; ++step) run.step();
        const Grain<M> now = run.grains()[0];
        const double pressed = now.velocity[M::dim - 1] + g * steps * h;  // all normal impulses over the mass
        const double slides = mu > 0.1 ? v0 / ratio : mu * pressed;
        CHECK(now.velocity[0] == Approx(v0 - slides).epsilon(1e-8));
        CHECK(slip<M>(now)[0] == Approx(v0 - ratio * slides).epsilon(1e-8).margin(1e-8));
    }
}

TEMPLATE_TEST_CASE("rolls down an incline up to tan = 7 mu/2 or 3 mu, then slides", "[analytic]", FrictionDisks,
                   FrictionSpheres) {
    using M = TestType;
    constexpr double mu = 0.2, ratio = tangential_ratio<M>;
    const double steepness = GENERATE(0.5, 0.99, 1.01, 2.0);  // of the threshold
    const double angle = std::atan(steepness * ratio * mu), down = g * std::sin(angle), into = g * std::cos(angle);
    auto settings = on_floor<M>(mu, 0, 1e-3);
    settings.gravity[0] = down;
    settings.gravity[M::dim - 1] = -into;
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", steepness " << steepness);
        Run<M> run(solver, settings, {ball<M>(0, radius)});
        for (int step = 0; step < 20; ++step) run.step();
        const double time = 20 * settings.h, skid = slip<M>(run.grains()[0])[0];
        const double v = run.grains()[0].velocity[0];
        if (steepness < 1) {
            CHECK(std::abs(skid) <= 1e-9);
            CHECK(v == Approx((1 - 1 / ratio) * down * time).epsilon(1e-7));  // 5/7 or 2/3 of g sin
        } else {
            CHECK(skid == Approx((down - ratio * mu * into) * time).epsilon(1e-6));
            CHECK(v == Approx((down - mu * into) * time).epsilon(1e-7));
        }
    }
}

TEMPLATE_TEST_CASE("oblique impact sticks up to |u_t| = 7/2 or 3 mu (1+e)|u_n|, then slides", "[analytic]",
                   FrictionDisks, FrictionSpheres) {
    using M = TestType;
    constexpr double mu = 0.25, ratio = tangential_ratio<M>, un = 1.5;
    const double e = GENERATE(0.0, 0.5), share = GENERATE(0.3, 0.99, 1.01, 3.0);  // of the threshold
    const double limit = mu * (1 + e) * un, ut = share * ratio * limit;
    const auto settings = on_floor<M>(mu, e, 0.01);
    auto grain = ball<M>(0, radius - 1e-13 + 0.5 * settings.h * un);  // touches at the detection
    typename M::Vec along = M::Vec::Zero();
    along[0] = 1;
    if constexpr (M::dim == 3) along[0] = 0.6, along[1] = 0.8;
    grain.velocity.template head<M::dim>() = 1.25 * ut * along;
    grain.velocity[M::dim - 1] = -un;
    const double spin = -0.25 * ut / radius;  // part of u_t is spin
    if constexpr (M::dim == 2)
        grain.velocity[2] = spin;
    else
        grain.velocity[3] = spin * along[1], grain.velocity[4] = -spin * along[0];
    REQUIRE((slip<M>(grain) - ut * along).norm() < 1e-14);
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", e = " << e << ", u_t " << share << " of the threshold");
        Run<M> run(solver, settings, {grain});
        run.step();
        const Grain<M> now = run.grains()[0];
        CHECK(now.velocity[M::dim - 1] == Approx(e * un).epsilon(1e-9).margin(1e-9));
        const typename M::Vec change = (now.velocity - grain.velocity).template head<M::dim>();
        CHECK(-change.dot(along) == Approx(share < 1 ? ut / ratio : limit).epsilon(1e-9));
        CHECK((slip<M>(now) - std::max(0.0, ut - ratio * limit) * along).norm() <= 1e-10);
    }
}

TEMPLATE_TEST_CASE("two unlike bodies rebound by Newton's law", "[analytic]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const double e = GENERATE(0.0, 0.4, 1.0);
    SimulationSettings<M> settings;
    settings.materials.set(0, 0, {0.0, e});
    settings.h = 0.125;
    auto a = ball<M>(0, 0, 1), b = ball<M>(1, 1, 5);
    a.velocity[M::dim - 1] = 2, b.velocity[M::dim - 1] = -1;
    a.position[M::dim - 1] -= 0.5 * settings.h * 2, b.position[M::dim - 1] += 0.5 * settings.h * 1;
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", e = " << e);
        Run<M> run(solver, settings, {a, b});
        run.step();
        const double common = (1 * 2 - 5 * 1) / 6.0;
        CHECK(run.grains()[0].velocity[M::dim - 1] == Approx(common - e * 3 * 5 / 6).epsilon(1e-9));
        CHECK(run.grains()[1].velocity[M::dim - 1] == Approx(common + e * 3 * 1 / 6).epsilon(1e-9).margin(1e-9));
    }
}

TEMPLATE_TEST_CASE("cradle of five by the simultaneous Newton law", "[analytic]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    constexpr int n = 5;
    const double e = GENERATE(0.25, 1.0);
    SimulationSettings<M> settings;
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0, e});
    settings.h = 0.125;  // places are exact numbers, so that all touch at the detection
    std::vector<Grain<M>> grains;
    for (int k = 0; k < n; ++k) grains.push_back(ball<M>((k + 2) % n, k));
    grains[0].velocity[M::dim - 1] = 1;
    grains[0].position[M::dim - 1] -= 0.5 * settings.h;
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", e = " << e);
        Run<M> run(solver, settings, grains);
        run.step();
        for (const auto& grain : run.grains())
            CHECK(grain.velocity[M::dim - 1] ==
                  Approx(grain.id == 2 ? 1 - (1 + e) * (n - 1) / n : (1 + e) / n).epsilon(0).margin(1e-8));
    }
}

TEST_CASE("a bouncing ball comes to rest after sqrt(2 h0/g)(1+e)/(1-e)", "[analytic][long]") {
    using M = SmoothDisks;
    constexpr double e = 0.5, height = 1;
    const double expected = std::sqrt(2 * height / g) * (1 + e) / (1 - e);
    const double h = GENERATE(2e-3, 5e-4);
    auto settings = on_floor<M>(0, e, h);
    settings.gravity[1] = -g;
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", h = " << h);
        Run<M> run(solver, settings, {ball<M>(0, radius + height)});
        double moves_until = 0, rebound = 0;
        for (int step = 1; step * h < 1.2 * expected; ++step) {
            run.step();
            const Grain<M> now = run.grains()[0];
            rebound = std::max(rebound, now.velocity[1]);
            if (std::abs(now.velocity[1]) > 2 * g * h) moves_until = step * h;
        }
        CHECK(rebound == Approx(e * std::sqrt(2 * g * height)).epsilon(0).margin(g * h));
        CHECK(std::abs(moves_until - expected) <= 20 * h);  // the last rebounds, of a few g h, are lost
        CHECK(std::abs(run.grains()[0].velocity[1]) <= 1e-9);
    }
}
