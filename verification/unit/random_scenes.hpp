// Models, solvers and small scenes that the unit tests of the kernel share.
#pragma once

#include <random>
#include <span>
#include <string>
#include <vector>

#include "../catch.hpp"
#include "../every_model.hpp"

namespace nscdd::test {

using SmoothDisks = Model<2, Frictionless>;
using SmoothSpheres = Model<3, Frictionless>;
using FrictionDisks = Model<2, Coulomb>;
using FrictionSpheres = Model<3, Coulomb>;

using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

// A vector type of fixed size with entries within [-size, size].
template <class Vector>
Vector random_vector(Random& random, double size = 1) {
    Vector v;
    for (int d = 0; d < v.size(); ++d) v[d] = uniform(random, -size, size);
    return v;
}

template <class M>
typename M::Vec random_unit(Random& random) {
    for (;;) {
        const auto v = random_vector<typename M::Vec>(random);
        if (v.norm() > 0.1) return v.normalized();
    }
}

// Grains at random places of the box [0, edge]^dim, radii within [smallest, largest], at least `gap` apart.
template <class M>
std::vector<Grain<M>> random_grains(Random& random, int count, double edge, double smallest, double largest,
                                    double gap = 0) {
    std::vector<Grain<M>> grains;
    while (static_cast<int>(grains.size()) < count) {
        const double radius = uniform(random, smallest, largest);
        typename M::Vec x;
        for (int d = 0; d < M::dim; ++d) x[d] = uniform(random, radius, edge - radius);
        const auto meets = [&](const Grain<M>& g) { return (g.position - x).norm() < g.radius + radius + gap; };
        if (std::none_of(grains.begin(), grains.end(), meets))
            grains.push_back(make_grain<M>(static_cast<int>(grains.size()), radius, 1.0, x));
    }
    return grains;
}

// side^dim grains of radii 0.49 to 0.51 on a shaken lattice of spacing 1.05 with random velocities: nearly touching, so
// that with h = 0.05 each meets most of its neighbours. In the box [0, 1.05 side]. Ids are not in spatial order.
template <class M>
std::vector<Grain<M>> shaken_lattice(Random& random, int side) {
    std::vector<Grain<M>> grains;
    for (int k = 0; k < side * side * (M::dim == 3 ? side : 1); ++k) {
        typename M::Vec x;
        for (int d = 0, rest = k; d < M::dim; ++d, rest /= side)
            x[d] = 1.05 * (rest % side + 0.5) + uniform(random, -0.01, 0.01);
        grains.push_back(make_grain<M>(0, uniform(random, 0.49, 0.51), 1.0, x));
        grains.back().velocity = random_vector<typename M::Velocity>(random);
    }
    std::shuffle(grains.begin(), grains.end(), random);
    for (std::size_t k = 0; k < grains.size(); ++k) grains[k].id = static_cast<int>(k);
    return grains;
}

// The walls of the box [0, edge]^dim. Driven: those on the far sides are pushed inwards.
template <class M>
std::vector<Wall<M>> box_walls(double edge, bool driven = false) {
    std::vector<Wall<M>> walls;
    for (int d = 0; d < M::dim; ++d)
        for (const double sign : {1.0, -1.0}) {
            Wall<M>& wall = walls.emplace_back();
            wall.normal = sign * M::Vec::Unit(d);
            wall.offset = sign > 0 ? 0 : -edge;
            if (!driven || sign > 0) continue;
            wall.driven = true;
            wall.mass = 50;
            wall.force = 100;
        }
    return walls;
}

// The shaken lattice in its box, mu = 0.3, under its own weight.
template <class M>
SimulationSettings<M> lattice_settings(int side, bool driven = false) {
    SimulationSettings<M> settings;
    settings.walls = box_walls<M>(1.05 * side, driven);
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    settings.gravity[M::dim - 1] = -1;
    settings.h = 0.05;
    settings.broad_phase_every = 3;
    settings.largest_overlap = 0.5;  // the lattice is not freed of what the first half step may close
    return settings;
}

enum class Scheme { nlgs, ccs, dcs, newton };

struct Solver {
    Scheme scheme;
    int ranks;

    std::string name() const {
        return (scheme == Scheme::nlgs  ? "nlgs"
                : scheme == Scheme::ccs ? "ccs"
                : scheme == Scheme::dcs ? "dcs"
                                        : "newton") +
               std::string(", ranks: ") + std::to_string(ranks);
    }
};

constexpr Solver nlgs_alone{Scheme::nlgs, 1};

// A simulation and what solves its steps, to a tight tolerance.
template <class M>
struct Run {
    Run(const Solver& with, SimulationSettings<M> settings, const std::vector<Grain<M>>& grains)
        : solver(with), comm(with.ranks), simulation(comm, std::move(settings), grains) {}

    StepReport step() {
        const StepReport report = [&] {
            if (solver.scheme == Scheme::nlgs) return simulation.step(by_nlgs<M>(options));
#ifndef NSCDD_WITHOUT_COMPILED_KERNEL  // this takes longest to compile
            if (solver.scheme == Scheme::newton)
                return simulation.step(by_newton<M>({.tolerance = options.tolerance,
                                                     .bounds = {.max_penetration = options.bounds.max_penetration},
                                                     .warm_sweeps = 0}));
#endif
            if (solver.scheme == Scheme::ccs) return simulation.step(by_nscdd<Ccs<M>>(options));
            return simulation.step(by_nscdd<Dcs<M>>(options));
        }();
        const SolveReport& solve = report.solve;
        INFO(solver.name() << ", step " << simulation.steps());
        CAPTURE(solve.iterations, solve.residual, solve.velocity_error, solve.energy_gain, solve.gap_error,
                solve.distance);
        REQUIRE(solve.converged);
        return report;
    }

    // All grains by ascending id.
    std::vector<Grain<M>> grains() const {
        std::vector<Grain<M>> all;
        for (const auto& gathered : gather_grains(simulation)) all.push_back(gathered.grain);
        return all;
    }

    Solver solver;
    SolveOptions options{
        .tolerance = 1e-10, .bounds = {.max_penetration = 1e-9}, .check_every = 10, .max_iterations = 500000};
    InProcess comm;
    Simulation<M> simulation;
};

}  // namespace nscdd::test
