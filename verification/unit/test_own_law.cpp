// A law of one's own, whose contacts may pull: that of the example, by all schemes, and what the measures make of it.
#include <cmath>
#include <cstdio>

#include "random_scenes.hpp"

namespace example {
#define main run_example
#include "../../kernel/examples/cohesive_law.cpp"
#undef main
}  // namespace example

using namespace nscdd;
using namespace nscdd::test;

namespace {

using M = example::Model;

const SolveOptions tight{
    .tolerance = 1e-11, .bounds = {.max_velocity_error = 1e-10, .max_energy_gain = 1e-10}, .max_iterations = 200000};

Grain<M> ball(int id, double weight, const M::Vec& at) { return example::sphere(id, weight / example::gravity, at); }

SimulationSettings<M> under_ceiling() { return example::settings_with({0, 0, -1}, 0); }

}  // namespace

TEST_CASE("a law of one's own: CCS and DCS, accelerated or not, find what NLGS finds", "[law]") {
    // Without friction velocities have one answer; with it answers differ within the 3 % of `nscdd compare`.
    const double friction = GENERATE(0.0, 0.4);
    CAPTURE(friction);
    // a block of spheres that touch, glued to the ceiling, thrown apart: some contacts push, some pull, some tear
    Random random(61);
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 36; ++k) {
        grains.push_back(ball(k, 200, {1.0 * (k % 3), 1.0 * (k / 3 % 3), -0.5 - k / 9}));
        grains.back().velocity = random_vector<M::Velocity>(random, 0.1);
    }
    const auto solved = [&](int ranks, const AnyStepSolver<M>& solve) {
        InProcess comm(ranks);
        auto settings = under_ceiling();
        settings.materials.set(0, 0, {.friction = friction, .cohesion = example::cohesion, .contact_gap = 1e-6});
        settings.theta = 1;  // they touch when contacts are found
        Simulation<M> simulation(comm, settings, grains);
        const StepReport report = simulation.step(solve);
        CHECK(report.solve.converged);
        CHECK((report.interface_grains > 0) == (ranks > 1));
        return std::pair(gather_grains(simulation), gather_contacts(simulation));
    };
    const auto [expected, contacts] = solved(1, by_nlgs<M>(tight));
    int pushing = 0, pulling = 0, torn = 0;
    for (const auto& c : contacts) {
        const double least = -example::cohesion * example::time_step;
        pushing += c.normal_impulse > 0;
        pulling += c.normal_impulse < 0 && c.normal_impulse > least * (1 - 1e-9);
        torn += c.normal_impulse <= least * (1 - 1e-9);
    }
    CHECK(pushing > 5);
    CHECK(pulling > 5);
    CHECK(torn > 5);
    for (const auto& options : {tight, tight.accelerated()})
        for (const bool centralised : {false, true})
            for (const int ranks : {2, 5}) {
                INFO("window " << options.window << (centralised ? ", CCS" : ", DCS") << ", ranks: " << ranks);
                const auto found =
                    solved(ranks, centralised ? by_nscdd<Ccs<M>>(options) : by_nscdd<Dcs<M>>(options)).first;
                double difference = 0, all = 0;
                for (std::size_t g = 0; g < found.size(); ++g) {
                    difference += (found[g].grain.velocity - expected[g].grain.velocity).squaredNorm();
                    all += grains[g].velocity.squaredNorm();
                }
                CHECK(std::sqrt(difference / all) < (friction > 0 ? 0.03 : 1e-6));
            }
}

TEST_CASE("measures count what pulls", "[law]") {
    const int ranks = GENERATE(1, 2);
    InProcess comm(ranks);
    Simulation<M> simulation(comm, under_ceiling(),
                             std::vector{ball(0, 300, {0, 0, -0.5}), ball(1, 200, {0, 0, -1.5})});
    REQUIRE(simulation.step(by_nscdd<Dcs<M>>(tight)).solve.converged);
    const Observables<M> now = observe(simulation);
    // the ceiling holds 500 N at half a metre above the first centre, which holds 200 N at one metre above the second
    CHECK(now.measures.virial(2, 2) == Approx(-500 * 0.5 - 200 * 1.0).epsilon(1e-6));
    CHECK(now.measures.contacts == 2);
    CHECK(now.measures.wall_contacts == 1);
    CHECK(now.measures.touched == 2);
    CHECK(now.measures.coordination() == 1.5);
    CHECK(now.rattlers() == 0);
    CHECK(now.fabric(2, 2) == Approx(1));
    CHECK(now.wall_force[0][2] == Approx(-500).epsilon(1e-6));
}

TEST_CASE("a tangential impulse without a normal one counts in the stress alone", "[law]") {
    auto settings = example::settings_with({0, 0, 1}, 0);
    settings.gravity.setZero();
    std::vector<Grain<M>> grains{ball(0, 100, {0, 0, 0.5})};
    grains[0].load[0] = 70;  // at the centre, so that the floor holds 2/7 of it and the sphere rolls
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, grains);
    REQUIRE(simulation.step(by_nlgs<M>(tight)).solve.converged);
    const Measures<M> now = measure(simulation);
    CHECK(now.virial(0, 2) == Approx(-20 * 0.5).epsilon(1e-6));
    CHECK(now.contacts == 0);
    CHECK(now.coordination() == 0);
}
