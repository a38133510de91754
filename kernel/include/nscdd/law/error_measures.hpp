/// @file
/// Errors of the impulses of a problem in local form, by the measures that contact codes publish and by ours.
/// ```
/// nscdd::ErrorMeasures e = nscdd::error_measures(problem, r);
/// ```
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "nscdd/law/eta.hpp"
#include "nscdd/law/one_contact.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Errors of an answer, dimensionless, 0 for an exact one. Velocities are u = W r + q always. Norms are Euclidean over
/// all components. "Largest" is the largest absolute component: of r, or of u and q together.
struct ErrorMeasures {
    double natural_map = 0;            ///< |F| over the largest of |q|, |r|, |u|, F with rho = 1 [Acary18]
    double natural_map_velocity = 0;   ///< F with rho_c = 1/mean(diag W_cc): |F_c/rho_c| over the larger of |q| and |u|
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

/// The point of the cone |y_t| <= mu y_n nearest to y. Newton's project_cone() is not used, because these measures
/// judge its answers.
template <class Vec>
Vec project_on_cone(const Vec& y, double mu) {
    constexpr int tangents = Vec::RowsAtCompileTime - 1;
    const double t = y.template tail<tangents>().norm();
    if (mu * t <= -y[0]) return Vec::Zero();  // tested first: with mu = t = 0 an opening contact needs 0
    if (t <= mu * y[0]) return y;
    const double normal = (mu * t + y[0]) / (1 + mu * mu);
    Vec p;
    p[0] = normal;
    p.template tail<tangents>() = mu * normal / t * y.template tail<tangents>();
    return p;
}

/// The function F of one contact, r - P_K(r - rho (u + mu |u_t| n)). It is zero where the law holds, whatever rho > 0
/// [Acary18].
template <class Vec>
Vec natural_map(const Vec& r, const Vec& u, double mu, double rho) {
    constexpr int tangents = Vec::RowsAtCompileTime - 1;
    Vec y = r - rho * u;
    y[0] -= rho * mu * u.template tail<tangents>().norm();
    return r - project_on_cone(y, mu);
}

namespace detail {

/// A norm over its scale, or the norm itself where the scale is 0 to round-off.
inline double relative(double value, double scale) {
    return scale > std::numeric_limits<double>::epsilon() ? value / scale : value;
}

}  // namespace detail

/// ErrorMeasures::natural_map alone, the stopping test of solvers. It costs one product with W.
template <int dim>
double natural_map_error(const DelassusProblem<dim>& problem,
                         const std::vector<typename DelassusProblem<dim>::Vec>& r) {
    double map = 0, q = 0, rr = 0, uu = 0;
    for (std::size_t c = 0; c < problem.contact_count(); ++c) {
        const typename DelassusProblem<dim>::Vec u = problem.velocity(c, r);
        map += natural_map(r[c], u, problem.friction[c], 1.0).squaredNorm();
        q += problem.q[c].squaredNorm();
        rr += r[c].squaredNorm();
        uu += u.squaredNorm();
    }
    return detail::relative(std::sqrt(map), std::sqrt((std::max)({q, rr, uu})));
}

/// All measures of the impulses r. r has one impulse per contact, in the order and axes of the problem.
template <int dim>
ErrorMeasures error_measures(const DelassusProblem<dim>& problem,
                             const std::vector<typename DelassusProblem<dim>::Vec>& r) {
    using Vec = typename DelassusProblem<dim>::Vec;
    constexpr int tangents = dim - 1;
    ErrorMeasures e;
    e.least_normal_impulse = e.least_normal_velocity = problem.contact_count() > 0 ? HUGE_VAL : 0;
    double map = 0, map_velocity = 0, map_impulse = 0, q2 = 0, r2 = 0, u2 = 0;
    double change = 0, energy = 0, next_energy = 0, round_off = 0, largest_r = 0, largest_u = 0;
    for (std::size_t c = 0; c < problem.contact_count(); ++c) {
        const auto& w = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])];
        const double mu = problem.friction[c];
        const Vec u = problem.velocity(c, r);
        const double un = u[0], rn = r[c][0];
        const double ut = u.template tail<tangents>().norm(), rt = r[c].template tail<tangents>().norm();

        const double f = natural_map(r[c], u, mu, 1.0).squaredNorm();
        map += f;
        if (f > e.worst * e.worst) e.worst = std::sqrt(f), e.worst_contact = c;
        const double mean = w.trace() / dim, stiffness = mean > 0 ? mean : 1;
        const double g = natural_map(r[c], u, mu, 1 / stiffness).squaredNorm();
        map_impulse += g;
        map_velocity += stiffness * stiffness * g;

        const Vec next = detail::one_contact<dim>(w, u - w * r[c], mu), step = next - r[c];
        change += step.dot(w * step);
        energy += r[c].dot(w * r[c]);
        next_energy += next.dot(w * next);
        round_off += problem.q[c].squaredNorm() / w(0, 0);

        q2 += problem.q[c].squaredNorm();
        r2 += r[c].squaredNorm();
        u2 += u.squaredNorm();
        largest_r = (std::max)(largest_r, r[c].cwiseAbs().maxCoeff());
        largest_u = (std::max)({largest_u, u.cwiseAbs().maxCoeff(), problem.q[c].cwiseAbs().maxCoeff()});
        e.least_normal_impulse = (std::min)(e.least_normal_impulse, rn);
        e.least_normal_velocity = (std::min)(e.least_normal_velocity, un);
        e.cone_excess = (std::max)(e.cone_excess, rt - mu * (std::max)(rn, 0.0));
        e.complementarity = (std::max)(e.complementarity, std::abs(un * rn));
        e.dissipation = (std::max)(
            e.dissipation, std::abs(mu * rn * ut + r[c].template tail<tangents>().dot(u.template tail<tangents>())));
    }
    const double q = std::sqrt(q2), rr = std::sqrt(r2), uu = std::sqrt(u2), scale = (std::max)({q, rr, uu});
    e.natural_map = detail::relative(std::sqrt(map), scale);
    e.worst = detail::relative(e.worst, scale);
    e.natural_map_velocity = detail::relative(std::sqrt(map_velocity), (std::max)(q, uu));
    e.natural_map_impulse = detail::relative(std::sqrt(map_impulse), rr);
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
