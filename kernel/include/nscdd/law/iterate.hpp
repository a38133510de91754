#pragma once

#include <vector>

#include "nscdd/law/kinematics.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Velocities and impulses of a problem at one moment of its iteration.
template <class M>
struct Iterate {
    /// Of ContactProblem::bodies: translations [m/s], then spins [rad/s].
    std::vector<typename M::Velocity> velocities;
    std::vector<double> speeds;                 ///< of ContactProblem::walls: WallBody::speed [m/s]
    std::vector<typename M::Impulse> impulses;  ///< of contacts, in the order of each_contact() [N s]

    /// Those of the problem as it is.
    void take(const ContactProblem<M>& problem) {
        velocities.clear(), speeds.clear(), impulses.clear();
        for (const auto& body : problem.bodies) velocities.push_back(body.v);
        for (const auto& wall : problem.walls) speeds.push_back(wall.speed);
        each_contact(problem, [this](const Contact<M>& c, auto) { impulses.push_back(c.r); });
    }
};

}}}  // namespace nscdd::NSCDD_ABI::detail
