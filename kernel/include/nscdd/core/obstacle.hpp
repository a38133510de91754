#pragma once

#include <cmath>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/core/path.hpp"
#include "nscdd/core/surface.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A body of facets or a cylinder that grains cannot pass. It rests, or its motion is a function of time.
/// ```
/// nscdd::Obstacle<Disks> drum{.surface = nscdd::make_surface<Disks>(nscdd::Cylinder<Disks>{.radius = 5})};
/// drum.turn.rate = 0.5;
/// settings.obstacles.push_back(drum);
/// ```
template <class M>
struct Obstacle {
    /// A steady turn about an axis.
    struct Rotation {
        typename M::Vec centre = M::Vec::Zero();  ///< a point of the axis at time 0; it moves along the path [m]
        typename M::Vec axis = M::Vec::Unit(M::dim - 1);  ///< unit; in 2D the axis stands on the plane
        double rate = 0;                                  ///< [rad/s]; positive is anticlockwise
    };

    /// Where it is at time 0, of make_surface(). It is shared by copies of the obstacle.
    std::shared_ptr<const detail::Surface<M>> surface;
    int material = 0;        ///< row of Materials
    detail::Path<M> path{};  ///< of all its points, besides the turn
    Rotation turn{};         ///< it is turned first, then moved

    /// Whether it moves.
    bool moves() const { return path || turn.rate != 0; }
};

namespace detail {

/// Where an obstacle is at one time: place of a point that was at x at time 0.
template <class M>
struct Frame {
    typename M::Gradient turn = M::Gradient::Identity();  ///< a rotation
    typename M::Vec shift = M::Vec::Zero();               ///< after it [m]
    bool turned = false;                                  ///< whether there is a rotation

    /// Of an obstacle at a time [s].
    static Frame at(const Obstacle<M>& obstacle, double time) {
        Frame frame;
        if (obstacle.path) frame.shift = obstacle.path(time);
        if (obstacle.turn.rate == 0) return frame;
        const double angle = obstacle.turn.rate * time, c = std::cos(angle), s = std::sin(angle);
        if constexpr (M::dim == 2) {
            frame.turn << c, -s, s, c;
        } else {
            const auto& k = obstacle.turn.axis;
            for (int d = 0; d < 3; ++d) {
                const typename M::Vec e = M::Vec::Unit(d);
                frame.turn.col(d) = c * e + s * typename M::Vec(cross(k, e)) + (1 - c) * k[d] * k;
            }
        }
        frame.shift += obstacle.turn.centre - frame.turn * obstacle.turn.centre;
        frame.turned = true;
        return frame;
    }
    /// The place now of a point that was at x.
    typename M::Vec place(const typename M::Vec& x) const {
        if (!turned) return x + shift;
        return turn * x + shift;
    }
    /// Where the point was that is at x now.
    typename M::Vec origin(const typename M::Vec& x) const {
        if (!turned) return x - shift;
        return turn.transpose() * (x - shift);
    }
};

/// Throws std::invalid_argument for an obstacle that no scene can have, and names its index. `materials` is their
/// number.
template <class M>
void check_obstacles(std::span<const Obstacle<M>> obstacles, int materials) {
    for (const auto& obstacle : obstacles) {
        std::string name = "obstacle ";
        name += std::to_string(&obstacle - obstacles.data());
        if (!obstacle.surface) throw std::invalid_argument(name += ": it has no surface");
        if (obstacle.material < 0 || obstacle.material >= materials)
            throw std::invalid_argument(name += ": material is not valid");
        if (!std::isfinite(obstacle.turn.rate) || !obstacle.turn.centre.allFinite() ||
            !(std::abs(obstacle.turn.axis.norm() - 1) < 1e-9))
            throw std::invalid_argument(name += ": a turn needs a finite rate and place, and a unit axis");
        if constexpr (M::dim == 3)
            if (const auto& c = obstacle.surface->cylinder(); c && obstacle.turn.rate != 0 && std::isinf(c->length) &&
                                                              cross(c->axis, obstacle.turn.axis).norm() > 1e-12)
                throw std::invalid_argument(name += ": a cylinder without ends turns about an axis along its own");
    }
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
