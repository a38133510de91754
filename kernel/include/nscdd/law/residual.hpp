// How wrong an answer is, whatever the partition: eta and the deepest penetration of the step.
#pragma once

#include <array>
#include <cmath>

#include "nscdd/law/contact_law.hpp"
#include "nscdd/law/kinematics.hpp"

namespace nscdd::inline NSCDD_ABI {

// Sums of one subdomain; over subdomains they add, but for the penetration, of which the largest is taken.
struct ResidualParts {
    double change = 0;       // sum of (r'-r)^T W (r'-r)
    double energy = 0;       // sum of r^T W r
    double next_energy = 0;  // sum of r'^T W r'
    double round_off = 0;    // sum of |v|^2 / W_n, whose round-off squared no change can be below
    double contacts = 0;
    double penetration = 0;  // h max(-v_n - bias), how far the step would drive a contact in [m]

    // eta: METHOD.md, section 2, with the larger of both energies below so that r = 0 is not an answer for free.
    double eta() const {
        if (!std::isfinite(round_off)) return round_off;  // without friction the law takes a NaN for an open contact
        if (change < 1e-28 * round_off) return 0;
        return change > 0 ? std::sqrt(change / std::max(energy, next_energy)) : change;  // NaN stays NaN
    }
    void add(const ResidualParts& o) {
        change += o.change;
        energy += o.energy;
        next_energy += o.next_energy;
        round_off += o.round_off;
        contacts += o.contacts;
        penetration = std::max(penetration, o.penetration);
    }
    static constexpr std::size_t size = 6;
    std::array<double, size> pack() const { return {change, energy, next_energy, round_off, contacts, penetration}; }
};

template <class M>
void add_residual(const ContactProblem<M>& problem, const std::vector<Contact<M>>& contacts, auto kind,
                  ResidualParts& parts) {
    for (const Contact<M>& c : contacts) {
        const DelassusDiagonal w = delassus(problem, c, false, kind);
        const typename M::Impulse v = relative_velocity(problem, c, kind);
        const double inv_wt = M::friction ? 1.0 / w.tangential : 0.0;
        const typename M::Impulse next = contact_law<M>(c, v, 1.0 / w.normal, inv_wt);
        const auto energy = [&](const typename M::Impulse& r) {
            if constexpr (M::friction) {
                const double rn = r.dot(c.normal);
                return w.normal * rn * rn + w.tangential * (r - rn * c.normal).squaredNorm();
            } else {
                return w.normal * r[0] * r[0];
            }
        };
        double vn = v[0];
        if constexpr (M::friction) vn = v.dot(c.normal);
        parts.change += energy(next - c.r);
        parts.energy += energy(c.r);
        parts.next_energy += energy(next);
        parts.round_off += problem.bodies[static_cast<std::size_t>(c.i)].linear().squaredNorm() / w.normal;
        parts.penetration = std::max(parts.penetration, problem.h * (-vn - c.bias));
    }
    parts.contacts += static_cast<double>(contacts.size());
}

// Velocities must be glued: those of the unsplit problem. Cost: about one sweep.
template <class M>
ResidualParts residual_parts(const ContactProblem<M>& problem) {
    ResidualParts parts;
    add_residual(problem, problem.contacts, BetweenGrains{}, parts);
    add_residual(problem, problem.wall_contacts, WithWall{}, parts);
    return parts;
}

}  // namespace nscdd
