/// @file
/// The law as a fixed point, r = P(r - rho u) for every rho > 0, and the derivative of P. Newton methods need both.
#pragma once

#include "nscdd/core/abi.hpp"

#include <cmath>

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// P at one point, of one contact. `size`: components of an impulse; 1 is the normal one alone, without friction.
template <int size>
struct ProjectedImpulse {
    using Vec = Eigen::Matrix<double, size, 1, Eigen::DontAlign>;       ///< of an impulse, or of a normal
    using Block = Eigen::Matrix<double, size, size, Eigen::DontAlign>;  ///< from impulse to impulse

    Vec value = Vec::Zero();           ///< P(z) [N s]
    Block derivative = Block::Zero();  ///< dP/dz, an element of the generalised Jacobian [1]
    bool open = true;                  ///< whether the contact opens: both are zero
};

/// Coulomb's law: z_n cut at 0, then z_t back to the disk of radius mu z_n [AlartCurnier91]. n: unit, in the axes of z.
/// The derivative is not symmetric where the contact slides: r_t follows r_n, not the other way round.
template <int size>
ProjectedImpulse<size> project_coulomb(const typename ProjectedImpulse<size>::Vec& z,
                                       const typename ProjectedImpulse<size>::Vec& n, double mu) {
    using Block = typename ProjectedImpulse<size>::Block;
    ProjectedImpulse<size> p;
    const double normal = z.dot(n);
    if (!(normal > 0)) return p;
    p.open = false;
    p.value = z;
    p.derivative = Block::Identity();
    if constexpr (size > 1) {
        const auto trial = (z - normal * n).eval();
        const double length = trial.norm(), limit = mu * normal;
        if (length <= limit) return p;  // sticks
        const auto t = (trial / length).eval();
        const Block nn = n * n.transpose(), tt = t * t.transpose(), tn = t * n.transpose();
        p.value = normal * n + limit * t;
        p.derivative = nn + mu * tn + limit / length * (Block::Identity() - nn - tt);
    }
    return p;
}

/// The Euclidean projection on the cone |r_t| <= mu r_n: the law of u + mu |u_t| n [DeSaxce98]. With |u_t| frozen the
/// problem is convex, and the derivative symmetric and positive.
template <int size>
ProjectedImpulse<size> project_cone(const typename ProjectedImpulse<size>::Vec& z,
                                    const typename ProjectedImpulse<size>::Vec& n, double mu) {
    using Block = typename ProjectedImpulse<size>::Block;
    if constexpr (size == 1) return project_coulomb<size>(z, n, mu);
    ProjectedImpulse<size> p;
    const double normal = z.dot(n);
    const auto trial = (z - normal * n).eval();
    const double length = trial.norm();
    if (normal + mu * length <= 0 || !std::isfinite(normal)) return p;
    p.open = false;
    p.value = z;
    p.derivative = Block::Identity();
    if (length <= mu * normal) return p;
    const auto t = (trial / length).eval();
    const auto edge = (n + mu * t).eval();
    const double along = (normal + mu * length) / (1 + mu * mu);
    const Block nn = n * n.transpose(), tt = t * t.transpose(), ee = edge * edge.transpose();
    p.value = along * edge;
    p.derivative = ee / (1 + mu * mu) + mu * along / length * (Block::Identity() - nn - tt);
    return p;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
