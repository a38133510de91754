/// @file
/// The exact answer of one contact with a couple, whose block of W is full. Three scalar equations are solved, one
/// inside the other, each inside a bracket.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "nscdd/law/one_contact.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Where f, continuous, is 0 between `low`, where it is `at_low` < 0, and `high`, where it is not negative. Regula
/// falsi with Illinois' halving, to the last digits of f.
inline double root_between(double low, double at_low, double high, const auto& f) {
    constexpr double small = 4 * std::numeric_limits<double>::epsilon();
    double at_high = f(high);
    int side = 0;
    for (int k = 0; k < 200 && at_high > small; ++k) {
        double x = (low * at_high - high * at_low) / (at_high - at_low);
        if (!(x > low && x < high) || k % 20 == 19) x = 0.5 * (low + high);
        if (!(x > low && x < high)) break;
        const double at_x = f(x);
        if (std::abs(at_x) <= small) return x;
        if (at_x < 0) {
            low = x, at_low = at_x;
            if (side == -1) at_high *= 0.5;
            side = -1;
        } else {
            high = x, at_high = at_x;
            if (side == 1) at_low *= 0.5;
            side = 1;
        }
    }
    return high;
}

template <int rows, int columns = rows>
using Part = Eigen::Matrix<double, rows, columns, Eigen::DontAlign>;

/// The z, |z| <= radius, with A z + g = -b z for a b >= 0 that is 0 where |z| < radius. It is the only one, as A is
/// positive definite.
template <int m>
Part<m, 1> within_disk(const Part<m>& a, const Part<m, 1>& g, double radius) {
    if (!(radius > 0)) return Part<m, 1>::Zero();
    const auto held = [&](double b) -> Part<m, 1> { return -(a + b * Part<m>::Identity()).inverse() * g; };
    Part<m, 1> z = held(0);
    if (z.norm() <= radius) return z;
    if constexpr (m > 1)  // b |z| <= |g|
        z = held(root_between(0, radius / z.norm() - 1, g.norm() / radius,
                              [&](double b) { return radius / held(b).norm() - 1; }));
    return radius * z.normalized();
}

/// The same of z in two parts, each within a disk of its own: friction first, then the couple.
template <int m>
Part<2 * m, 1> within_disks(const Part<2 * m>& a, const Part<2 * m, 1>& g, double friction, double couple) {
    const Part<m> att = a.template topLeftCorner<m, m>(), atc = a.template topRightCorner<m, m>(),
                  act = a.template bottomLeftCorner<m, m>(), acc = a.template bottomRightCorner<m, m>();
    const Part<m, 1> gt = g.template head<m>(), gc = g.template tail<m>();
    Part<2 * m, 1> z = Part<2 * m, 1>::Zero();
    if (!(friction > 0)) {
        z.template tail<m>() = within_disk<m>(acc, gc, couple);
        return z;
    }
    const auto held = [&](double b) {  // friction is eliminated, as it is where it resists by b besides
        const Part<m> inverse = (att + b * Part<m>::Identity()).inverse();
        z.template tail<m>() = within_disk<m>(acc - act * inverse * atc, gc - act * inverse * gt, couple);
        z.template head<m>() = -inverse * (gt + atc * z.template tail<m>());
        return friction / z.template head<m>().norm() - 1;
    };
    const double slack = held(0);
    if (slack >= 0) return z;
    held(root_between(0, slack, (gt.norm() + atc.norm() * couple) / friction, held));  // b |z_t| <= |g_t + A_tc z_c|
    z.template head<m>() *= friction / z.template head<m>().norm();
    return z;
}

/// r with 0 <= u_n perp r_n >= 0, |r_t| <= mu r_n and |c| <= mu_r r_n, u_t opposed to r_t where it slides, the spin to
/// c where it rolls; u = W r + q.
///   w   (size, size) positive definite, symmetric or not; only the normal needs mobility
///   q   (size) velocity that this contact has without its own impulse
///
/// For a given r_n the tangential impulse and the couple are those of within_disks(), the only ones. They are
/// continuous in r_n, and so is u_n. It is q_n < 0 without an impulse. Where r_n grows, u_n/r_n tends to a positive
/// number (METHOD.md, section 9). So there is an answer in between. If q_n >= 0 the contact opens, as in one_contact().
template <int dim>
typename DelassusProblem<dim, true>::Vec rolling_contact(const typename DelassusProblem<dim, true>::Block& w,
                                                         const typename DelassusProblem<dim, true>::Vec& q, double mu,
                                                         double mu_r) {
    constexpr int m = dim - 1;
    typename DelassusProblem<dim, true>::Vec r = DelassusProblem<dim, true>::Vec::Zero();
    if (q[0] >= 0) return r;
    Part<2 * m> rest = w.template bottomRightCorner<2 * m, 2 * m>();
    // below round-off, as in one_contact(); a part without any mobility gets a number whose square is one
    rest.diagonal().template head<m>().array() += 1e-15 * (w(0, 0) + rest.diagonal().template head<m>().sum());
    rest.diagonal().template tail<m>().array() += 1e-15 * rest.diagonal().template tail<m>().sum() + 1e-150;
    const Part<2 * m, 1> wtn = w.template bottomLeftCorner<2 * m, 1>();
    const auto close = [&](double rn) {  // u_n over the speed with which the contact would close
        r[0] = rn;
        r.template tail<2 * m>() = within_disks<m>(rest, q.template tail<2 * m>() + rn * wtn, mu * rn, mu_r * rn);
        return (q[0] + w.row(0).dot(r)) / -q[0];
    };
    double low = 0, at_low = -1, high = -q[0] / w(0, 0);  // the answer where no couple and no friction acts on u_n
    for (int doubled = 0; doubled < 60; ++doubled) {
        const double at_high = close(high);
        if (!(at_high < -4 * std::numeric_limits<double>::epsilon())) break;
        low = high, at_low = at_high, high *= 2;
    }
    close(root_between(low, at_low, high, close));
    return r;
}

/// The exact answer of contact c to the velocity `others` that it has without its own impulse.
template <int dim, bool rolls>
typename DelassusProblem<dim, rolls>::Vec answer_of_contact(const DelassusProblem<dim, rolls>& problem, std::size_t c,
                                                            const typename DelassusProblem<dim, rolls>::Vec& others) {
    const auto& w = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])];
    if constexpr (rolls)
        return rolling_contact<dim>(w, others, problem.friction[c], problem.rolling[c]);
    else
        return one_contact<dim>(w, others, problem.friction[c]);
}

}}}  // namespace nscdd::NSCDD_ABI::detail
