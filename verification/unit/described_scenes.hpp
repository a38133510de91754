// Scenes for tests on any number of ranks, in process and over MPI.
#pragma once

#include "any_partition.hpp"
#include "smooth.hpp"

namespace nscdd::test {

template <class M>
struct Described {
    SimulationSettings<M> settings;
    std::vector<Grain<M>> grains;
    double edge;  // of its box
    int steps;
};

// It falls, and rests on the first wall.
template <class M>
Described<M> one_grain() {
    Described<M> scene{{.materials = smooth<M>()}, {make_grain<M>(0, 0.5, 1.0, M::Vec::Constant(2))}, 4, 60};
    scene.settings.walls = box_walls<M>(scene.edge);
    scene.settings.gravity[0] = -1;
    scene.settings.h = 0.05;
    return scene;
}

// Grain 0 goes 10 a step, where each of the 8 subdomains, slabs, is 4 wide; in five steps it is at the wall. Others are
// in all subdomains, aside.
template <class M>
Described<M> crossing_grain() {
    Described<M> scene{{.materials = smooth<M>()}, {make_grain<M>(0, 0.5, 1.0, M::Vec::Constant(1))}, 32, 5};
    scene.settings.walls = box_walls<M>(scene.edge);
    scene.settings.h = 0.1;
    scene.settings.broad_phase_every = 1;
    scene.grains[0].velocity[0] = 100;
    for (int k = 1; k < 12; ++k) {
        typename M::Vec x = M::Vec::Constant(8);
        x[0] = 2.6 * k;
        scene.grains.push_back(make_grain<M>(k, 0.5, 1.0, x));
    }
    detail::GridCells<M::dim> cells;
    cells.fill(1);
    cells[0] = 8;
    scene.settings.partition = by_grid<M>(cells);
    return scene;
}

// Grains in clumps that are far from each other, each thrown together.
template <class M>
Described<M> clumps(int count) {
    Described<M> scene{{.materials = smooth<M>()}, {}, 20.0 * count, 4};
    Random random(41);
    scene.settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    scene.settings.h = 0.05;
    scene.settings.largest_overlap = 0.5;
    scene.settings.walls = box_walls<M>(scene.edge);
    for (int n = 0; n < count; ++n) {
        auto clump = shaken_lattice<M>(random, 3);
        for (auto& grain : clump) {
            grain.id = static_cast<int>(scene.grains.size());
            const typename M::Vec middle = M::Vec::Constant(1.05 * 1.5);
            grain.velocity.template head<M::dim>() = 2 * (middle - grain.position);
            grain.position += M::Vec::Constant(5) + 20.0 * n * M::Vec::UnitX();
            scene.grains.push_back(grain);
        }
    }
    return scene;
}

// Which clump a place is in.
template <class M>
int clump_at(const typename M::Vec& x) {
    return static_cast<int>(x[0] / 20);
}

}  // namespace nscdd::test
