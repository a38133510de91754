// A cluster of grains that collide in empty space: what Newton says must not change, does not.
#include "random_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

// Grains flying towards the middle of their box, spinning.
template <class M>
std::vector<Grain<M>> collapsing_cluster() {
    Random random(10);
    const double edge = M::dim == 2 ? 10 : 6;
    auto grains = random_grains<M>(random, 40, edge, 0.2, 0.6);
    for (auto& g : grains) {
        g.velocity = random_vector<typename M::Velocity>(random, 2);
        g.velocity.template head<M::dim>() += M::Vec::Constant(0.5 * edge) - g.position;
    }
    return grains;
}

template <class M>
SimulationSettings<M> empty_space(double friction, double restitution) {
    SimulationSettings<M> settings;
    settings.materials.set(0, 0, {friction, restitution});
    settings.h = 0.015;
    settings.broad_phase_every = 5;
    return settings;
}

// Sizes of the sums, so that round-off has a scale.
template <class M>
double momentum_scale(const std::vector<Grain<M>>& grains) {
    double sum = 0;
    for (const auto& g : grains) sum += g.mass * g.velocity.template head<M::dim>().norm();
    return sum;
}

constexpr Solver solvers[] = {{Scheme::nlgs, 1}, {Scheme::dcs, 2}, {Scheme::ccs, 5}, {Scheme::dcs, 5}};

}  // namespace

TEMPLATE_TEST_CASE("linear and angular momentum stay to round-off", "[conservation]", EVERY_MODEL) {
    using M = TestType;
    const double restitution = GENERATE(0.0, 0.6);
    const auto grains = collapsing_cluster<M>();
    const double scale = momentum_scale<M>(grains), arm = 10;
    for (const Solver& solver : solvers) {
        INFO(solver.name() << ", restitution " << restitution);
        auto settings = empty_space<M>(M::friction ? 0.5 : 0, restitution);
        settings.largest_overlap = 0.9;  // bodies that rebound are let in by a step's way first
        Run<M> run(solver, settings, grains);
        run.options = SolveOptions{};  // conserved whether converged or not
        run.step();
        const Measures<M> start = measure(run.simulation);
        double collisions = 0;
        for (int step = 0; step < 50; ++step) {
            run.step();
            const Measures<M> now = measure(run.simulation);
            collisions += now.contacts;
            REQUIRE((now.momentum - start.momentum).norm() <= 1e-13 * scale);
            REQUIRE((now.angular_momentum - start.angular_momentum).norm() <= 1e-13 * scale * arm);
        }
        CHECK(collisions > 15);
    }
}

TEMPLATE_TEST_CASE("kinetic energy never grows without restitution", "[conservation]", EVERY_MODEL) {
    using M = TestType;
    const auto grains = collapsing_cluster<M>();
    for (const Solver& solver : solvers) {
        INFO(solver.name());
        Run<M> run(solver, empty_space<M>(M::friction ? 0.5 : 0, 0), grains);
        run.step();
        const double start = measure(run.simulation).kinetic_energy;
        double last = start;
        for (int step = 0; step < 50; ++step) {
            run.step();
            const double energy = measure(run.simulation).kinetic_energy;
            REQUIRE(energy <= last * (1 + 1e-13));
            last = energy;
        }
        CHECK(last < 0.5 * start);
    }
}
