/// @file
/// The straight paths of two bodies within a step. They tell when the bodies come nearer than so much, and whether they
/// pass each other.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Time at which two spheres at `d` from each other, whose relative velocity is `w`, come nearer than `least`: infinity
/// if they do not within `time`, or separate.
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

/// Time at which the overlap of a grain and a plane exceeds `allowed`: infinity if it does not within `time`.
inline double when_deeper(double gap, double closing, double allowed, double time) {
    constexpr double never = std::numeric_limits<double>::infinity();
    if (!(closing > 0)) return never;
    const double t = (std::max)(0.0, (gap + allowed) / closing);
    return t < time ? t : never;
}

/// Whether a contact would deflect two spheres that pass each other: at `d` from each other, their relative velocity w
/// would close their gap by more than all of it along the normal, v_n < -bias, but does not take them within `least`,
/// the sum of their radii, in `time`. Only where the contact takes more than `negligible` [m] of their way.
template <class Vec>
bool pass_by(const Vec& d, const Vec& w, double normal_speed, double bias, double least, double time,
             double negligible) {
    const double taken = -normal_speed - bias;
    return taken > 0 && taken * time > negligible && !(when_nearer(d, w, least, time) < time);
}

/// What a contact may take from the way of two grains that pass each other in a step (METHOD.md, section 2.4): a share
/// of the smaller radius; where other impulses act too, a share of the way.
constexpr double passing_way = 1e-5, passing_share = 0.01;

}}}  // namespace nscdd::NSCDD_ABI::detail
