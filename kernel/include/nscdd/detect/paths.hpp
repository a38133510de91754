// The straight paths of two bodies within a step: when they come nearer than so much, and whether they pass each other.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "nscdd/core/abi.hpp"

namespace nscdd::inline NSCDD_ABI {

namespace detail {

// Time at which two spheres at `d` from each other, whose relative velocity is `w`, come nearer than `least`: infinity
// if they do not within `time`, or separate.
template <class Vec>
double when_nearer(const Vec& d, const Vec& w, double least, double time) {
    constexpr double never = std::numeric_limits<double>::infinity();
    const double closing = -d.dot(w), speed2 = w.squaredNorm(), beyond = d.squaredNorm() - least * least;
    if (!(closing > 0) || !(least > 0)) return never;
    if (beyond <= 0) return 0;
    const double root2 = closing * closing - speed2 * beyond;
    if (root2 < 0) return never;
    const double t = beyond / (closing + std::sqrt(root2));
    return t < time ? t : never;
}

// Time at which the overlap of a grain and a plane exceeds `allowed`: infinity if it does not within `time`.
inline double when_deeper(double gap, double closing, double allowed, double time) {
    constexpr double never = std::numeric_limits<double>::infinity();
    if (!(closing > 0)) return never;
    const double t = (std::max)(0.0, (gap + allowed) / closing);
    return t < time ? t : never;
}

// Whether a contact along d would deflect two spheres that pass each other: at `d` from each other, their relative
// velocity w would close their gap along d, and by `deep` more [m], but does not take them within `least`, the sum of
// their radii, in `time`.
template <class Vec>
bool pass_by(const Vec& d, const Vec& w, double deep, double least, double time) {
    return deep > 0 && !(when_nearer(d, w, least, time) < time);
}

// Direction from one to the other where they are nearest within `time`; where they would touch, `least` from each
// other, that of the path beside it that grazes. Paths that stay beyond the plane across it do not touch.
template <class Vec>
Vec normal_of_approach(const Vec& d, const Vec& w, double least, double time) {
    const Vec nearest = d + std::clamp(-d.dot(w) / w.squaredNorm(), 0.0, time) * w;
    if (nearest.squaredNorm() >= least * least) return nearest.normalized();
    const Vec along = d.normalized(), across = w - w.dot(along) * along;
    const double cosine = least / d.norm();
    return (cosine * along + std::sqrt(1 - cosine * cosine) * across.normalized()).normalized();
}

}  // namespace detail

}  // namespace nscdd
