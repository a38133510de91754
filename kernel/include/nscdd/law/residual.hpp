/// @file
/// Errors of an answer, whatever the partition: eta, the velocity error, the energy gain, and the deepest penetration
/// of the step.
#pragma once

#include <cmath>
#include <limits>

#include "nscdd/comm/reduce.hpp"
#include "nscdd/law/eta.hpp"
#include "nscdd/law/free_velocities.hpp"
#include "nscdd/law/solve_contact.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Sums over the contacts and bodies of one subdomain, or of all.
struct ResidualParts {
    double change = 0;       ///< sum of (r'-r)^T W (r'-r) [J]
    double energy = 0;       ///< sum of r^T W r [J]
    double next_energy = 0;  ///< sum of r'^T W r' [J]
    double round_off = 0;    ///< sum of |v|^2 / W_n [J]; no change can be below its round-off squared
    double contacts = 0;     ///< number of contacts
    /// sum of |excess (v_n + bias)| + (limit |v_t| + r_t.v_t) [J]. Each term is zero at an answer. ContactLaw defines
    /// excess and limit; in Coulomb's law they are r_n and mu r_n.
    double work = 0;
    double made = 0;                         ///< sum of r_n (v_n + bias) + r_t.v_t, never positive at an answer [J]
    detail::VelocityChange velocity_change;  ///< of the bodies, by the contacts
    double penetration = 0;                  ///< h max(-v_n - bias): the step would drive a contact in so far [m]
    double miss = 0;                         ///< max |W_cc (r'-r)|: one contact alone misses its law by so much [m/s]

    double eta() const {
        return detail::energy_residual(change, energy, next_energy, round_off);
    }  ///< the energy residual (METHOD.md, section 5.1)

    /// Estimate of |V - V*|_M / |V* - V_free|_M, V* the answer. It is the larger of two quotients. One is the work that
    /// the law forbids over |V - V_free|_M^2. The other is the worst miss over the mean change of velocity (METHOD.md,
    /// section 5.2).
    double velocity_error() const {
        if (eta() == 0) return 0;
        if (velocity_change.energy == 0) return std::numeric_limits<double>::infinity();
        const double forbidden = work / scale(), worst = miss / mean_change();
        return forbidden > worst || std::isnan(forbidden) ? forbidden : worst;
    }

    /// Energy that the contacts make out of nothing, over |V - V_free|_M^2 (METHOD.md, section 5.3).
    double energy_gain() const { return made > 0 && eta() > 0 ? made / scale() : 0; }

    /// Members that reduce() adds up over subdomains.
    auto summed() {
        return std::tie(change, energy, next_energy, round_off, contacts, work, made, velocity_change.energy,
                        velocity_change.quartic);
    }
    auto largest() { return std::tie(penetration, miss); }  ///< members of which reduce() takes the largest

    /// Scale of works: |V - V_free|_M^2 [J]. A lower bound applies: a change of velocities is not asked to be exact to
    /// less than 1e-8 of the velocities themselves.
    double scale() const { return (std::max)(velocity_change.energy, 1e-16 * round_off); }
    /// Mean change of a velocity by the contacts, raised as scale() is [m/s].
    double mean_change() const {
        if (velocity_change.energy == 0) return 0;
        return std::sqrt(velocity_change.mean_square() * scale() / velocity_change.energy);
    }
};

namespace detail {

/// Adds these contacts, all of one kind, to the sums. `velocity_change` stays as it is.
template <class M>
void add_residual(const ContactProblem<M>& problem, const std::vector<Contact<M>>& contacts, auto kind,
                  ResidualParts& parts) {
    for (const Contact<M>& c : contacts) {
        const DelassusDiagonal w = delassus(problem, c, false, kind);
        const typename M::Impulse v = relative_velocity(problem, c, kind);
        const double inv_wt = M::friction ? 1.0 / w.tangential : 0.0;
        SpinBlock block;
        if constexpr (M::rolling) block = {1.0 / w.spin, w.coupling};
        const typename M::Impulse next = solve_contact<M>(c, v, 1.0 / w.normal, inv_wt, block), dr = next - c.r;
        // sum of x_n^2 over normal parts, |x_t|^2 over tangential ones and those of couples, each times its weight
        const auto weighed = [&](const typename M::Impulse& x, double normal, double tangential, double spin) {
            if constexpr (M::friction) {
                const auto& force = force_of<M>(x);
                const double xn = force.dot(c.normal);
                const double sum = normal * xn * xn + tangential * (force - xn * c.normal).squaredNorm();
                if constexpr (M::rolling)
                    return sum + spin * couple_of<M>(x).squaredNorm();
                else
                    return (void)spin, sum;
            } else {
                (void)tangential, (void)spin;
                return normal * x[0] * x[0];
            }
        };
        double vn = v[0], rn = c.r[0], along = 0, limit = 0;  // r_t.v_t, and |v_t| times the largest |r_t|
        if constexpr (M::friction) {
            const auto& velocity = force_of<M>(v);
            const auto& force = force_of<M>(c.r);
            vn = velocity.dot(c.normal), rn = force.dot(c.normal);
            const typename M::Vec slip = velocity - vn * c.normal;
            along = force.dot(slip), limit = M::Law::limit(rn, c) * slip.norm();
            if constexpr (M::rolling) {
                along += couple_of<M>(c.r).dot(couple_of<M>(v));
                limit += couple_limit(c, couple_of<M>(v), rn);
            }
        }
        parts.change += weighed(dr, w.normal, w.tangential, w.spin);
        parts.energy += weighed(c.r, w.normal, w.tangential, w.spin);
        parts.next_energy += weighed(next, w.normal, w.tangential, w.spin);
        parts.round_off += problem.bodies[static_cast<std::size_t>(c.i)].linear().squaredNorm() / w.normal;
        parts.work += std::abs(M::Law::excess(rn, c) * (vn + c.bias)) + limit + along;
        parts.made += rn * (vn + c.bias) + along;
        parts.penetration = (std::max)(parts.penetration, problem.h * (-vn - c.bias));
        parts.miss = (std::max)(
            parts.miss, std::sqrt(weighed(dr, w.normal * w.normal, w.tangential * w.tangential, w.normal * w.spin)));
    }
    parts.contacts += static_cast<double>(contacts.size());
}

}  // namespace detail

///@{
/// Sums of one problem. Velocities must be glued: those of the unsplit problem. `free` is free_velocities() unless
/// given. The cost is about one sweep.
template <class M>
ResidualParts residual_parts(const ContactProblem<M>& problem, const detail::FreeVelocities<M>& free) {
    ResidualParts parts;
    detail::add_residual(problem, problem.contacts, BetweenGrains{}, parts);
    detail::add_residual(problem, problem.wall_contacts, WithWall{}, parts);
    parts.velocity_change = detail::velocity_change(problem, free);
    return parts;
}

template <class M>
ResidualParts residual_parts(const ContactProblem<M>& problem) {
    return residual_parts(problem, detail::free_velocities(problem));
}
///@}

}}  // namespace nscdd::NSCDD_ABI
