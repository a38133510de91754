/// @file
/// The exact answer of one contact whose block of W is full. One scalar equation is solved inside a bracket.
///
/// For disks and spheres the block is diagonal, and solve_contact() has the answer in closed form. Contacts with a
/// couple have rolling_contact().
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "nscdd/core/delassus_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// r with 0 <= u_n perp r_n >= 0, |r_t| <= mu r_n and u_t opposed to r_t where it slides, u = W r + q.
///   w   (dim, dim) positive definite, symmetric or not; the tangents may be without mobility, the normal may not
///   q   (dim) velocity that this contact has without its own impulse
///
/// With u_n = 0 eliminated, an impulse that sticks or slides is r_t = -(S + a)^-1 s for some a >= 0, the ratio
/// |u_t|/|r_t|, with S = W_tt - W_tn W_nt/W_nn and s = q_t - W_tn q_n/W_nn [Bonnefon11]. Sticking is a = 0. If that
/// leaves the cone, mu r_n - |r_t| is negative at a = 0 and positive above a bound known beforehand: there is an answer
/// in between, whatever the block, and Newton with bisection cannot miss it. The quartic polynomial in a is never
/// formed. If q_n >= 0 the contact opens, also where friction would allow another answer.
template <int dim>
typename DelassusProblem<dim>::Vec one_contact(const typename DelassusProblem<dim>::Block& w,
                                               const typename DelassusProblem<dim>::Vec& q, double mu) {
    using Vec = typename DelassusProblem<dim>::Vec;
    constexpr int tangents = dim - 1;
    using Tangent = Eigen::Matrix<double, tangents, 1, Eigen::DontAlign>;
    using Square = Eigen::Matrix<double, tangents, tangents, Eigen::DontAlign>;

    Vec r = Vec::Zero();
    if (q[0] >= 0) return r;
    const double wn = w(0, 0);
    r[0] = -q[0] / wn;
    if (mu == 0) return r;

    const Tangent wnt = w.template topRightCorner<1, tangents>().transpose();
    const Tangent wtn = w.template bottomLeftCorner<tangents, 1>();
    const Tangent s = q.template tail<tangents>() + r[0] * wtn;
    Square schur = w.template bottomRightCorner<tangents, tangents>() - wtn * wnt.transpose() / wn;
    schur.diagonal().array() += 1e-15 * w.trace();  // below its round-off; makes tangents without mobility harmless

    const double unhindered = r[0];  // r_n at r_t = 0
    const auto tangential = [&](double a, Square& inverse) -> Tangent {
        inverse = (schur + a * Square::Identity()).inverse();
        return -inverse * s;
    };
    Square inverse;
    Tangent rt = tangential(0, inverse);
    double rn = unhindered - wnt.dot(rt) / wn;
    if (rt.norm() <= mu * rn) {
        r[0] = rn;
        r.template tail<tangents>() = rt;
        return r;
    }

    if constexpr (tangents == 2) {  // in 2D the direction is the same for every a
        // |r_t| <= |s|/a, so that mu r_n >= |r_t| from here on
        double low = 0, high = s.norm() * (1 + mu * wnt.norm() / wn) / (mu * unhindered), a = 0;
        if (!std::isfinite(high)) return Vec::Zero();
        for (int k = 0; k < 100; ++k) {
            const double length = rt.norm(), ratio = mu * rn / length - 1;
            if (std::abs(ratio) <= 4 * std::numeric_limits<double>::epsilon()) break;
            (ratio < 0 ? low : high) = a;
            const Tangent slope = -inverse * rt;  // d r_t / d a
            const double change = mu * (-wnt.dot(slope) / wn - rn * rt.dot(slope) / (length * length)) / length;
            const double newton = a - ratio / change;
            const bool inside = newton > low && newton < high;
            const double next = inside && k < 20 ? newton : 0.5 * (low + high);
            if (next == a || next == low || next == high) break;
            a = next;
            rt = tangential(a, inverse);
            rn = unhindered - wnt.dot(rt) / wn;
        }
    }
    const Tangent direction = rt.normalized();
    r[0] = -q[0] / (wn + mu * wnt.dot(direction));  // u_n = 0 and the edge of the cone, to the last digit
    r.template tail<tangents>() = mu * r[0] * direction;
    return r;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
