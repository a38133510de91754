#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "nscdd/core/model.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// One disk or sphere, as it is between two steps.
template <class M>
struct Grain {
    int id = 0;          ///< number, the same in every copy and unique in the scene
    int material = 0;    ///< row of Materials
    double radius = 0;   ///< [m]
    double mass = 0;     ///< of the whole grain, never split here; infinite: it is fixed [kg]
    double inertia = 0;  ///< about the centre, never split here; of a fixed one infinite [kg m^2]
    typename M::Vec position = M::Vec::Zero();            ///< of the centre [m]
    typename M::Velocity velocity = M::Velocity::Zero();  ///< translations [m/s], then spins [rad/s]
    typename M::Velocity load = M::Velocity::Zero();      ///< constant external force and torque [N, N m]

    /// Whether nothing moves it: neither contacts nor gravity.
    bool fixed() const { return std::isinf(mass); }

    /// Energy of translation and spin [J].
    double kinetic_energy() const {
        if (fixed()) return 0;
        const double linear = mass * velocity.template head<M::dim>().squaredNorm();
        return 0.5 * (linear + inertia * velocity.template tail<M::spins>().squaredNorm());
    }
};

/// A solid disk (density [kg/m^2]) or sphere (density [kg/m^3]) at rest; radius and position of the centre [m].
template <class M>
Grain<M> make_grain(int id, double radius, double density, const typename M::Vec& position, int material = 0) {
    Grain<M> grain;
    grain.id = id;
    grain.material = material;
    grain.radius = radius;
    const double r2 = radius * radius;
    grain.mass = density * std::numbers::pi * r2 * (M::dim == 3 ? 4.0 / 3.0 * radius : 1.0);
    grain.inertia = grain.mass * r2 * (M::dim == 3 ? 0.4 : 0.5);
    grain.position = position;
    return grain;
}

/// Fixes a grain: it has infinite mass, and no motion. Two fixed grains have no contact, so they may overlap.
template <class M>
void fix(Grain<M>& grain) {
    grain.mass = grain.inertia = std::numeric_limits<double>::infinity();
    grain.velocity.setZero();
    grain.load.setZero();
}

}}  // namespace nscdd::NSCDD_ABI
