/// @file
/// Errors of the impulses of a problem in local form, by the measures that contact codes publish and by ours.
/// ```
/// nscdd::ErrorMeasures e = nscdd::error_measures(problem, r);
/// ```
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "nscdd/law/eta.hpp"
#include "nscdd/law/one_contact.hpp"
#include "nscdd/law/rolling_contact.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Errors of an answer, dimensionless, 0 for an exact one. Velocities are u = W r + q always. Norms are Euclidean over
/// all components. "Largest" is the largest absolute component: of r, or of u and q together.
///
/// Where contacts have couples, these and the spins are taken as r_t and u_t are. natural_map and worst have the units
/// of the problem. In all others a couple is an impulse, and a spin a velocity, by the length sqrt(W_t/W_s) of the
/// contact.
struct ErrorMeasures {
    double natural_map = 0;            ///< |F| over the largest of |q|, |r|, |u|, F with rho = 1 [Acary18]
    double natural_map_velocity = 0;   ///< F with rho_c = 1/mean(diag W_cc): |F_c/rho_c| over the larger of |q| and |u|
    double unilateral = 0;             ///< |min(r_n/rho_c, u_n)| over the same: F hides it where mu is large
    double natural_map_impulse = 0;    ///< F with that rho_c, over |r|
    double eta = 0;                    ///< energy residual (METHOD.md, section 5.1)
    double least_normal_impulse = 0;   ///< least r_n over the largest impulse: negative where a contact pulls
    double cone_excess = 0;            ///< largest excess of |r_t| over mu r_n, over the largest impulse
    double least_normal_velocity = 0;  ///< least u_n over the largest velocity: negative where a contact closes
    double complementarity = 0;        ///< largest |u_n r_n| over largest velocity times largest impulse
    double dissipation = 0;  ///< largest |mu r_n |u_t| + r_t . u_t|, which friction fails to dissipate, over the same
    std::size_t worst_contact = 0;  ///< contact where F with rho = 1 is largest
    double worst = 0;               ///< size of F there, over the same as natural_map
};

namespace detail {

/// The point of the cone |y_k| <= mu_k y_n nearest to y. y has its normal part first, then parts y_k of equal size, one
/// for each limit mu_k: y_t, or y_t and a couple [AcaryBourrier21]. Newton's project_cone() is not used, because these
/// measures judge its answers.
template <class Vec, std::size_t parts>
Vec project_on_cone(const Vec& y, const std::array<double, parts>& limits) {
    constexpr int size = (Vec::RowsAtCompileTime - 1) / static_cast<int>(parts);
    const auto part = [](auto& vector, std::size_t k) {
        return vector.template segment<size>(1 + static_cast<int>(k) * size);
    };
    std::array<double, parts> length;
    std::array<bool, parts> cut;
    for (std::size_t k = 0; k < parts; ++k) length[k] = part(y, k).norm(), cut[k] = true;
    // Parts within their limit are no longer cut, which lets the normal part grow: none comes back.
    double normal = 0;
    for (std::size_t pass = 0; pass <= parts; ++pass) {
        double sum = y[0], square = 1;
        for (std::size_t k = 0; k < parts; ++k)
            if (cut[k]) sum += limits[k] * length[k], square += limits[k] * limits[k];
        normal = sum / square;
        if (normal <= 0) return Vec::Zero();
        for (std::size_t k = 0; k < parts; ++k) cut[k] = cut[k] && length[k] > limits[k] * normal;
    }
    Vec p = y;
    p[0] = normal;
    for (std::size_t k = 0; k < parts; ++k)
        if (cut[k]) part(p, k) *= limits[k] * normal / length[k];
    return p;
}
/// The same of |y_t| <= mu y_n alone.
template <class Vec>
Vec project_on_cone(const Vec& y, double mu) {
    return project_on_cone(y, std::array{mu});
}

/// The function F of one contact, r - P_K(r - rho (u + s n)), s the sum of mu |u_t| and of mu_r times the spin where
/// there is a couple. It is zero where the law holds, whatever rho > 0 [Acary18, AcaryBourrier21].
template <class Vec, std::size_t parts>
Vec natural_map(const Vec& r, const Vec& u, const std::array<double, parts>& limits, double rho) {
    constexpr int size = (Vec::RowsAtCompileTime - 1) / static_cast<int>(parts);
    Vec y = r - rho * u;
    for (std::size_t k = 0; k < parts; ++k)
        y[0] -= rho * limits[k] * u.template segment<size>(1 + static_cast<int>(k) * size).norm();
    return r - project_on_cone(y, limits);
}
/// The same of friction alone.
template <class Vec>
Vec natural_map(const Vec& r, const Vec& u, double mu, double rho) {
    return natural_map(r, u, std::array{mu}, rho);
}

/// A norm over its scale, or the norm itself where the scale is 0 to round-off. Not finite where the scale is not.
inline double relative(double value, double scale) {
    if (!std::isfinite(scale)) return scale;
    return scale > std::numeric_limits<double>::epsilon() ? value / scale : value;
}

/// Sums of squares of q, r and u.
struct Squares {
    double q = 0, r = 0, u = 0;
    void add(const auto& one_q, const auto& one_r, const auto& one_u) {
        q += one_q.squaredNorm(), r += one_r.squaredNorm(), u += one_u.squaredNorm();
    }
};

/// A contact whose couple is an impulse by a length, its spin a velocity: r over `unit`, u times `unit`.
template <class Problem>
struct InOneUnit {
    typename Problem::Vec unit = Problem::Vec::Ones();
    typename Problem::Limits limits;

    InOneUnit(const typename Problem::Block& w, const typename Problem::Limits& given) : limits(given) {
        if constexpr (Problem::rolls) {
            const double tangential = w.diagonal().template segment<Problem::tangents>(1).sum(),
                         spin = w.diagonal().template tail<Problem::tangents>().sum();
            const double length = tangential > 0 && spin > 0 ? std::sqrt(tangential / spin) : 1;
            unit.template tail<Problem::tangents>().setConstant(length);
            limits[1] /= length;
        }
    }
    typename Problem::Vec velocity(const typename Problem::Vec& u) const { return u.cwiseProduct(unit); }
    typename Problem::Vec impulse(const typename Problem::Vec& r) const { return r.cwiseQuotient(unit); }
    /// The mean of the diagonal of the contact's W, 1 where it is 0 [1/kg].
    double stiffness(const typename Problem::Block& w) const {
        const double mean = w.diagonal().dot(unit.cwiseAbs2()) / Problem::size;
        return mean > 0 ? mean : 1;
    }
    /// F over rho, with rho = 1/stiffness [m/s].
    typename Problem::Vec velocity_miss(const typename Problem::Block& w, const typename Problem::Vec& r,
                                        const typename Problem::Vec& u) const {
        const double k = stiffness(w);
        return k * natural_map(impulse(r), velocity(u), limits, 1 / k);
    }
    /// min(r_n/rho, u_n) [m/s].
    double unilateral_miss(const typename Problem::Block& w, const typename Problem::Vec& r,
                           const typename Problem::Vec& u) const {
        return (std::min)(stiffness(w) * r[0], u[0]);
    }
};

/// The largest of natural_map, natural_map_velocity and unilateral, on which solvers stop. The first alone is small for
/// any impulses where W is. Misses of velocities within the round-off of W r do not count, where that is at most 1e-5
/// of the velocities: a light contact under a heavy load misses no less. It costs one product with W.
template <int dim, bool rolls>
double stopping_error(const DelassusProblem<dim, rolls>& problem,
                      const std::vector<typename DelassusProblem<dim, rolls>::Vec>& r) {
    using Problem = DelassusProblem<dim, rolls>;
    using Vec = typename Problem::Vec;
    constexpr double few_digits = 16 * std::numeric_limits<double>::epsilon(), most = 1e-5;
    Squares given, alike;
    double map = 0, round_off = 0;
    std::array<double, 2> missed{}, excused{};  // by natural_map_velocity and by unilateral
    for (std::size_t c = 0; c < problem.contact_count(); ++c) {
        const auto& w = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])];
        const InOneUnit<Problem> one(w, problem.limits(c));
        Vec u = problem.q[c];
        double digits = 0;  // of the sum
        for (auto k = static_cast<std::size_t>(problem.row_begin[c]);
             k < static_cast<std::size_t>(problem.row_begin[c + 1]); ++k) {
            const Vec part = problem.blocks[k] * r[static_cast<std::size_t>(problem.columns[k])];
            u += part;
            digits += few_digits * one.velocity(part).norm();
        }
        given.add(problem.q[c], r[c], u);
        map += natural_map(r[c], u, problem.limits(c), 1.0).squaredNorm();
        const std::array miss{one.velocity_miss(w, r[c], u).norm(), std::abs(one.unilateral_miss(w, r[c], u))};
        for (std::size_t k = 0; k < miss.size(); ++k) (miss[k] > digits ? missed : excused)[k] += miss[k] * miss[k];
        round_off = (std::max)(round_off, digits);
        alike.add(one.velocity(problem.q[c]), one.impulse(r[c]), one.velocity(u));
    }
    const double velocity = std::sqrt((std::max)(alike.q, alike.u));
    for (std::size_t k = 0; k < missed.size(); ++k)
        if (round_off > most * velocity) missed[k] += excused[k];
    const double miss = std::sqrt((std::max)(missed[0], missed[1]));
    return (std::max)(relative(std::sqrt(map), std::sqrt((std::max)({given.q, given.r, given.u}))),
                      velocity > 0 ? miss / velocity : miss);
}

}  // namespace detail

/// All measures of the impulses r. r has one impulse per contact, in the order and axes of the problem.
template <int dim, bool rolls>
ErrorMeasures error_measures(const DelassusProblem<dim, rolls>& problem,
                             const std::vector<typename DelassusProblem<dim, rolls>::Vec>& r) {
    using Problem = DelassusProblem<dim, rolls>;
    using Vec = typename Problem::Vec;
    ErrorMeasures e;
    e.least_normal_impulse = e.least_normal_velocity = problem.contact_count() > 0 ? HUGE_VAL : 0;
    detail::Squares given, alike;  // in the units of the problem, and in one unit each
    double map = 0, map_velocity = 0, map_impulse = 0, unilateral = 0;
    double change = 0, energy = 0, next_energy = 0, round_off = 0, largest_r = 0, largest_u = 0;
    for (std::size_t c = 0; c < problem.contact_count(); ++c) {
        const auto& w = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])];
        const Vec u = problem.velocity(c, r);
        given.add(problem.q[c], r[c], u);
        const double f = detail::natural_map(r[c], u, problem.limits(c), 1.0).squaredNorm();
        map += f;
        if (f > e.worst * e.worst) e.worst = std::sqrt(f), e.worst_contact = c;

        const Vec next = detail::answer_of_contact(problem, c, Vec(u - w * r[c])), step = next - r[c];
        change += step.dot(w * step);
        energy += r[c].dot(w * r[c]);
        next_energy += next.dot(w * next);

        const detail::InOneUnit<Problem> one(w, problem.limits(c));
        const Vec velocity = one.velocity(u), impulse = one.impulse(r[c]), free = one.velocity(problem.q[c]);
        alike.add(free, impulse, velocity);
        const double stiffness = one.stiffness(w), g = one.velocity_miss(w, r[c], u).squaredNorm();
        unilateral += std::pow(one.unilateral_miss(w, r[c], u), 2);
        map_velocity += g;
        map_impulse += g / (stiffness * stiffness);
        round_off += free.squaredNorm() / w(0, 0);

        const double un = u[0], rn = r[c][0];
        largest_r = (std::max)(largest_r, impulse.cwiseAbs().maxCoeff());
        largest_u = (std::max)({largest_u, velocity.cwiseAbs().maxCoeff(), free.cwiseAbs().maxCoeff()});
        e.least_normal_impulse = (std::min)(e.least_normal_impulse, rn);
        e.least_normal_velocity = (std::min)(e.least_normal_velocity, un);
        e.complementarity = (std::max)(e.complementarity, std::abs(un * rn));
        for (std::size_t k = 0; k < one.limits.size(); ++k) {
            const int first = 1 + static_cast<int>(k) * Problem::tangents;
            const auto held = impulse.template segment<Problem::tangents>(first),
                       slip = velocity.template segment<Problem::tangents>(first);
            e.cone_excess = (std::max)(e.cone_excess, held.norm() - one.limits[k] * (std::max)(rn, 0.0));
            e.dissipation = (std::max)(e.dissipation, std::abs(one.limits[k] * rn * slip.norm() + held.dot(slip)));
        }
    }
    const double scale = std::sqrt((std::max)({given.q, given.r, given.u}));
    e.natural_map = detail::relative(std::sqrt(map), scale);
    e.worst = detail::relative(e.worst, scale);
    e.natural_map_velocity = detail::relative(std::sqrt(map_velocity), std::sqrt((std::max)(alike.q, alike.u)));
    e.unilateral = detail::relative(std::sqrt(unilateral), std::sqrt((std::max)(alike.q, alike.u)));
    e.natural_map_impulse = detail::relative(std::sqrt(map_impulse), std::sqrt(alike.r));
    e.eta = detail::energy_residual(change, energy, next_energy, round_off);
    const auto over = [](double& value, double largest) {
        if (largest > 0) value /= largest;
    };
    over(e.least_normal_impulse, largest_r);
    over(e.cone_excess, largest_r);
    over(e.least_normal_velocity, largest_u);
    over(e.complementarity, largest_u * largest_r);
    over(e.dissipation, largest_u * largest_r);
    return e;
}

}}  // namespace nscdd::NSCDD_ABI
