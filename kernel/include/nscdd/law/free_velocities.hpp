#pragma once

#include <vector>

#include "nscdd/law/kinematics.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// V_free, the velocities that a problem's bodies have without contacts. Contacts change them.
template <class M>
struct FreeVelocities {
    std::vector<typename M::Velocity> bodies;  ///< of ContactProblem::bodies: translations [m/s], then spins [rad/s]
    std::vector<double> walls;                 ///< of ContactProblem::walls: WallBody::speed [m/s]
};

/// V_free = V - M^-1 H r, from velocities that are consistent with the impulses. It costs less than a sweep.
template <class M>
FreeVelocities<M> free_velocities(ContactProblem<M> problem) {
    for (const auto& c : problem.contacts) apply_impulse(problem, c, typename M::Impulse(-c.r), BetweenGrains{});
    for (const auto& c : problem.wall_contacts) apply_impulse(problem, c, typename M::Impulse(-c.r), WithWall{});
    FreeVelocities<M> free;
    for (const auto& body : problem.bodies) free.bodies.push_back(body.v);
    for (const auto& wall : problem.walls) free.walls.push_back(wall.speed);
    return free;
}

/// The change that contacts make to the velocities. It is the same in every frame of reference that moves uniformly.
/// Sums of split masses over the copies of a body are those of the whole body.
struct VelocityChange {
    double energy = 0;   ///< |V - V_free|_M^2, driven walls included: sum of m c^2, c the change of one body [J]
    double quartic = 0;  ///< sum of m c^4 [J m^2/s^2]

    /// Adds a body of this inverse mass [1/kg] that is changed by c; `square` is c^2 [m^2/s^2].
    void add(double inverse_mass, double square) {
        if (!(square > 0)) return;
        const double own = square / inverse_mass;
        energy += own;
        quartic += own * square;
    }
    /// Mean c^2 [m^2/s^2]. Each body is weighed by its share of the energy, so bodies that hardly change do not count.
    double mean_square() const { return quartic / energy; }
};

/// Adds driven walls, whose speeds in V_free are `free` [m/s]. Copies count on subdomains that have a contact with
/// them.
template <class M>
void add_wall_changes(const ContactProblem<M>& problem, const std::vector<double>& free, VelocityChange& total) {
    std::vector<char> touched(problem.walls.size(), 0);
    for (const auto& c : problem.wall_contacts) touched[static_cast<std::size_t>(c.j)] = 1;
    if (problem.flow && !problem.contacts.empty()) std::fill(touched.begin(), touched.end(), 1);
    for (std::size_t w = 0; w < problem.walls.size(); ++w) {
        const double change = problem.walls[w].speed - free[w];
        if (touched[w] && problem.walls[w].inv_mass > 0) total.add(problem.walls[w].inv_mass, change * change);
    }
}

/// The change of one problem's velocities by its contacts. Velocities must be glued (METHOD.md, section 5.2).
template <class M>
VelocityChange velocity_change(const ContactProblem<M>& problem, const FreeVelocities<M>& free) {
    VelocityChange total;
    for (std::size_t g = 0; g < problem.bodies.size(); ++g) {
        const Body<M>& body = problem.bodies[g];
        const typename M::Velocity change = body.v - free.bodies[g];
        double square = change.template head<M::dim>().squaredNorm();
        if constexpr (M::friction)
            square += body.inv_mass / body.inv_inertia * change.template tail<M::spins>().squaredNorm();
        total.add(body.inv_mass, square);
    }
    add_wall_changes(problem, free.walls, total);
    return total;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
