// Detection: nothing is missed however fast it flies, restitution acts on touch, and bad input is named.
#include <limits>

#include "random_scenes.hpp"
#include "scratch.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

constexpr Solver few_and_many[] = {{Scheme::nlgs, 1}, {Scheme::ccs, 4}, {Scheme::dcs, 4}};

// Deepest overlap of all pairs and walls, `later` after now.
template <class M>
double deepest_overlap(const Run<M>& run, double later) {
    double deepest = 0;
    auto grains = run.grains();
    for (auto& g : grains) g.position += later * g.velocity.template head<M::dim>();
    for (const auto& a : grains) {
        for (const auto& b : grains)
            if (a.id < b.id) deepest = std::max(deepest, a.radius + b.radius - (a.position - b.position).norm());
        for (const auto& wall : run.simulation.walls())
            deepest =
                std::max(deepest, a.radius - (wall.normal.dot(a.position) - wall.offset - later * wall.normal_speed()));
    }
    return deepest;
}

// At the end of the step, and where the next step will look for contacts. Of each step the solver was let off 1e-9 of
// the least radius.
template <class M>
void check_overlaps(const Run<M>& run) {
    const double allowed = 1e-7 * run.simulation.least_radius(), h = run.simulation.settings().h;
    CHECK(deepest_overlap(run, 0) <= allowed);
    CHECK(deepest_overlap(run, (1 - run.simulation.settings().theta) * h) <= allowed);
}

template <class M>
SimulationSettings<M> without_restitution(double h) {
    SimulationSettings<M> settings;
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    settings.h = h;
    return settings;
}

}  // namespace

TEMPLATE_TEST_CASE("a bullet that flies 50 of its radii a step does not tunnel", "[detection][long]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    auto settings = without_restitution<M>(0.1);
    settings.walls = box_walls<M>(30);
    std::vector<Grain<M>> grains;  // the bullet, then a row of six, one of them nearly touching the next
    for (const double x : {1.0, 12.0, 14.0, 15.001, 17.0, 20.0, 23.0}) {
        typename M::Vec position = M::Vec::Constant(15);
        position[0] = x;
        grains.push_back(make_grain<M>(static_cast<int>(grains.size()), grains.empty() ? 0.1 : 0.5, 1.0, position));
    }
    grains[0].mass *= 1000;  // it would go through
    grains[0].velocity[0] = 50;
    for (const Solver& solver : few_and_many) {
        INFO(solver.name());
        Run<M> run(solver, settings, grains);
        run.options.tolerance = 1e-4;  // it is the overlaps that count here
        for (int step = 0; step < 10; ++step) {
            run.step();
            INFO("step " << step);
            check_overlaps(run);
            const auto now = run.grains();
            for (std::size_t k = 0; k + 1 < now.size(); ++k) CHECK(now[k].position[0] < now[k + 1].position[0]);
        }
        CHECK(run.grains()[6].position[0] > 29.4);  // shoved against the far wall
    }
}

TEMPLATE_TEST_CASE("no wall is passed, however fast and oblique the shot", "[detection]", SmoothDisks, FrictionDisks,
                   SmoothSpheres) {
    using M = TestType;
    Random random(16);
    for (int shot = 0; shot < 20; ++shot) {
        auto settings = without_restitution<M>(0.1);
        settings.walls = box_walls<M>(100);
        auto grain = make_grain<M>(0, 0.1, 1.0, M::Vec::Constant(50));
        grain.velocity.template head<M::dim>() = uniform(random, 1, 300) * random_unit<M>(random);
        for (const Solver& solver : few_and_many) {
            INFO(solver.name() << ", shot " << shot);
            Run<M> run(solver, settings, {grain});
            for (int step = 0; step < 12; ++step) run.step();
            check_overlaps(run);
        }
    }
}

TEMPLATE_TEST_CASE("in a fast gas no two of all pairs overlap", "[detection][long]", SmoothDisks, FrictionDisks,
                   FrictionSpheres) {
    using M = TestType;
    for (unsigned seed = 0; seed < 2; ++seed)
        for (const Solver& solver : few_and_many) {
            INFO(solver.name() << ", seed " << seed);
            Random random(seed);
            const double edge = M::dim == 2 ? 11 : 6;
            auto settings = without_restitution<M>(0.1);
            settings.walls = box_walls<M>(edge);
            auto grains = random_grains<M>(random, 40, edge, 0.2, 0.5);
            settings.theta = 1;  // free at the first detection
            for (auto& g : grains) g.velocity = random_vector<typename M::Velocity>(random, 15);  // 1.5 a step
            Run<M> run(solver, settings, grains);
            run.options.tolerance = 1e-4;  // it is the overlaps that count here
            double touched = 0;
            for (int step = 0; step < 6; ++step) {
                touched += run.step().contacts;
                check_overlaps(run);
            }
            CHECK(touched > 40);
        }
}

// Two heavy disks close in on a small one and shoot it out much faster than anything moved before. What it then meets
// was left out by the narrow phase, or even by the broad phase, and a grain lies in the other subdomain, where the copy
// of the small one has no contact and so no part in the iteration.
TEST_CASE("a grain thrown across subdomains within a step is not missed", "[detection][long]") {
    using M = SmoothDisks;
    struct Throw {
        double offset, gap, speed;
    };
    const Throw shot = GENERATE(Throw{0.3, 0.55, 3}, Throw{0.1, 1.5, 10});  // alert: 0.4, skin: 0.88
    const bool at_wall = GENERATE(false, true);
    for (const Solver& solver : {nlgs_alone, Solver{Scheme::ccs, 2}, Solver{Scheme::dcs, 2}}) {
        INFO(solver.name() << ", speed " << shot.speed << (at_wall ? ", at a wall" : ", at a grain"));
        auto settings = without_restitution<M>(0.2);
        settings.partition = by_grid<M>({1, solver.ranks});
        const double apart = std::sqrt(1.2 * 1.2 - shot.offset * shot.offset);  // touching at the first detection
        std::vector<Grain<M>> grains{make_grain<M>(0, 1, 100, {-apart - 0.1, 0}),
                                     make_grain<M>(1, 1, 100, {apart + 0.1, 0}),
                                     make_grain<M>(2, 0.2, 1, {0, shot.offset})};
        grains[0].velocity[0] = 1;
        grains[1].velocity[0] = -1;
        if (at_wall) {
            settings.walls.resize(1);
            settings.walls[0].normal = {0, -1};
            settings.walls[0].offset = -(shot.offset + 0.2 + shot.gap);
        } else {
            grains.push_back(make_grain<M>(3, 0.2, 1, {0, shot.offset + 0.4 + shot.gap}));
        }
        Run<M> run(solver, settings, grains);
        run.step();
        CHECK(run.grains()[2].velocity[1] > (at_wall ? 0.99 * shot.gap / settings.h : shot.speed));
        check_overlaps(run);
    }
}

TEST_CASE("a wall set in motion between two steps pushes what is in its way", "[detection]") {
    using M = SmoothSpheres;
    for (const Solver& solver : few_and_many) {
        INFO(solver.name());
        auto settings = without_restitution<M>(0.1);
        settings.walls.resize(1);
        Run<M> run(solver, settings, {make_grain<M>(0, 0.5, 1, {2.5, 0, 0}), make_grain<M>(1, 0.5, 1, {5, 0, 0})});
        run.options.tolerance = 1e-4;  // of impulses that end as round-off
        run.step();
        run.simulation.walls()[0].velocity[0] = 30;
        for (int step = 0; step < 3; ++step) {
            run.step();
            check_overlaps(run);
        }
        CHECK(run.grains()[1].velocity[0] == Approx(30));
    }
}

TEMPLATE_TEST_CASE("restitution acts once the pair touches, and then gives -e v", "[detection]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    const double e = GENERATE(0.3, 0.7, 1.0);
    const bool wall = GENERATE(false, true);
    INFO("e = " << e << (wall ? ", with a wall" : ", between grains"));
    SimulationSettings<M> settings;
    settings.materials.set(0, 0, {0.0, e});
    settings.h = 0.01;
    typename M::Vec x = M::Vec::Zero();
    std::vector<Grain<M>> grains{make_grain<M>(0, 0.5, 1.0, x)};
    x[0] = -1.018;  // gaps at detection: 0.013, 0.003, -0.007
    if (wall) {
        settings.walls.resize(1);
        settings.walls[0].offset = -0.518;
    } else {
        grains.push_back(make_grain<M>(1, 0.5, 3.0, x));
    }
    grains[0].velocity[0] = -1;
    const auto approach = [&](const Run<M>& run) {
        const auto now = run.grains();
        return now[0].velocity[0] - (wall ? 0 : now[1].velocity[0]);
    };
    for (const Solver& solver : few_and_many) {
        INFO(solver.name());
        Run<M> run(solver, settings, grains);
        for (int step = 0; step < 2; ++step) {
            CHECK(run.step().contacts == 0);  // also in the second, which drives it into the other
            CHECK(approach(run) == -1);
        }
        CHECK(run.step().contacts == 1);
        CHECK(approach(run) == Approx(e).epsilon(1e-12));
        run.step();
        CHECK(approach(run) == Approx(e).epsilon(1e-12));
    }
}

namespace {

// Grains 3 (at the origin) and 7, at rest.
template <class M>
std::vector<Grain<M>> two_grains(double distance) {
    typename M::Vec x = M::Vec::Zero();
    std::vector<Grain<M>> grains{make_grain<M>(3, 0.5, 1.0, x)};
    x[1] = distance;
    grains.push_back(make_grain<M>(7, 0.5, 1.0, x));
    return grains;
}

template <class M, class Error>
std::string complaint_of(const std::vector<Grain<M>>& grains, const SimulationSettings<M>& settings = {.h = 1e-3},
                         int ranks = 1) {
    return complaint<Error>([&] {
        Run<M> run({ranks == 1 ? Scheme::nlgs : Scheme::dcs, ranks}, settings, grains);
        for (int step = 0; step < 3; ++step) run.step();
    });
}

// "" when the text has all these words, else the text.
std::string lacks(const std::string& text, std::initializer_list<const char*> words) {
    for (const char* word : words)
        if (text.find(word) == std::string::npos) return "says: " + text;
    return "";
}

}  // namespace

TEMPLATE_TEST_CASE("an overlap of more than 10 % of a radius is an error that names both", "[detection]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    const auto refused = complaint_of<M, std::runtime_error>;
    for (const int ranks : {1, 4}) {
        CHECK(refused(two_grains<M>(0.951), {.materials = smooth<M>(), .h = 1e-3}, ranks) == "");
        CHECK(lacks(refused(two_grains<M>(0.949), {.materials = smooth<M>(), .h = 1e-3}, ranks),
                    {"grain 3", "grain 7", "11 %"}) == "");
        CHECK(lacks(refused(two_grains<M>(0), {.materials = smooth<M>(), .h = 1e-3}, ranks), {"grain 3", "grain 7"}) ==
              "");
        SimulationSettings<M> settings{.materials = smooth<M>(), .h = 1e-3};
        settings.walls.resize(2);
        settings.walls[0].offset = -5;
        settings.walls[1].offset = -0.44;
        CHECK(lacks(refused({two_grains<M>(2)[0]}, settings, ranks), {"grain 3", "wall 1"}) == "");
    }
}

TEMPLATE_TEST_CASE("a grain that cannot be is refused by name", "[detection]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    const auto refused = complaint_of<M, std::invalid_argument>;
    const auto spoilt = [&](auto&& spoil) {
        auto grains = two_grains<M>(2);
        spoil(grains[1]);
        return refused(grains, {.materials = smooth<M>(), .h = 1e-3}, 1);
    };
    CHECK(spoilt([](Grain<M>&) {}) == "");
    for (const double bad : {0.0, -1.0, nan, inf}) {
        CHECK(lacks(spoilt([&](Grain<M>& g) { g.radius = bad; }), {"grain 7", "radius"}) == "");
        if (bad != inf) CHECK(lacks(spoilt([&](Grain<M>& g) { g.mass = bad; }), {"grain 7", "mass"}) == "");  // fixed
        if (M::friction) CHECK(lacks(spoilt([&](Grain<M>& g) { g.inertia = bad; }), {"grain 7", "inertia"}) == "");
    }
    for (const double bad : {nan, inf}) {
        CHECK(lacks(spoilt([&](Grain<M>& g) { g.position[1] = bad; }), {"grain 7", "position"}) == "");
        CHECK(lacks(spoilt([&](Grain<M>& g) { g.velocity[M::dof - 1] = bad; }), {"grain 7", "velocity"}) == "");
        CHECK(lacks(spoilt([&](Grain<M>& g) { g.load[0] = bad; }), {"grain 7", "load"}) == "");
    }
    CHECK(lacks(spoilt([](Grain<M>& g) { g.material = 1; }), {"grain 7", "material"}) == "");
    CHECK(lacks(spoilt([](Grain<M>& g) { g.material = -1; }), {"grain 7", "material"}) == "");
    CHECK(lacks(spoilt([](Grain<M>& g) { g.id = 3; }), {"grain 3", "two"}) == "");
    CHECK(lacks(spoilt([](Grain<M>& g) { g.id = -1; }), {"grain -1: id"}) == "");
    CHECK(lacks(refused({}, {.materials = smooth<M>(), .h = 1e-3}, 1), {"no grains"}) == "");
}

TEMPLATE_TEST_CASE("settings that cannot be are refused", "[detection]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    const auto spoilt = [&](auto&& spoil) {
        SimulationSettings<M> settings{.materials = smooth<M>(), .h = 1e-3};
        settings.walls.resize(1);
        settings.walls[0].offset = -5;
        spoil(settings);
        return complaint_of<M, std::invalid_argument>(two_grains<M>(2), settings);
    };
    CHECK(spoilt([](auto&) {}) == "");
    for (const double bad : {0.0, -1.0, nan, inf}) CHECK(lacks(spoilt([&](auto& s) { s.h = bad; }), {"step"}) == "");
    CHECK(lacks(spoilt([](auto& s) { s.theta = 1.1; }), {"theta"}) == "");
    for (const double bad : {nan, inf}) {
        CHECK(lacks(spoilt([&](auto& s) { s.gravity[0] = bad; }), {"gravity"}) == "");
        CHECK(lacks(spoilt([&](auto& s) { s.walls[0].normal[1] = bad; }), {"normal"}) == "");
        CHECK(lacks(spoilt([&](auto& s) { s.walls[0].offset = bad; }), {"wall 0"}) == "");
        CHECK(lacks(spoilt([&](auto& s) { s.walls[0].velocity[0] = bad; }), {"wall 0"}) == "");
        CHECK(lacks(spoilt([&](auto& s) { s.walls[0].force = bad; }), {"wall 0"}) == "");
        CHECK(lacks(spoilt([&](auto& s) { s.walls[0].mass = bad; }), {"wall 0"}) == "");
        CHECK(lacks(spoilt([&](auto& s) { s.walls[0].speed = bad; }), {"wall 0"}) == "");
        CHECK_THROWS_AS(Materials<scenes::Disks>(1).set(0, 0, {bad, 0}), std::invalid_argument);
        CHECK_THROWS_AS(Materials<scenes::Disks>(1).set(0, 0, {0, bad}), std::invalid_argument);
    }
    CHECK(lacks(spoilt([&](auto& s) { s.theta = nan; }), {"theta"}) == "");
    CHECK(lacks(spoilt([&](auto& s) { s.largest_overlap = nan; }), {"overlap"}) == "");
    CHECK(lacks(spoilt([](auto& s) { s.walls[0].normal *= 1.1; }), {"normal"}) == "");
    CHECK(lacks(spoilt([](auto& s) { s.walls[0].driven = true; }), {"driven", "mass"}) == "");
    CHECK(lacks(spoilt([](auto& s) { s.walls[0].material = 1; }), {"wall 0", "material"}) == "");
    CHECK(lacks(spoilt([](auto& s) { s.partition = by_grid<M>({2, 2}); }), {"cells"}) == "");
    CHECK(lacks(spoilt([](auto& s) { s.partition.make = nullptr; }), {"partition", "make"}) == "");
    CHECK_THROWS_AS(Materials<scenes::Disks>(1).set(0, 0, {-0.1, 0}), std::invalid_argument);
    CHECK_THROWS_AS(Materials<scenes::Disks>(1).set(0, 0, {0, 1.1}), std::invalid_argument);
}

TEMPLATE_TEST_CASE("impulses to start from must be finite", "[detection]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const auto given = [](double r) {
        return complaint<std::invalid_argument>([&] {
            InProcess comm(1);
            const PairImpulse<M> impulse{3, 7, M::Impulse::Constant(r)};
            Simulation<M>(comm, {.materials = smooth<M>(), .h = 1e-3}, std::span<const Grain<M>>(two_grains<M>(1)),
                          std::span(&impulse, 1));
        });
    };
    CHECK(given(1) == "");
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        CHECK(lacks(given(bad), {"impulse", "grain 3", "finite"}) == "");
}

TEMPLATE_TEST_CASE("numbers that stop being finite stop the run", "[detection]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const int ranks : {1, 3}) {
        INFO("ranks: " << ranks);
        const Solver solver{ranks == 1 ? Scheme::nlgs : Scheme::dcs, ranks};
        CHECK(lacks((complaint<std::invalid_argument>([&] {
                        auto settings = SimulationSettings<M>{.materials = smooth<M>(), .h = 1e-3};
                        settings.walls.resize(1);
                        settings.walls[0].offset = -5;
                        Run<M> run(solver, settings, two_grains<M>(2));
                        run.step();
                        run.simulation.walls()[0].velocity[0] = nan;
                        for (int step = 0; step < 3; ++step) run.step();
                    })),
                    {"wall 0", "finite"}) == "");
        for (const double bad : {nan, std::numeric_limits<double>::infinity()})
            for (const bool touches : {false, true})
                CHECK(lacks((complaint<std::invalid_argument>([&] {
                                auto settings = SimulationSettings<M>{.materials = smooth<M>(), .h = 1e-3};
                                settings.walls.resize(1);
                                settings.walls[0].offset = touches ? -0.5 : -5;
                                settings.walls[0].driven = true;
                                settings.walls[0].mass = 1;
                                Run<M> run(solver, settings, two_grains<M>(2));
                                run.step();
                                run.simulation.walls()[0].force = bad;
                                for (int step = 0; step < 3; ++step) run.step();
                            })),
                            {"wall 0", "finite"}) == "");
        CHECK(lacks((complaint<std::runtime_error>([&] {
                        auto grains = two_grains<M>(2);
                        grains[1].mass = 1e-200;
                        grains[1].load[0] = 1e200;
                        Run<M> run(solver, {.materials = smooth<M>(), .h = 1e-3}, grains);
                        for (int step = 0; step < 3; ++step) run.step();
                    })),
                    {"step", "finite"}) == "");
    }
}

TEMPLATE_TEST_CASE("a contact problem with velocities that are not finite has no answer", "[detection]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    ContactProblem<M> problem;
    Run<M> run(nlgs_alone, {.materials = smooth<M>(), .h = 1e-3}, two_grains<M>(1));
    run.simulation.step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) {
        problem = parts[0].problem;
        return SolveReport{};
    });
    REQUIRE(problem.contacts.size() == 1);
    CHECK(nlgs(problem, {}).converged);
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        ContactProblem<M> spoilt = problem;
        spoilt.bodies[static_cast<std::size_t>(problem.contacts[0].i)].v[1] = bad;
        CHECK(lacks(complaint<std::invalid_argument>([&] { nlgs(spoilt, {}); }), {"velocity", "not finite"}) == "");
    }
}
