/// @file
/// The couple of a contact whose law has one: its exact answer for the spins that friction leaves, and the work that it
/// fails to take away.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "nscdd/core/contact_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// What the couple of a contact meets (METHOD.md, section 3.2).
struct SpinBlock {
    double inverse = 0;   ///< omega/W_s [kg m^2]
    double coupling = 0;  ///< l_i/I_i - l_j/I_j: spin by friction [1/(kg m)]
};

/// The same couple cut back to what the law allows beside this r_n [N s]: along n, and across it.
template <class M>
typename M::Spin allowed_couple(const typename M::Spin& trial, const typename M::Vec& normal, double rn,
                                const typename M::Law::Coefficients& k) {
    const double rolling = M::Law::rolling_limit(rn, k);
    if constexpr (M::dim == 3) {
        const double twist = trial.dot(normal), twisting = M::Law::twisting_limit(rn, k);
        const typename M::Spin roll = trial - twist * normal;
        const double square = roll.squaredNorm();
        const double scale = square > rolling * rolling ? rolling / std::sqrt(square) : 1.0;
        return scale * roll + (std::max)(-twisting, (std::min)(twisting, twist)) * normal;
    } else {
        (void)normal;
        return typename M::Spin{(std::max)(-rolling, (std::min)(rolling, trial[0]))};
    }
}

/// The couple of the answer [N m s]. spin: relative to each other with the couple as it is, after friction [rad/s].
template <class M>
typename M::Spin solve_couple(const Contact<M>& c, const typename M::Spin& spin, double rn, const SpinBlock& block) {
    const typename M::Spin trial = couple_of<M>(c.r) - block.inverse * spin;
    return allowed_couple<M>(trial, c.normal, rn, c);
}

/// The most that couples could take from this relative spin, as the limit times |v_t| of friction [J].
template <class M>
double couple_limit(const Contact<M>& c, const typename M::Spin& spin, double rn) {
    const double rolling = M::Law::rolling_limit(rn, c.coefficients());
    if constexpr (M::dim == 3) {
        const double twist = spin.dot(c.normal);
        return rolling * (spin - twist * c.normal).norm() +
               M::Law::twisting_limit(rn, c.coefficients()) * std::abs(twist);
    } else {
        return rolling * std::abs(spin[0]);
    }
}

/// The least change of a slip or spin after which the impulse that opposes it satisfies its law: none beyond what an
/// impulse as large as `limit` may oppose.
template <class Vector>
Vector held_miss(const Vector& impulse, const Vector& slip, double limit) {
    if (!(limit > 0)) return Vector::Zero();
    const double along = impulse.dot(slip), square = impulse.squaredNorm();
    if (along < 0 && square >= limit * limit * (1 - 1e-9)) return along / square * impulse - slip;
    return -slip;
}

/// The part of law_miss() of spins [rad/s].
template <class M>
typename M::Spin couple_miss(const Contact<M>& c, const typename M::Spin& spin, double rn) {
    const typename M::Spin couple = couple_of<M>(c.r);
    const double rolling = M::Law::rolling_limit(rn, c.coefficients());
    if constexpr (M::dim == 3) {
        const typename M::Spin twist = couple.dot(c.normal) * c.normal, twisting = spin.dot(c.normal) * c.normal;
        return held_miss<typename M::Spin>(twist, twisting, M::Law::twisting_limit(rn, c.coefficients())) +
               held_miss<typename M::Spin>(couple - twist, spin - twisting, rolling);
    } else {
        return held_miss<typename M::Spin>(couple, spin, rolling);
    }
}

}}}  // namespace nscdd::NSCDD_ABI::detail
