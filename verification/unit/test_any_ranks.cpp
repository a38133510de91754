// Scenes on any number of ranks, by any partition, against the sequential reference at eta = 1e-8.
#include <memory>
#include <set>

#include "described_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

template <class M>
std::unique_ptr<Run<M>> stepped(const Solver& solver, const Described<M>& scene) {
    auto run = std::make_unique<Run<M>>(solver, scene.settings, scene.grains);
    run->options = SolveOptions{.tolerance = 1e-8}.accelerated();
    for (int step = 0; step < scene.steps; ++step) run->step();
    return run;
}
template <class M>
std::unique_ptr<Run<M>> stepped(const Solver& solver, Described<M> scene, const Partitioner<M>& partitioner) {
    scene.settings.partition = partitioner;
    return stepped(solver, scene);
}

// Largest difference of velocities.
template <class M>
double difference(const std::vector<Grain<M>>& a, const std::vector<Grain<M>>& b) {
    REQUIRE(a.size() == b.size());
    double worst = 0;
    for (std::size_t g = 0; g < a.size(); ++g) worst = std::max(worst, (a[g].velocity - b[g].velocity).norm());
    return worst;
}

// A shaken lattice of random size, driven or not, with a random step and a random phase of broad phase.
template <class M>
Described<M> random_scene(Random& random) {
    const int side = (M::dim == 2 ? 5 : 3) + static_cast<int>(random() % 3);
    Described<M> scene{lattice_settings<M>(side, random() % 2 == 0), shaken_lattice<M>(random, side), 1.05 * side, 5};
    scene.settings.h = uniform(random, 0.02, 0.06);
    scene.settings.broad_phase_every = 1 + static_cast<int>(random() % 4);
    return scene;
}

}  // namespace

TEMPLATE_TEST_CASE("random scenes on any number of ranks by any partition give the reference's answer",
                   "[any_ranks][long]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    for (const unsigned seed : {34u, 35u, 36u, 37u, 38u, 39u, 40u, 41u, 42u, 43u}) {
        Random random(seed);
        const Described<M> scene = random_scene<M>(random);
        const auto expected = stepped(nlgs_alone, scene)->grains();
        for (const int ranks : {1, 2, 3, 4, 7, 8})
            for (const auto& partitioner : partitioners<M>(scene.edge, 1.0)) {
                INFO("seed " << seed << ", " << partitioner.kind << ", ranks: " << ranks);
                const auto found = stepped({random() % 2 ? Scheme::dcs : Scheme::ccs, ranks}, scene, partitioner);
                CHECK(difference<M>(found->grains(), expected) < 1e-5);
            }
    }
}

TEST_CASE("ranks that sweep by batches and one that sweeps contact by contact glue the same velocities",
          "[any_ranks]") {
    using M = FrictionSpheres;
    Random random(45);
    const int side = 5;
    Described<M> scene{lattice_settings<M>(side), shaken_lattice<M>(random, side), 1.05 * side, 3};
    // shells turn otherwise than solid spheres: their subdomains do not fit into batches
    for (auto& g : scene.grains)
        if (g.position.norm() < 2.5) g.inertia *= 1 + 0.2 * (1 + g.id % 3);
    const auto expected = stepped(nlgs_alone, scene)->grains();
    for (const Scheme scheme : {Scheme::dcs, Scheme::ccs}) {
        const auto found = stepped({scheme, 8}, scene);
        std::set<bool> batched;
        for (const auto& part : found->simulation.parts())
            if (!part.interface.empty()) batched.insert(part.sweeper.batched());
        CHECK(batched.size() == 2);
        CHECK(difference<M>(found->grains(), expected) < 1e-5);
    }
}

TEMPLATE_TEST_CASE("one grain, on any number of ranks", "[any_ranks]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const Described<M> scene = one_grain<M>();
    const auto expected = stepped(nlgs_alone, scene)->grains();
    CHECK(std::abs(expected[0].position[0] - 0.5) < 1e-3);  // it fell, and rests on the wall
    for (const int ranks : {1, 2, 3, 4, 7, 8})
        for (const auto& partitioner : partitioners<M>(scene.edge)) {
            INFO(partitioner.kind << ", ranks: " << ranks);
            const auto found = stepped({Scheme::dcs, ranks}, scene, partitioner)->grains();
            CHECK(difference<M>(found, expected) < 1e-12);
            CHECK((found[0].position - expected[0].position).norm() < 1e-12);
        }
}

TEMPLATE_TEST_CASE("a wall that all ranks touch stops as it does with the reference", "[any_ranks]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    Random random(42);
    const int side = M::dim == 2 ? 8 : 4;
    Described<M> scene{lattice_settings<M>(side), shaken_lattice<M>(random, side), 1.05 * side, 4};
    Wall<M>& floor = scene.settings.walls[2 * (M::dim - 1)];  // pushed up against all of the lowest layer
    floor.driven = true;
    floor.mass = 20;
    floor.force = 50;
    const auto expected = stepped(nlgs_alone, scene);
    for (const int ranks : {2, 4, 8}) {
        INFO("ranks: " << ranks);
        detail::GridCells<M::dim> cells;
        cells.fill(1);
        cells[0] = ranks;  // slabs, side by side on the floor
        const auto found = stepped({Scheme::dcs, ranks}, scene, by_grid<M>(cells));
        int touching = 0;
        for (const auto& part : found->simulation.parts()) touching += part.wall_touched[2 * (M::dim - 1)] != 0;
        CHECK(touching == ranks);
        CHECK(difference<M>(found->grains(), expected->grains()) < 1e-5);
        const std::size_t w = 2 * (M::dim - 1);
        CHECK(std::abs(found->simulation.walls()[w].speed - expected->simulation.walls()[w].speed) < 1e-6);
    }
}

TEMPLATE_TEST_CASE("a grain crosses several subdomains in a step", "[any_ranks]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    Described<M> scene = crossing_grain<M>();
    const auto owner_of_first = [](const Run<M>& run) {
        for (const auto& part : run.simulation.parts())
            for (std::size_t g = 0; g < part.grains.size(); ++g)
                if (part.grains[g].id == 0 && part.primary(g)) return part.rank;
        return -1;
    };
    std::set<int> owners;
    for (scene.steps = 1; scene.steps <= 5; ++scene.steps) {  // there, against the wall
        INFO(scene.steps << " steps");
        const auto expected = stepped(nlgs_alone, scene, by_grid<M>());
        const auto found = stepped({Scheme::dcs, 8}, scene);
        owners.insert(owner_of_first(*found));
        CHECK(difference<M>(found->grains(), expected->grains()) < 1e-5);
        CHECK((found->grains()[0].position - expected->grains()[0].position).norm() < 1e-6);
        if (scene.steps == 5) CHECK(expected->grains()[0].velocity.norm() < 1e-4);
    }
    CHECK(owners.size() <= 4);  // of the eight, most were jumped over
    CHECK(*owners.rbegin() - *owners.begin() >= 4);
}

TEMPLATE_TEST_CASE("METIS may deal parts that are not connected", "[any_ranks][long]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const Described<M> scene = clumps<M>(7);
    const auto expected = stepped(nlgs_alone, scene)->grains();
    for (const int ranks : {2, 3, 4}) {
        INFO("ranks: " << ranks);
        const auto found = stepped({Scheme::dcs, ranks}, scene, by_metis<M>(1.0));
        std::size_t several = 0;  // ranks with grains of more than one clump
        for (const auto& part : found->simulation.parts()) {
            std::set<int> of;
            for (const auto& grain : part.grains) of.insert(clump_at<M>(grain.position));
            several += of.size() > 1;
        }
        CHECK(several > 0);
        CHECK(difference<M>(found->grains(), expected) < 1e-5);
    }
}

TEMPLATE_TEST_CASE("the predicted interface contains the minimal one, and gives the same answer", "[any_ranks]",
                   EVERY_MODEL) {
    using M = TestType;
    const Scheme scheme = GENERATE(Scheme::ccs, Scheme::dcs);
    const bool driven = GENERATE(false, true), accelerated = GENERATE(false, true);
    CAPTURE(scheme == Scheme::ccs, driven, accelerated);
    const int side = M::dim == 2 ? 7 : 4;
    SimulationSettings<M> settings = lattice_settings<M>(side, driven);
    const auto step_of = [&](const Solver& solver, Multiplicity multiplicity) {
        Random random(18);
        settings.multiplicity = multiplicity;
        auto run = std::make_unique<Run<M>>(solver, settings, shaken_lattice<M>(random, side));
        if (accelerated) run->options = run->options.accelerated();
        run->step();
        return run;
    };
    const auto alone = step_of(nlgs_alone, Multiplicity::minimal),
               minimal = step_of({scheme, 8}, Multiplicity::minimal),
               predicted = step_of({scheme, 8}, Multiplicity::predicted);
    const auto expected = alone->grains(), found = predicted->grains();
    for (std::size_t g = 0; g < found.size(); ++g) CHECK((found[g].velocity - expected[g].velocity).norm() < 1e-6);
    const auto fewer = gather_grains(minimal->simulation), more = gather_grains(predicted->simulation);
    int foreseen_only = 0;
    for (std::size_t g = 0; g < more.size(); ++g) {
        CHECK(more[g].multiplicity >= fewer[g].multiplicity);
        foreseen_only += more[g].multiplicity > fewer[g].multiplicity;
    }
    CHECK(foreseen_only > 0);
}

TEMPLATE_TEST_CASE("ranks without contacts, and more ranks than grains", "[any_ranks]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    SimulationSettings<M> settings;
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    settings.h = 0.05;
    settings.walls = box_walls<M>(12, driven);
    std::vector<Grain<M>> grains;  // two and two, that collide far from each other; nothing in between
    for (int k = 0; k < 4; ++k) {
        typename M::Vec x = M::Vec::Constant(6);
        x[0] = k < 2 ? 1 + 1.02 * k : 11 - 1.02 * (k - 2);
        grains.push_back(make_grain<M>(k, 0.5, 1.0, x));
        grains.back().velocity[0] = k == 0 ? 1 : k == 2 ? -1 : 0;
        grains.back().velocity[1] = 0.1 * k;
    }
    std::vector<Grain<M>> expected;
    for (const Solver& solver :
         {nlgs_alone, Solver{Scheme::dcs, 3}, {Scheme::ccs, 3}, {Scheme::dcs, 9}, {Scheme::ccs, 9}}) {
        INFO(solver.name());
        Run<M> run(solver, settings, grains);
        for (int step = 0; step < 3; ++step) run.step();
        if (solver.ranks == 1) {
            expected = run.grains();
            CHECK(expected[1].velocity[0] > 0.3);  // they did collide
            CHECK(expected[3].velocity[0] < -0.3);
            continue;
        }
        int idle = 0;
        for (const auto& part : run.simulation.parts()) idle += part.problem.contact_count() == 0;
        CHECK(idle > 0);
        const auto found = run.grains();
        REQUIRE(found.size() == 4);
        for (std::size_t k = 0; k < 4; ++k) CHECK((found[k].velocity - expected[k].velocity).norm() < 1e-9);
    }
}
