// Walls that go along a path: they are where it says, and what they carry moves as exact answers say.
#include <numbers>

#include "../catch.hpp"
#include "../small_scenes.hpp"

using namespace nscdd;

namespace {

using M = scenes::Spheres;
using Vec = M::Vec;
constexpr double radius = 0.5, pi = std::numbers::pi;

// A floor at height 0.
SimulationSettings<M> floor_along(detail::Path<M> path, double friction, double restitution = 0) {
    SimulationSettings<M> settings;
    settings.h = 1e-3;
    settings.gravity = {0, 0, -10};
    settings.materials.set(0, 0, {friction, restitution});
    Wall<M>& floor = settings.walls.emplace_back();
    floor.normal = {0, 0, 1};
    floor.path = std::move(path);
    return settings;
}

// Visits the simulation after each step of a sphere on that floor, and checks the balance of energy.
void run(const SimulationSettings<M>& settings, int steps, auto&& visit) {
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, std::vector{make_grain<M>(0, radius, 1.0, {0, 0, radius})});
    for (int step = 1; step <= steps; ++step) {
        const StepReport report = simulation.step(by_nlgs<M>({}));
        const StepReport::Energy& e = report.energy;
        CHECK(std::abs(e.kinetic - e.before - e.external - e.walls - e.normal - e.friction) < 1e-12);
        visit(simulation, simulation.parts()[0].grains[0], report);
    }
}

}  // namespace

TEST_CASE("a sphere rides on a floor that oscillates, and leaves it where it falls faster", "[moving]") {
    const double amplitude = 0.1, frequency = 2, rate = 2 * pi * frequency;
    auto settings = floor_along(oscillation<M>({0, 0, amplitude}, frequency, -pi / 2), 0);  // from rest
    double left = 0;
    run(settings, 200, [&](const Simulation<M>& simulation, const Grain<M>& grain, const StepReport& report) {
        const double time = simulation.time(), height = amplitude * (1 - std::cos(rate * time));
        CHECK(std::abs(simulation.walls()[0].offset - height) < 1e-13);
        const double gap = grain.position[2] - radius - height;
        if (left > 0 || time > 0.19) return;
        if (report.contacts > 0 && report.energy.walls != 0)
            CHECK(std::abs(gap) < 0.26 * std::pow(rate * settings.h, 2) * amplitude);  // chord and arc of a step
        else
            left = time;
    });
    CHECK(std::abs(left - (std::asin(10 / (amplitude * rate * rate)) + pi / 2) / rate) < 2 * settings.h);
}

TEST_CASE("a sphere on a floor that oscillates sideways rolls by 2/7 of it", "[moving]") {
    auto settings = floor_along(oscillation<M>({0.02, 0.01, 0}, 3, -pi / 2), 1.0);
    settings.theta = GENERATE(0.5, 0.8, 1.0);
    run(settings, 400, [&](const Simulation<M>& simulation, const Grain<M>& grain, const StepReport&) {
        const Vec expected = 2.0 / 7 * simulation.walls()[0].velocity;
        CHECK((grain.velocity.head<3>() - expected).norm() < 1e-12);
    });
}

TEST_CASE("a floor that rises and stops leaves the sphere its speed", "[moving]") {
    auto settings = floor_along(along_table<M>({0, 0.1, 1}, {{0, 0, 3}, {0, 0, 3.1}, {0, 0, 3.1}}), 0);
    settings.gravity.setZero();
    run(settings, 150, [&](const Simulation<M>& simulation, const Grain<M>& grain, const StepReport&) {
        CHECK(simulation.walls()[0].offset == Approx((std::min)(simulation.time(), 0.1)));
        CHECK(grain.velocity[2] == Approx(1));
    });
}

TEST_CASE("a path goes on from any step", "[moving]") {
    auto settings = floor_along(oscillation<M>({0.01, 0, 0.02}, 4, 0.3), 0.5);
    settings.theta = 0.7;
    const std::vector grains{make_grain<M>(0, radius, 1.0, {0, 0, radius})};
    InProcess comm(1);
    Simulation<M> whole(comm, settings, grains);
    for (int step = 0; step < 37; ++step) whole.step(by_nlgs<M>({}));
    auto rest = whole.settings();
    rest.steps_before = 37;
    const auto broad_phase = gather_broad_phase(whole);
    std::vector<PairImpulse<M>> impulses;
    for (const auto& c : gather_contacts(whole)) impulses.push_back(c.pair());
    Simulation<M> second(comm, rest, std::vector{gather_grains(whole)[0].grain}, impulses, &broad_phase);
    for (int step = 0; step < 40; ++step) {
        whole.step(by_nlgs<M>({}));
        second.step(by_nlgs<M>({}));
    }
    CHECK(whole.time() == second.time());
    CHECK(whole.walls()[0].offset == second.walls()[0].offset);
    CHECK(whole.parts()[0].grains[0].position == second.parts()[0].grains[0].position);
    CHECK(whole.parts()[0].grains[0].velocity == second.parts()[0].grains[0].velocity);
}

TEST_CASE("a wall has a path or a force, and tables ascend", "[moving]") {
    auto settings = floor_along(oscillation<M>({0, 0, 1}, 1), 0);
    settings.walls[0].driven = true;
    settings.walls[0].mass = 1;
    InProcess comm(1);
    CHECK_THROWS_AS(Simulation<M>(comm, settings, std::vector{make_grain<M>(0, radius, 1.0, {0, 0, radius})}),
                    std::invalid_argument);
    CHECK_THROWS_AS(along_table<M>({0, 1, 1}, std::vector<Vec>(3, Vec::Zero())), std::invalid_argument);
    CHECK_THROWS_AS(along_table<M>({0}, {}), std::invalid_argument);
}
