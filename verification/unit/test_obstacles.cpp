// Obstacles: facets and cylinders act as the planes and rounds that they are, at rest and in motion.
#include <numbers>

#include "../catch.hpp"
#include "../small_scenes.hpp"
#include "random_scenes.hpp"

using namespace nscdd;

namespace {

constexpr double pi = std::numbers::pi;

template <class M>
SimulationSettings<M> settings_of(double friction, double restitution = 0) {
    SimulationSettings<M> settings;
    settings.h = 1e-3;
    settings.gravity[M::dim - 1] = -10;
    settings.materials.set(0, 0, {friction, restitution});
    return settings;
}

template <class M>
void add(SimulationSettings<M>& settings, std::vector<Facet<M>> facets) {
    settings.obstacles.push_back({.surface = make_surface<M>(std::move(facets))});
}

// Triangles of a flat sheet at height 0, two for each square of a grid of irregular lines; turned about y by an angle.
std::vector<Facet<scenes::Spheres>> sheet(int nx, int ny, double low, double size, double angle = 0) {
    using Vec = scenes::Spheres::Vec;
    std::mt19937 random(5);
    const auto line = [&](int n) {
        std::vector<double> at;
        for (int k = 0; k <= n; ++k) at.push_back(low + size * (k + 0.3 * double(random()) / 4294967296.0) / n);
        return at;
    };
    const std::vector<double> x = line(nx), y = line(ny);
    const auto at = [&](int i, int j) {
        const double along = x[static_cast<std::size_t>(i)];
        return Vec(along * std::cos(angle), y[static_cast<std::size_t>(j)], -along * std::sin(angle));
    };
    std::vector<Facet<scenes::Spheres>> facets;
    for (int i = 0; i < nx; ++i)
        for (int j = 0; j < ny; ++j) {
            facets.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            facets.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
        }
    return facets;
}

// Makes steps, each of which must keep the balance of energy; visit(simulation, grains) after each.
template <class M>
void run(const SimulationSettings<M>& settings, const std::vector<Grain<M>>& grains, int steps, auto&& visit) {
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, grains);
    for (int step = 1; step <= steps; ++step) {
        const StepReport report = simulation.step(by_nlgs<M>({.tolerance = 1e-12}));
        const StepReport::Energy& e = report.energy;
        REQUIRE(std::abs(e.kinetic - e.before - e.external - e.walls - e.normal - e.friction) <
                1e-12 * (1 + e.kinetic));
        std::vector<Grain<M>> now;
        for (const auto& g : gather_grains(simulation)) now.push_back(g.grain);
        visit(simulation, now);
    }
}

}  // namespace

TEST_CASE("a sphere on a slope of triangles is one on a plane", "[obstacle]") {
    using M = scenes::Spheres;
    const double angle = 0.4;
    auto plane = settings_of<M>(0.2), triangles = plane;
    Wall<M>& wall = plane.walls.emplace_back();
    wall.normal = {std::sin(angle), 0, std::cos(angle)};
    add<M>(triangles, sheet(12, 12, -2, 8, angle));
    const std::vector grains{make_grain<M>(0, 0.1, 1.0, 0.1 * wall.normal + M::Vec(0, 0.3, 0))};
    std::vector<M::Velocity> expected;
    std::vector<M::Vec> places;
    run<M>(plane, grains, 800, [&](const auto&, const auto& now) {
        expected.push_back(now[0].velocity);
        places.push_back(now[0].position);
    });
    std::size_t step = 0;
    run<M>(triangles, grains, 800, [&](const auto& simulation, const auto& now) {
        REQUIRE((now[0].velocity - expected[step]).norm() < 1e-10);
        REQUIRE((now[0].position - places[step]).norm() < 1e-10);
        REQUIRE(gather_contacts(simulation).size() == 1);
        ++step;
    });
    CHECK(places.back()[0] > 0.8);
}

TEST_CASE("a sphere rolls over a thousand triangles as over a plane", "[obstacle]") {
    using M = scenes::Spheres;
    auto settings = settings_of<M>(0.5);
    const double restitution = GENERATE(0.0, 0.5), size = GENERATE(4.0, 40.0);
    settings.materials.set(0, 0, {0.5, restitution});
    add<M>(settings, sheet(32, 16, -size / 2, size));
    auto grain = make_grain<M>(0, 0.5, 1.0, {-1.5, 0.13, 0.5});
    const double vx = 2, vy = 0.7;
    grain.velocity << vx, vy, 0, -vy / 0.5, vx / 0.5, 0;
    run<M>(settings, {grain}, 1200, [&](const Simulation<M>& simulation, const auto& now) {
        REQUIRE((now[0].velocity - grain.velocity).norm() < 1e-10);
        REQUIRE(std::abs(now[0].position[2] - 0.5) < 1e-10);
        if (restitution == 0) REQUIRE(gather_contacts(simulation).size() == 1);
    });
}

TEST_CASE("a disk falls onto an edge, and into a corner", "[obstacle]") {
    using M = scenes::Disks;
    auto settings = settings_of<M>(0);
    SECTION("edge: the normal goes from the corner to the centre") {
        add<M>(settings, {{M::Vec(-1, -1), M::Vec(0, 0)}, {M::Vec(0, 0), M::Vec(1, -1)}});
        const double offset = 0.1;
        run<M>(settings, {make_grain<M>(0, 0.5, 1.0, {offset, 0.55})}, 150, [&](const auto& simulation, const auto&) {
            for (const auto& c : gather_contacts(simulation)) {
                const M::Vec way(offset, std::sqrt(0.25 - offset * offset));
                if (c.impulse.norm() > 0 && simulation.steps() < 120)
                    CHECK((c.normal - way / way.norm()).norm() < 0.05);
            }
        });
    }
    SECTION("corner: both sides carry") {
        add<M>(settings, {{M::Vec(-2, 2), M::Vec(0, 0)}, {M::Vec(0, 0), M::Vec(2, 2)}});
        const double height = 0.5 * std::sqrt(2.0);
        run<M>(settings, {make_grain<M>(0, 0.5, 1.0, {0, height + 0.05})}, 300,
               [&](const auto& simulation, const auto& now) {
                   if (simulation.steps() < 250) return;
                   CHECK(std::abs(now[0].position[1] - height) < 1e-9);
                   const auto contacts = gather_contacts(simulation);
                   REQUIRE(contacts.size() == 2);
                   for (const auto& c : contacts)
                       CHECK(c.normal_impulse == Approx(now[0].mass * 10 * settings.h / std::sqrt(2.0)));
               });
    }
}

TEST_CASE("a grain that falls on an edge rests on it", "[obstacle]") {
    const auto rests = [](auto settings, auto start, double height) {
        using M =
            std::conditional_t<std::is_same_v<decltype(start), scenes::Disks::Vec>, scenes::Disks, scenes::Spheres>;
        for (const double h : {1e-3, 2.0818e-3, 3.7e-3}) {
            settings.h = h;
            double last = 0;
            run<M>(settings, {make_grain<M>(0, 0.1, 1.0, start)}, static_cast<int>(0.4 / h),
                   [&](const auto&, const auto& now) { last = now[0].position[M::dim - 1]; });
            INFO("step " << h << " s");
            CHECK(last == Approx(height).margin(1e-6));
        }
    };
    SECTION("of two segments of one line") {
        auto settings = settings_of<scenes::Disks>(0.5);
        using Vec = scenes::Disks::Vec;
        add<scenes::Disks>(settings, {{Vec(-1, 0), Vec(0, 0)}, {Vec(0, 0), Vec(1, 0)}});
        rests(settings, Vec(0, 0.15), 0.1);
    }
    SECTION("of a ridge") {
        auto settings = settings_of<scenes::Disks>(0.5);
        using Vec = scenes::Disks::Vec;
        add<scenes::Disks>(settings, {{Vec(-1, -1), Vec(0, 0)}, {Vec(0, 0), Vec(1, -1)}});
        rests(settings, Vec(0, 0.15), 0.1);
    }
    SECTION("of two triangles of one square") {
        auto settings = settings_of<scenes::Spheres>(0.5);
        using Vec = scenes::Spheres::Vec;
        const Vec a(-1, -1, 0), b(1, -1, 0), c(1, 1, 0), d(-1, 1, 0);
        add<scenes::Spheres>(settings, {{a, b, c}, {a, d, c}});
        rests(settings, Vec(0.2, 0.2, 0.15), 0.1);
    }
}

TEST_CASE("a grain in a bore of hardly more than its size keeps its energy", "[obstacle]") {
    using M = scenes::Disks;
    struct Bore {
        double radius, h;
        M::Vec position, velocity;
        double spin, friction;
    };
    for (const Bore& bore :
         {Bore{0.9998, 3e-3, {1e-4, -1.7e-4}, {0, 0}, 0, 0}, Bore{0.999, 1e-2, {0, 0}, {3, 1}, 5, 0.3}}) {
        auto settings = settings_of<M>(bore.friction);
        settings.h = bore.h;
        settings.obstacles.push_back({.surface = make_surface<M>(Cylinder<M>{.radius = 1})});
        auto grain = make_grain<M>(0, bore.radius, 1.0, bore.position);
        grain.velocity << bore.velocity, bore.spin;
        const auto energy = [](const Grain<M>& g) {
            return 0.5 * (g.mass * g.velocity.head<2>().squaredNorm() + g.inertia * g.velocity[2] * g.velocity[2]);
        };
        const double most = energy(grain) + 10 * grain.mass * 2 * (1 - bore.radius);
        run<M>(settings, {grain}, 300, [&](const auto&, const auto& now) { CHECK(energy(now[0]) < 1.02 * most); });
    }
}

TEST_CASE("a sphere rolls to and fro in a cylinder with its period", "[obstacle]") {
    using M = scenes::Spheres;
    auto settings = settings_of<M>(2.0);
    const double radius = 1, r = 0.1, angle = 0.05;
    settings.obstacles.push_back({.surface = make_surface<M>(Cylinder<M>{.axis = {0, 1, 0}, .radius = radius})});
    const double way = radius - r, period = 2 * pi * std::sqrt(7.0 / 5 * way / 10);
    std::vector<double> crossings;
    double last = 1, lowest = 1, largest = 0;
    run<M>(settings, {make_grain<M>(0, r, 1.0, {way * std::sin(angle), 0, -way * std::cos(angle)})}, 6000,
           [&](const Simulation<M>& simulation, const auto& now) {
               const double x = now[0].position[0];
               if (x * last < 0) crossings.push_back(simulation.time());
               if (simulation.time() > 4) largest = (std::max)(largest, std::abs(x));
               last = x;
               lowest = (std::min)(lowest, radius - r - now[0].position.norm());
           });
    REQUIRE(crossings.size() >= 4);
    CHECK(2 * (crossings[3] - crossings[2]) == Approx(period).epsilon(2e-3));
    CHECK(lowest > -1e-6);                          // what overlaps does not add up
    CHECK(largest > 0.99 * way * std::sin(angle));  // nor is energy lost on the way
}

TEST_CASE("a drum of either kind carries a sphere with friction", "[obstacle]") {
    using M = scenes::Disks;
    auto settings = settings_of<M>(0.0);
    const bool round = GENERATE(true, false);
    const double radius = 2, r = 0.2, rate = 1.5, mu = 0.3;
    settings.materials.set(0, 0, {mu, 0});
    Obstacle<M>& drum = settings.obstacles.emplace_back();
    if (round) {
        drum.surface = make_surface<M>(Cylinder<M>{.radius = radius});
    } else {
        std::vector<Facet<M>> sides;
        for (int k = 0; k < 200; ++k) {
            const auto corner = [&](int n) {
                return M::Vec(radius * std::cos(2 * pi * n / 200), radius * std::sin(2 * pi * n / 200));
            };
            sides.push_back({corner(k), corner((k + 1) % 200)});
        }
        drum.surface = make_surface<M>(std::move(sides));
    }
    drum.turn.rate = rate;
    // A disk that rolls in place at the lowest point: its rim goes with the drum, and nothing pushes it aside.
    auto grain = make_grain<M>(0, r, 1.0, {0, -(radius - r)});
    double work = 0;
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, std::vector{grain});
    for (int step = 0; step < 3000; ++step) {
        const StepReport::Energy e = simulation.step(by_nlgs<M>({.tolerance = 1e-12})).energy;
        REQUIRE(std::abs(e.kinetic - e.before - e.external - e.walls - e.normal - e.friction) < 1e-12);
        work += e.walls;
    }
    const Grain<M> now = gather_grains(simulation)[0].grain;
    CHECK(work > 0);
    // the rim's velocity at the contact is that of the drum: v + spin r along the drum, after sliding has ended
    const M::Vec n = -now.position.normalized(), along(n[1], -n[0]);  // anticlockwise along the drum
    const double rim = now.velocity.head<2>().dot(along) + now.velocity[2] * r;
    CHECK(std::abs(rim - rate * radius) < 0.01 * rate * radius);
    CHECK(now.position.norm() < (radius - r) * (1 + 1e-3));
}

TEST_CASE("a paddle that turns pushes without overlaps that add up", "[obstacle]") {
    using M = scenes::Disks;
    auto settings = settings_of<M>(0.5);
    settings.gravity.setZero();
    Obstacle<M>& paddle = settings.obstacles.emplace_back();
    paddle.surface = make_surface<M>(
        std::vector<Facet<M>>{{M::Vec(0.5, -0.3), M::Vec(10, -0.3)}, {M::Vec(10, -0.3), M::Vec(10, 3)}});
    paddle.turn.rate = 1;
    double deepest = 0;
    run<M>(settings, {make_grain<M>(0, 0.2, 1.0, {2, 0})}, 4000, [&](const Simulation<M>& simulation, const auto&) {
        for (const auto& c : gather_contacts(simulation)) deepest = (std::min)(deepest, c.gap);
    });
    CHECK(deepest > -2e-5);
}

TEST_CASE("a grain does not pass through a thin sheet unseen", "[obstacle]") {
    using M = scenes::Spheres;
    const double restitution = GENERATE(0.0, 0.5);
    auto settings = settings_of<M>(0.3, restitution);
    settings.h = 0.02;
    add<M>(settings, sheet(8, 8, -2, 4));
    auto grain = make_grain<M>(0, 0.1, 1.0, {0.1, 0.2, 0.9});
    grain.velocity[2] = -60;
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, std::vector{grain});
    const auto fall = [&] {
        for (int step = 0; step < 10; ++step) simulation.step(by_nlgs<M>({}));
    };
    if (restitution > 0) {
        CHECK_THROWS_AS(fall(), StepRefused);
    } else {
        fall();
        CHECK(gather_grains(simulation)[0].grain.position[2] > 0.098);
    }
}

TEST_CASE("what moves by more than a radius in a step takes along the grain that it meets", "[obstacle]") {
    using M = scenes::Disks;
    auto settings = settings_of<M>(0.2);
    settings.gravity.setZero();
    const double speed = GENERATE(150.0, 500.0, -500.0), from = speed > 0 ? -2 : 2, r = 0.1;
    const int shape = GENERATE(0, 1, 2);
    CAPTURE(speed, shape);
    double front = from;  // of the side that meets the grain
    if (shape == 0) add<M>(settings, {{M::Vec(from, -1), M::Vec(from, 1.3)}});
    if (shape == 1) {  // a box that is thinner than a step
        const double back = from - 0.02 * speed / std::abs(speed);
        add<M>(settings, {{M::Vec(from, -1), M::Vec(from, 1.3)},
                          {M::Vec(from, 1.3), M::Vec(back, 1.3)},
                          {M::Vec(back, 1.3), M::Vec(back, -1)},
                          {M::Vec(back, -1), M::Vec(from, -1)}});
    }
    if (shape == 2) {
        settings.obstacles.push_back({.surface = make_surface<M>(Cylinder<M>{.centre = {from, 0}, .radius = 0.3})});
        front += 0.3 * speed / std::abs(speed);
    }
    settings.obstacles[0].path = steady<M>({speed, 0});
    run<M>(settings, {make_grain<M>(0, r, 1.0, {0, 0})}, 40, [&](const Simulation<M>& simulation, const auto& now) {
        const double ahead = (now[0].position[0] - front - speed * simulation.time()) * speed / std::abs(speed);
        REQUIRE(ahead > r * (1 - 1e-6));
    });
}

TEST_CASE("a blade that turns by more than a radius in a step does not go through a grain", "[obstacle]") {
    using M = scenes::Disks;
    auto settings = settings_of<M>(0);
    settings.gravity.setZero();
    add<M>(settings, {{M::Vec(-3, 0), M::Vec(3, 0)}});
    settings.obstacles[0].turn.rate = 80;  // by 0.16 where the grain is
    run<M>(settings, {make_grain<M>(0, 0.1, 1.0, {-1, 1.7})}, 40, [](const Simulation<M>& simulation, const auto& now) {
        if (simulation.steps() == 40) CHECK(now[0].velocity.template head<2>().norm() > 100);
    });
}

TEST_CASE("what is no surface is refused", "[obstacle]") {
    using M = scenes::Spheres;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(make_surface<M>(std::vector<Facet<M>>{}), std::invalid_argument);
    CHECK_THROWS_AS(make_surface<M>(std::vector<Facet<M>>{{M::Vec(0, 0, 0), M::Vec(1, 1, 1), M::Vec(3, 3, 3)}}),
                    std::invalid_argument);
    CHECK_THROWS_AS(make_surface<M>(std::vector<Facet<M>>{{M::Vec(0, 0, 0), M::Vec(1, nan, 1), M::Vec(3, 0, 3)}}),
                    std::invalid_argument);
    CHECK_THROWS_AS(make_surface<M>(Cylinder<M>{}), std::invalid_argument);
    SimulationSettings<M> settings = settings_of<M>(0);
    settings.obstacles.emplace_back();
    InProcess comm(1);
    CHECK_THROWS_AS(Simulation<M>(comm, settings, std::vector{make_grain<M>(0, 1, 1.0, {0, 0, 0})}),
                    std::invalid_argument);
}

// As in test_distance.cpp, by components that are put together on one rank: with the velocities that obstacles have.
TEST_CASE("spheres that rebound in the corners of a shaken mesh converge on subdomains", "[obstacle]") {
    using M = scenes::Spheres;
    SolveOptions options = SolveOptions{}.accelerated();
    options.max_newton_contacts = 1000;
    test::Random random(5);
    auto grains = test::random_grains<M>(random, 20, 3.0, 0.3, 0.5);
    for (auto& grain : grains) grain.velocity = test::random_vector<M::Velocity>(random, 2);
    auto settings = settings_of<M>(0.8, 0.5);
    std::vector<Facet<M>> box;
    const auto corner = [](int k) -> M::Vec { return 3.0 * M::Vec(k & 1, (k >> 1) & 1, (k >> 2) & 1); };
    for (const auto& f :
         {std::array{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}) {
        box.push_back({corner(f[0]), corner(f[1]), corner(f[2])});
        box.push_back({corner(f[0]), corner(f[2]), corner(f[3])});
    }
    add<M>(settings, box);
    settings.obstacles[0].path = oscillation<M>({0.02, 0.03, 0.01}, 3);
    InProcess comm(3);
    Simulation<M> simulation(comm, settings, grains);
    double newton = 0;
    int stopped = 0;
    for (int step = 0; step < 2500; ++step) {
        const SolveReport report = simulation.step(by_nscdd<Dcs<M>>(options, newton_where_stalled<M>())).solve;
        newton += report.newton_contacts;
        stopped += !report.converged;
    }
    CHECK(stopped == 0);
    CHECK(newton > 0);
    for (const auto& c : gather_contacts(simulation)) CHECK(c.gap > -0.02);
}
