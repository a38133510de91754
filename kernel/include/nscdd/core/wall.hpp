#pragma once

#include "nscdd/core/path.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A plane that bounds the sample. It rests, moves as prescribed, or a force pushes it along its normal.
/// ```
/// wall.path = nscdd::oscillation<Model>({0, 0.01}, 20);  // to and fro by 1 cm, 20 times a second
/// ```
template <class M>
struct Wall {
    int material = 0;                           ///< row of Materials
    typename M::Vec normal = M::Vec::UnitX();   ///< unit, into the sample
    double offset = 0;                          ///< normal . (any point of the plane) [m]
    typename M::Vec velocity = M::Vec::Zero();  ///< prescribed [m/s]; of a driven wall the tangential part only
    /// Where it goes, in place of `velocity`, which Simulation then sets in each step: the mean from this detection of
    /// contacts to the next.
    detail::Path<M> path{};
    typename M::Vec change = M::Vec::Zero();  ///< of that mean since the step before [m/s]; Simulation sets it
    bool driven = false;                      ///< pushed by a force, else at rest or as prescribed
    double force = 0;                         ///< driven: along the normal, positive pushes into the sample [N]
    double mass = 0;                          ///< driven: > 0 [kg]
    double speed = 0;                         ///< driven: along the normal [m/s], an unknown of each step

    /// Distance of a point from the plane [m], positive on the side of the sample.
    double distance(const typename M::Vec& point) const { return normal.dot(point) - offset; }
    /// Velocity along the normal [m/s], positive into the sample.
    double normal_speed() const { return velocity.dot(normal) + speed; }
};

}}  // namespace nscdd::NSCDD_ABI
