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

// A shaken lattice of random size, driven or not, with a random step and a random phase of rough detection.
template <class M>
Described<M> random_scene(Random& random) {
    const int side = (M::dim == 2 ? 5 : 3) + static_cast<int>(random() % 3);
    Described<M> scene{lattice_settings<M>(side, random() % 2 == 0), shaken_lattice<M>(random, side), 1.05 * side, 5};
    scene.settings.h = uniform(random, 0.02, 0.06);
    scene.settings.rough_every = 1 + static_cast<int>(random() % 4);
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
        GridCells<M::dim> cells;
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

TEMPLATE_TEST_CASE("METIS may deal parts that are not connected", "[any_ranks]", SmoothDisks, FrictionSpheres) {
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
