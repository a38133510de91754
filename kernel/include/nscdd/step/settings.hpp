/// @file
/// Settings of a simulation, and checks of them. All checks throw std::invalid_argument with one line.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "nscdd/core/cell.hpp"
#include "nscdd/core/grain.hpp"
#include "nscdd/core/materials.hpp"
#include "nscdd/core/obstacle.hpp"
#include "nscdd/core/wall.hpp"
#include "nscdd/decompose/serialise.hpp"
#include "nscdd/partition/grid.hpp"
#include "nscdd/subdomain/halo.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// An acceleration, zero unless it is given. Another number of components than the model has is refused in a sentence.
template <class M>
struct Acceleration : M::Vec {
    Acceleration() : M::Vec(M::Vec::Zero()) {}
    /// Takes a vector of Eigen [m/s^2].
    template <class Derived>
    Acceleration(const Eigen::MatrixBase<Derived>& a) : M::Vec(a) {}
    /// Takes the components [m/s^2].
    template <class... Component>
        requires(sizeof...(Component) > 0 && (std::is_arithmetic_v<Component> && ...))
    Acceleration(Component... a) {
        constexpr bool fits = sizeof...(Component) == M::dim;
        static_assert(fits,
                      "nscdd: gravity is {0, -9.81} in 2D and {0, 0, -9.81} in 3D, a component for each dimension");
        if constexpr (fits) static_cast<typename M::Vec&>(*this) = typename M::Vec(static_cast<double>(a)...);
    }
};

}  // namespace detail

/// All data of a scene beside its grains, and how it is stepped.
template <class M>
struct SimulationSettings {
    Cell<M> cell{};                           ///< along which axes the scene repeats; along none unless it is set
    std::vector<Wall<M>> walls{};             ///< their index is their name in messages and in GatheredContact
    std::vector<Obstacle<M>> obstacles{};     ///< their facets are numbered behind the walls (PlacedObstacles)
    Materials<M> materials{1};                ///< coefficients of the law for each pair of materials
    detail::Acceleration<M> gravity{};        ///< [m/s^2]
    double h = 0;                             ///< time step [s], has to be set
    double start_time = 0;                    ///< time of the scene when `steps_before` is 0 [s]
    std::int64_t steps_before = 0;            ///< steps of h made since then, before the simulation begins
    double theta = 0.5;                       ///< of the Moreau-Jean scheme, 0.5 to 1 in use
    int broad_phase_every = 10;               ///< steps between broad phases; sooner when grains have moved too far
    Partitioner<M> partition = by_grid<M>();  ///< deals space to subdomains; a regular grid as in the paper
    Multiplicity multiplicity = Multiplicity::minimal;  ///< which copies of a grain share its mass
    double largest_overlap = 0.1;                       ///< of a radius; more is an error
    bool may_be_empty = false;                          ///< no grains at the start are no mistake: some will come
};

/// The last broad phase. It decides which candidates there are, who owns them, in which order they are swept, and when
/// the next one comes. Beside grains, walls and impulses a step depends on nothing else.
template <class M>
struct BroadPhaseState {
    std::string kind;                        ///< of the partition
    Buffer partition;                        ///< numbers of the partition; empty: it is made anew
    double imbalance = 1;                    ///< of the partition when it was made (Partitioner)
    double skin = 0;                         ///< [m]
    int steps_since = 0;                     ///< steps made since
    std::vector<typename M::Vec> positions;  ///< of the grains that the process has, at the detection [m]
    std::vector<double> offsets;             ///< of the walls, at the detection [m]
    double time = 0;                         ///< of the scene then [s]; only obstacles need it
    Cell<M> cell{};                          ///< at the detection
    /// Of places by the flow of the cell since the detection (BroadPhase::stretch()).
    typename M::Gradient stretch = M::Gradient::Identity();
};

namespace detail {

/// Throws std::invalid_argument for a grain that no scene can have, and names its id. `materials` is their number.
template <class M>
void check_grains(std::span<const Grain<M>> grains, int materials) {
    for (const auto& g : grains) {
        const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
        const auto heavy = [&](double x) { return x > 0 && std::isinf(x) == g.fixed(); };
        const char* what = !positive(g.radius)                              ? "radius must be positive and finite"
                           : !heavy(g.mass)                                 ? "mass must be positive"
                           : M::friction && !heavy(g.inertia)               ? "inertia must be positive"
                           : g.fixed() && !g.velocity.isZero(0)             ? "velocity of a fixed grain must be 0"
                           : g.fixed() && !g.load.isZero(0)                 ? "load of a fixed grain must be 0"
                           : !std::isfinite(g.position.squaredNorm())       ? "position must be finite"
                           : !g.velocity.allFinite() || !g.load.allFinite() ? "velocity and load must be finite"
                           : g.material < 0 || g.material >= materials      ? "material must be one that there is"
                           : g.id < 0                                       ? "id must not be negative"
                                                                            : nullptr;
        if (what) throw std::invalid_argument("grain " + std::to_string(g.id) + ": " + what);
    }
}

/// Throws std::invalid_argument for a wall that no scene can have, and names its index. `materials` is their number.
template <class M>
void check_walls(std::span<const Wall<M>> walls, int materials) {
    for (const auto& wall : walls) {
        const std::string name = "wall " + std::to_string(&wall - walls.data()) + ": ";
        if (!std::isfinite(wall.offset + wall.force + wall.mass + wall.speed) || !wall.velocity.allFinite())
            throw std::invalid_argument(name + "place, velocity, force or mass is not finite");
        if (wall.material < 0 || wall.material >= materials)
            throw std::invalid_argument(name + "material is not valid");
        if (wall.driven && !(wall.mass > 0))
            throw std::invalid_argument(name + "it is driven and needs a positive mass");
        if (wall.driven && wall.path) throw std::invalid_argument(name + "a force drives it, so it has no path");
        if (!(std::abs(wall.normal.norm() - 1) < 1e-9))
            throw std::invalid_argument(name + "the normal must be a unit vector");
    }
}

/// Throws std::invalid_argument for settings that no scene can have, those of walls included.
template <class M>
void check_settings(const SimulationSettings<M>& settings) {
    if (!settings.gravity.allFinite()) throw std::invalid_argument("gravity is not finite");
    if (settings.h == 0) throw std::invalid_argument("the step h of the settings has not been set");
    if (!(settings.h > 0 && std::isfinite(settings.h)) || !(settings.theta >= 0 && settings.theta <= 1))
        throw std::invalid_argument("the step h must be positive and finite, and theta within [0, 1]");
    if (!(settings.largest_overlap >= 0)) throw std::invalid_argument("the largest overlap must not be negative");
    if (!std::isfinite(settings.start_time) || settings.steps_before < 0)
        throw std::invalid_argument("the time of the start must be finite, and the steps before it none or more");
    if (M::friction && !settings.materials.known())
        throw std::invalid_argument(
            "materials: no friction is known; call materials.set(0, 0, {friction, restitution})");
    check_walls<M>(settings.walls, settings.materials.count());
    check_obstacles<M>(settings.obstacles, settings.materials.count());
    if (!settings.obstacles.empty() && settings.cell.flows())
        throw std::invalid_argument("cell: one that flows has no obstacles");
    if (!settings.partition.make) throw std::invalid_argument("the partition cannot be made: `make` is empty");
}

/// Throws std::invalid_argument for an impulse that is not finite.
template <class M>
void check_impulses(std::span<const PairImpulse<M>> impulses) {
    for (const auto& p : impulses)
        if (!p.r.allFinite())
            throw std::invalid_argument("the impulse of grain " + std::to_string(p.i) + " is not finite");
}

/// Throws std::invalid_argument for data that are no broad phase of so many grains and walls.
template <class M>
void check_broad_phase(const BroadPhaseState<M>& broad_phase, std::size_t grains, std::size_t walls) {
    if (broad_phase.positions.size() != grains || broad_phase.offsets.size() != walls)
        throw std::invalid_argument("the last broad phase is of other grains or walls");
    if (!std::all_of(broad_phase.positions.begin(), broad_phase.positions.end(),
                     [](const auto& x) { return std::isfinite(x.squaredNorm()); }) ||
        !std::all_of(broad_phase.offsets.begin(), broad_phase.offsets.end(), [](double x) { return std::isfinite(x); }))
        throw std::invalid_argument("a position or offset of the last broad phase is not finite");
    if (!(broad_phase.imbalance >= 1)) throw std::invalid_argument("the imbalance of a partition is 1 or more");
    if (!(broad_phase.skin > 0 && std::isfinite(broad_phase.skin)) || broad_phase.steps_since < 0)
        throw std::invalid_argument("the last broad phase needs a positive skin and a number of steps since");
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
