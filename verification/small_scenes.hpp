// Small scenes that tests share, the same numbers on every machine, and what a run of one leaves behind.
#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <type_traits>

#include "every_model.hpp"
#include "smooth.hpp"

namespace scenes {

using nscdd::Buffer;
using nscdd::Grain;
using nscdd::Wall;

template <class M>
struct Scene {
    std::string name;
    nscdd::SimulationSettings<M> settings{.materials = nscdd::smooth<M>()};
    std::vector<Grain<M>> grains;
    std::vector<nscdd::PairImpulse<M>> impulses;  // warm start of the first step
};

constexpr double pitch = 1.05;  // of the lattice

// 64 grains a little apart on a disturbed lattice: 8 x 8 disks or 4 x 4 x 4 spheres. Radii from 0.5/ratio to 0.5.
template <class M>
std::vector<Grain<M>> lattice(double ratio) {
    std::mt19937 random(7);  // its numbers are fixed by the standard, those of distributions are not
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    constexpr int edge = M::dim == 2 ? 8 : 4, count = 64;
    std::vector<Grain<M>> grains;
    for (int id = 0; id < count; ++id) {
        typename M::Vec x;
        for (int d = 0, rest = id; d < M::dim; ++d, rest /= edge)
            x[d] = pitch * (rest % edge + 0.5) + 0.05 * (uniform() - 0.5);
        const double radius = 0.5 / (1 + (ratio - 1) * uniform());
        grains.push_back(nscdd::make_grain<M>(id, radius, 1.0, x));
    }
    return grains;
}

// Walls around the lattice in pairs, low and high, axis by axis; friction 0.3 between all.
template <class M>
Scene<M> boxed(const char* name, double ratio) {
    Scene<M> scene;
    scene.name = name;
    scene.grains = lattice<M>(ratio);
    scene.settings.h = 1e-2;
    scene.settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    const double edge = pitch * (M::dim == 2 ? 8 : 4);
    for (int d = 0; d < M::dim; ++d)
        for (double sign : {1.0, -1.0}) {
            Wall<M> wall;
            wall.normal = sign * M::Vec::Unit(d);
            wall.offset = sign > 0 ? 0.0 : -edge;
            scene.settings.walls.push_back(wall);
        }
    return scene;
}

template <class M>
void drive(Wall<M>& wall, double force, double mass) {
    wall.driven = true;
    wall.force = force;
    wall.mass = mass;
}

// Falls on the floor. Driven: a lid follows and presses.
template <class M>
Scene<M> heap(bool driven, double ratio = 1.2) {
    Scene<M> scene = boxed<M>(driven ? "heap under a lid" : "heap", ratio);
    scene.settings.gravity[M::dim - 1] = -1;
    if (driven) drive(scene.settings.walls.back(), 5.0, 10.0);
    return scene;
}

// No gravity: the high walls close in, by forces or at a prescribed speed; the first wall also slides.
template <class M>
Scene<M> squeezed_box(bool driven, double ratio = 1.5) {
    Scene<M> scene = boxed<M>(driven ? "box squeezed by forces" : "squeezed box", ratio);
    for (std::size_t w = 1; w < scene.settings.walls.size(); w += 2) {
        Wall<M>& wall = scene.settings.walls[w];
        if (driven)
            drive(wall, 20.0, 30.0);
        else
            wall.velocity = -0.07 * wall.offset * wall.normal;
    }
    scene.settings.walls[0].velocity[1] = 0.1;
    return scene;
}

// In a cell that repeats along all axes: forces that add up to nothing press the grains on each other, and all of them
// drift across its sides, one after 20 steps.
template <class M>
Scene<M> repeating_cell(double ratio = 1.3) {
    Scene<M> scene;
    scene.name = "cell that repeats";
    scene.grains = lattice<M>(ratio);
    scene.settings.h = 2e-2;
    scene.settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    scene.settings.cell.periodic.fill(true);
    scene.settings.cell.size.setConstant(pitch * (M::dim == 2 ? 8 : 4));
    std::mt19937 random(3);
    typename M::Vec sum = M::Vec::Zero();
    for (auto& grain : scene.grains)
        for (int d = 0; d < M::dim; ++d)
            sum[d] += grain.load[d] = 20 * (static_cast<double>(random()) / 4294967296.0 - 0.5);
    double mass = 0;
    for (const auto& grain : scene.grains) mass += grain.mass;
    for (auto& grain : scene.grains) {
        grain.load.template head<M::dim>() -= grain.mass / mass * sum;
        grain.velocity.template head<M::dim>() =
            M::Vec::LinSpaced(M::dim, 1, 0.3) * scene.settings.cell.size[0] / (20 * scene.settings.h);
    }
    return scene;
}

// The same without a drift, sheared and compressed by the flow of its cell.
template <class M>
Scene<M> flowing_cell(double ratio = 1.3) {
    Scene<M> scene = repeating_cell<M>(ratio);
    scene.name = "cell that flows";
    for (auto& grain : scene.grains) grain.velocity.setZero();
    auto& gradient = scene.settings.cell.gradient;
    gradient.diagonal().setConstant(-0.08);
    gradient(0, 1) = 1.5;
    gradient(M::dim - 2, M::dim - 1) -= 0.7;
    return scene;
}

// The same, pressed by a stress on all sides while it is sheared.
template <class M>
Scene<M> pressed_cell(double ratio = 1.3) {
    Scene<M> scene = flowing_cell<M>(ratio);
    scene.name = "cell pressed by a stress";
    auto& cell = scene.settings.cell;
    cell.gradient.diagonal().setZero();
    cell.driven.fill(true);
    cell.stress = M::Vec::LinSpaced(M::dim, 12, 8);
    double mass = 0;
    for (auto& grain : scene.grains) {
        mass += grain.mass;
        grain.load.setZero();
    }
    cell.mass = 6 * mass;
    return scene;
}

// What a run leaves; grains and contacts on the process that hosts rank 0 only.
template <class M>
struct Outcome {
    std::vector<nscdd::GatheredGrain<M>> grains;
    std::vector<nscdd::GatheredContact<M>> contacts;
    std::vector<Wall<M>> walls;
    std::vector<nscdd::StepReport> steps;
    nscdd::Measures<M> measures;           // of the last step
    nscdd::Communicator::Traffic traffic;  // of the steps, this process

    std::vector<int> iterations() const {
        std::vector<int> counts;
        for (const auto& step : steps) counts.push_back(step.solve.iterations);
        return counts;
    }
    bool converged() const {
        return std::all_of(steps.begin(), steps.end(), [](const auto& step) { return step.solve.converged; });
    }
    const nscdd::StepReport& last() const { return steps.back(); }

    // All numbers that must be the same to the last bit: on every process,
    Buffer history() const {
        Buffer numbers;
        for (const auto& s : steps)
            numbers.insert(numbers.end(), {double(s.solve.iterations), s.solve.residual, s.solve.penetration,
                                           double(s.attempts), s.contacts, s.interface_grains, s.free_norm});
        for (const auto& wall : walls) numbers.insert(numbers.end(), {wall.offset, wall.speed});
        return numbers;
    }
    // and where rank 0 is.
    Buffer state() const {
        Buffer numbers;
        const auto put = [&](const auto& v) { numbers.insert(numbers.end(), v.data(), v.data() + v.size()); };
        for (const auto& g : grains) {
            numbers.insert(numbers.end(), {double(g.grain.id), double(g.subdomain), double(g.multiplicity)});
            put(g.grain.position), put(g.grain.velocity);
        }
        for (const auto& c : contacts) {
            numbers.insert(numbers.end(), {double(c.i), double(c.j), double(c.subdomain), c.gap});
            put(c.normal), put(c.impulse);
        }
        return numbers;
    }
};

// What this process passes of a scene: each rank has every so-manyth row.
template <class T>
std::vector<T> share(const std::vector<T>& rows, const nscdd::Communicator& comm) {
    std::vector<T> mine;
    const std::span<const int> ranks = comm.ranks();
    for (std::size_t k = 0; k < rows.size(); ++k)
        if (std::ranges::binary_search(ranks, static_cast<int>(k) % comm.size())) mine.push_back(rows[k]);
    return mine;
}

template <class M>
Outcome<M> run(const Scene<M>& scene, nscdd::Communicator& comm, int steps, const nscdd::AnyStepSolver<M>& solve) {
    nscdd::Simulation<M> simulation(comm, scene.settings, share(scene.grains, comm), share(scene.impulses, comm));
    Outcome<M> outcome;
    const nscdd::Communicator::Traffic before = comm.traffic();
    for (int k = 0; k < steps; ++k) outcome.steps.push_back(simulation.step(solve));
    outcome.traffic = comm.traffic();
    outcome.traffic.messages -= before.messages;
    outcome.traffic.bytes -= before.bytes;
    outcome.measures = nscdd::measure(simulation);
    outcome.grains = nscdd::gather_grains(simulation);
    outcome.contacts = nscdd::gather_contacts(simulation);
    outcome.walls = simulation.settings().walls;
    return outcome;
}

// The same, in process on any number of ranks, with a fresh scheme.
template <template <class, class> class Scheme, class Gluing, class M>
Outcome<M> run_nscdd(const Scene<M>& scene, int ranks, int steps, const nscdd::SolveOptions& options, int threads = 1) {
    nscdd::InProcess comm(ranks, threads);
    return run(scene, comm, steps, nscdd::by_nscdd<Scheme<M, Gluing>>(options));
}
template <class M>
Outcome<M> run_nlgs(const Scene<M>& scene, int steps, const nscdd::SolveOptions& options) {
    nscdd::InProcess comm(1);
    return run(scene, comm, steps, nscdd::by_nlgs<M>(options));
}

// The scene after some steps of the reference: grains, walls and impulses from which others go on.
template <class M>
Scene<M> settled(Scene<M> scene, int steps, const nscdd::SolveOptions& options = {}) {
    const Outcome<M> outcome = run_nlgs(scene, steps, options);
    scene.settings.walls = outcome.walls;
    for (const auto& g : outcome.grains) scene.grains[static_cast<std::size_t>(g.grain.id)] = g.grain;
    for (const auto& c : outcome.contacts) {
        if constexpr (M::friction)
            scene.impulses.push_back({c.i, c.j, c.impulse});
        else
            scene.impulses.push_back({c.i, c.j, typename M::Impulse{c.impulse.dot(c.normal)}});
    }
    return scene;
}

// Both scenes when they have become dense: networks of contacts that reach over all subdomains, and still move.
template <class M>
std::vector<Scene<M>> dense_scenes(std::initializer_list<bool> driven = {false, true}) {
    std::vector<Scene<M>> scenes;
    for (const bool by_forces : driven) {
        scenes.push_back(settled(heap<M>(by_forces), 200));
        scenes.push_back(settled(squeezed_box<M>(by_forces), 200));
    }
    for (auto& scene : scenes) scene.settings.broad_phase_every = 3;  // so that short runs change the decomposition
    return scenes;
}

// Where two buffers differ first in any bit, or -1 if nowhere.
inline std::ptrdiff_t first_difference(const Buffer& a, const Buffer& b) {
    const auto same = [](double x, double y) {
        return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
    };
    const auto at = std::mismatch(a.begin(), a.end(), b.begin(), b.end(), same);
    return at.first == a.end() && at.second == b.end() ? -1 : at.first - a.begin();
}

}  // namespace scenes
