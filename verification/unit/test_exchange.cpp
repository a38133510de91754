// Grains that are fixed, that enter and that leave: against exact answers, against scenes that are made anew, and
// divided.
#include <map>
#include <numeric>

#include "../catch.hpp"
#include "nscdd/partition/bisection.hpp"
#ifndef NSCDD_WITHOUT_COMPILED_KERNEL
#include "nscdd/reference.hpp"
#endif
#include "random_scenes.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

const SolveOptions exact{.tolerance = 1e-13, .check_every = 5, .max_iterations = 50000};

// Centres and velocities by id, on one process.
template <class M>
std::map<int, Grain<M>> by_id(const Simulation<M>& simulation) {
    std::map<int, Grain<M>> grains;
    for (const auto& g : gather_grains(simulation)) grains[g.grain.id] = g.grain;
    return grains;
}

template <class M>
double difference(const std::map<int, Grain<M>>& a, const std::map<int, Grain<M>>& b) {
    REQUIRE(a.size() == b.size());
    double worst = 0;
    for (auto p = a.begin(), q = b.begin(); p != a.end(); ++p, ++q) {
        REQUIRE(p->first == q->first);
        worst = std::max({worst, (p->second.position - q->second.position).norm(),
                          (p->second.velocity - q->second.velocity).norm()});
    }
    return worst;
}

// A heap whose lowest layers are fixed, and overlap.
template <class M>
std::vector<Grain<M>> heap_on_fixed(int side) {
    Random random(3);
    std::vector<Grain<M>> grains = shaken_lattice<M>(random, side);
    for (Grain<M>& grain : grains) {
        grain.radius -= 0.03;
        if (grain.position[M::dim - 1] < 2.2) {
            grain.radius = 0.56;
            fix(grain);
        }
    }
    return grains;
}

}  // namespace

TEMPLATE_TEST_CASE("a grain that falls on a fixed one bounces as on a wall, and its weight is carried", "",
                   EVERY_MODEL) {
    using M = TestType;
    for (const double e : {0.0, 0.5, 1.0}) {
        Grain<M> fixed = make_grain<M>(0, 0.5, 1.0, M::Vec::Zero());
        fix(fixed);
        Grain<M> ball = make_grain<M>(1, 0.5, 1.0, 1.0005 * M::Vec::Unit(M::dim - 1));
        ball.velocity[M::dim - 1] = -1;
        SimulationSettings<M> settings;
        settings.h = 1e-3;
        settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, e});
        InProcess comm(1);
        Simulation<M> simulation(comm, settings, std::vector{ball, fixed});
        StepReport::Energy sum;
        for (int k = 0; k < 5; ++k) {
            const StepReport report = simulation.step(by_nlgs<M>(exact));
            sum.normal += report.energy.normal;
            CHECK(std::abs(report.energy.round_off()) < 1e-14);
        }
        const auto after = by_id(simulation);
        CHECK(after.at(1).velocity[M::dim - 1] == Approx(e).margin(1e-12));
        CHECK(after.at(0).position.isZero(0));
        CHECK(after.at(0).velocity.isZero(0));
        CHECK(-sum.normal == Approx(0.5 * ball.mass * (1 - e * e)).margin(1e-12));
        const Measures<M> m = measure(simulation);
        CHECK(m.momentum[M::dim - 1] == Approx(e * ball.mass).margin(1e-12));
        CHECK(observe(simulation).mass == ball.mass);
    }
}

TEMPLATE_TEST_CASE("fixed grains stay, and the heap on them is the same however it is divided", "", EVERY_MODEL) {
    using M = TestType;
    const int side = M::dim == 2 ? 7 : 5;
    const std::vector<Grain<M>> grains = heap_on_fixed<M>(side);
    REQUIRE(std::ranges::count_if(grains, &Grain<M>::fixed) >= side);
    std::map<int, Grain<M>> alone;
    for (const Solver solver : {nlgs_alone, Solver{Scheme::dcs, 5}, Solver{Scheme::ccs, 5}}) {
        SimulationSettings<M> settings = lattice_settings<M>(side);
        settings.h = 0.01;
        settings.multiplicity = solver.scheme == Scheme::ccs ? Multiplicity::predicted : Multiplicity::minimal;
        Run<M> run(solver, settings, grains);
        run.options = exact;
        double most_interface = 0;
        for (int k = 0; k < 10; ++k) {
            const StepReport report = run.step();
            CHECK(std::abs(report.energy.round_off()) < 1e-9);
            most_interface = std::max(most_interface, report.interface_grains);
        }
        CHECK((most_interface > 0) == (solver.ranks > 1));
        const auto after = by_id(run.simulation);
        for (const Grain<M>& grain : grains)
            if (grain.fixed()) CHECK(after.at(grain.id).position == grain.position);
        if (alone.empty()) alone = after;
        CHECK(difference(alone, after) < 1e-7);
        CHECK(detail::largest_net_force(run.simulation) > 0);
    }
}

TEMPLATE_TEST_CASE("a wall that a force drives comes to rest on fixed grains", "", EVERY_MODEL) {
    using M = TestType;
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 6; ++k) {
        typename M::Vec at = 0.5 * M::Vec::Unit(M::dim - 1);
        at[0] = 1.5 * k;
        grains.push_back(make_grain<M>(k, k % 2 == 0 ? 0.5 : 0.4, 1.0, at));
        if (k % 2 == 0) fix(grains.back());
    }
    SimulationSettings<M> settings;
    settings.h = 0.01;
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0});
    Wall<M>& lid = settings.walls.emplace_back();
    lid.normal = -M::Vec::Unit(M::dim - 1);
    lid.offset = -1.01;
    lid.velocity[0] = 0.1;  // slides over them
    lid.driven = true, lid.mass = 1, lid.force = 3;
    for (const Solver solver : {nlgs_alone, Solver{Scheme::dcs, 3}, Solver{Scheme::ccs, 3}}) {
        Run<M> run(solver, settings, grains);
        run.options = exact;
        run.options.tolerance = 1e-10;
        for (int k = 0; k < 20; ++k) {
            const StepReport report = run.step();
            CHECK(report.solve.converged);
            CHECK(std::abs(report.energy.round_off()) < 1e-12);
        }
        CHECK(std::abs(run.simulation.walls()[0].offset + 1) < 1e-4);
        CHECK(std::abs(run.simulation.walls()[0].speed) < 1e-4);
        double carried = 0, dragged = 0;
        for (const auto& c : gather_contacts(run.simulation)) {
            carried += c.normal_impulse;
            dragged += c.impulse[0];
        }
        CHECK(carried == Approx(3 * settings.h));
        if (M::friction) CHECK(dragged == Approx(0.3 * carried));
    }
}

#ifndef NSCDD_WITHOUT_COMPILED_KERNEL  // this takes longest to compile
TEMPLATE_TEST_CASE("Newton's method takes over components on fixed grains", "", EVERY_MODEL) {
    using M = TestType;
    const int side = M::dim == 2 ? 6 : 4;
    const std::vector<Grain<M>> grains = heap_on_fixed<M>(side);
    std::vector<std::map<int, Grain<M>>> after;
    for (const int ranks : {1, 3}) {
        InProcess comm(ranks);
        SimulationSettings<M> settings = lattice_settings<M>(side);
        settings.h = 0.01;
        Simulation<M> simulation(comm, settings, grains);
        SolveOptions few = exact;
        few.max_iterations = 1000;
        few.tolerance = 1e-11;
        few.relaxation = 0.01;  // so slow that sweeps get nowhere
        few.max_newton_contacts = 2000;
        double newton = 0;
        for (int k = 0; k < 6; ++k)
            newton += simulation.step(by_nscdd<Dcs<M>>(few, newton_where_stalled<M>())).solve.newton_contacts;
        CHECK(newton > 0);
        after.push_back(by_id(simulation));
    }
    CHECK(difference(after[0], after[1]) < 1e-5);
}
#endif

TEMPLATE_TEST_CASE("what is left steps on as a scene made of it", "", EVERY_MODEL) {
    using M = TestType;
    Random random(8);
    const int side = M::dim == 2 ? 7 : 4;
    const std::vector<Grain<M>> grains = shaken_lattice<M>(random, side);
    const auto gone = [](const Grain<M>& g) { return g.position[0] < 1.6 && g.position[1] > 1; };
    for (const int ranks : {1, 4})
        for (const bool closed : {false, true}) {
            INFO(ranks << " ranks, ids closed up: " << closed);
            const Solver solver{ranks == 1 ? Scheme::nlgs : Scheme::dcs, ranks};
            Run<M> run(solver, lattice_settings<M>(side), grains);
            run.options = exact;
            for (int k = 0; k < 5; ++k) run.step();
            std::vector<Grain<M>> left;
            std::map<int, int> renamed;
            double removed_mass = 0;
            for (const auto& [id, grain] : by_id(run.simulation)) {
                if (gone(grain)) {
                    removed_mass += grain.mass;
                    continue;
                }
                renamed[id] = closed ? static_cast<int>(left.size()) : id;
                left.push_back(grain);
                left.back().id = renamed[id];
            }
            std::vector<PairImpulse<M>> impulses;
            for (const auto& c : gather_contacts(run.simulation)) {
                PairImpulse<M> impulse = c.pair();
                if (!renamed.contains(c.i) || (c.j >= 0 && !renamed.contains(c.j))) continue;
                impulse.i = renamed[c.i];
                if (c.j >= 0) impulse.j = renamed[c.j];
                impulses.push_back(impulse);
            }
            const auto removed = run.simulation.remove(
                gone, closed ? Simulation<M>::Numbering::closed_up : Simulation<M>::Numbering::kept);
            REQUIRE(removed.size() == grains.size() - left.size());
            REQUIRE(removed.size() > 3);
            CHECK(std::accumulate(removed.begin(), removed.end(), 0.0,
                                  [](double sum, const Grain<M>& g) { return sum + g.mass; }) == Approx(removed_mass));
            CHECK(run.simulation.grain_count() == left.size());
            CHECK(measure(run.simulation).contacts == 0);
            InProcess comm(ranks);
            SimulationSettings<M> settings = run.simulation.settings();
            Simulation<M> fresh(comm, settings, left, impulses);
            for (int k = 0; k < 5; ++k) {
                run.step();
                if (ranks == 1)
                    fresh.step(by_nlgs<M>(exact));
                else
                    fresh.step(by_nscdd<Dcs<M>>(exact));
            }
            CHECK(difference(by_id(run.simulation), by_id(fresh)) < (ranks == 1 ? 1e-12 : 1e-7));
        }
}

TEMPLATE_TEST_CASE("grains come into a scene, also into an empty one", "", EVERY_MODEL) {
    using M = TestType;
    Random random(9);
    const std::vector<Grain<M>> grains = shaken_lattice<M>(random, 4);
    const std::span<const Grain<M>> all(grains);
    for (const int ranks : {1, 3}) {
        InProcess comm(ranks), other(ranks);
        SimulationSettings<M> settings = lattice_settings<M>(4);
        if (ranks == 3) settings.partition = by_bisection<M>();
        const auto solve = by_nscdd<Dcs<M>>(exact);
        Simulation<M> whole(other, settings, grains);
        CHECK_THROWS_WITH(Simulation<M>(comm, settings, {}), Catch::Contains("no grains"));
        settings.may_be_empty = true;
        Simulation<M> simulation(comm, settings, {});
        CHECK(simulation.step(solve).contacts == 0);
        simulation.insert(all.first(5));
        CHECK_THROWS_WITH(simulation.insert(all.subspan(4, 3)), Catch::Contains("there are two of this id"));
        CHECK(simulation.grain_count() == 5);
        simulation.insert(all.subspan(5));
        CHECK(simulation.grain_count() == grains.size());
        for (int k = 0; k < 6; ++k) {
            simulation.step(solve);
            whole.step(solve);
        }
        CHECK(difference(by_id(simulation), by_id(whole)) < 1e-7);
        CHECK(simulation.remove([](const Grain<M>&) { return true; }).size() == grains.size());
        CHECK(simulation.grain_count() == 0);
        CHECK(simulation.step(solve).contacts == 0);
        simulation.insert(all);
        CHECK(simulation.step(solve).contacts > 0);
    }
}

TEST_CASE("a fixed grain has no motion and no load") {
    using M = scenes::Disks;
    InProcess comm(1);
    SimulationSettings<M> settings{.materials = smooth<M>()};
    settings.h = 1;
    for (const bool moves : {true, false}) {
        Grain<M> grain = make_grain<M>(0, 0.5, 1.0, M::Vec::Zero());
        fix(grain);
        (moves ? grain.velocity : grain.load)[0] = 1;
        CHECK_THROWS_WITH(Simulation<M>(comm, settings, std::vector{grain}),
                          Catch::Contains(moves ? "velocity of a fixed grain" : "load of a fixed grain"));
    }
}
