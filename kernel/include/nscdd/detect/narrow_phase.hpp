/// @file
/// The paper's narrow phase: contacts of this step out of the candidates of the broad phase, with gap, normal, levers
/// and bias.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "nscdd/core/materials.hpp"
#include "nscdd/core/wall.hpp"
#include "nscdd/detect/paths.hpp"
#include "nscdd/law/couples.hpp"
#include "nscdd/law/kinematics.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The deepest overlap among the candidates of a subdomain.
struct Overlap {
    double ratio = 0;  ///< overlap over the smaller radius; 0: there is none
    int i = -1;        ///< id
    int j = -1;        ///< id; j < 0: wall -1-j

    /// Keeps the deeper one; of equal ones the first.
    void note(const Overlap& other) {
        if (other.ratio > ratio) *this = other;
    }
};

/// Gap up to which a pair without restitution is a contact [m]. What is left out is looked at again once the step is
/// solved (find_tunnelled()). So this decides how many contacts stay open, and how often a step is solved again.
struct Alert {
    double h = 0;      ///< step [s]
    double fall = 0;   ///< way that two bodies come nearer in the step by gravity, at most [m]
    double least = 0;  ///< for a pair at rest [m]

    /// Of a pair that moves at a relative velocity [m/s].
    template <class Vec>
    double of(const Vec& velocity) const {
        return (std::max)(least, h * velocity.norm() + fall);
    }
};

/// Warm start: last step's impulse, made one that the law allows about the new normal.
template <class M>
[[gnu::always_inline]] inline typename M::Impulse admissible(const typename M::Impulse& r,
                                                             const typename M::Vec& normal,
                                                             const typename M::Law::Coefficients& k) {
    if constexpr (M::friction) {
        const auto& force = force_of<M>(r);
        const double along = force.dot(normal), rn = M::Law::normal(along, k), limit = M::Law::limit(rn, k);
        const typename M::Vec rt = force - along * normal;
        constexpr double least = (std::numeric_limits<double>::min)();  // no 0/0
        if constexpr (M::rolling) {
            const typename M::Spin couple = allowed_couple<M>(couple_of<M>(r), normal, rn, k);
            return with_couple<M>(rn * normal + limit / (std::max)({rt.norm(), limit, least}) * rt, couple);
        } else {
            return rn * normal + limit / (std::max)({rt.norm(), limit, least}) * rt;
        }
    } else {
        (void)normal;
        return typename M::Impulse{M::Law::normal(r[0], k)};
    }
}

/// True if the candidate is a contact now; else its impulse becomes 0.
/// e = 0: gap <= alert and no passing by, or missed before, or within the range of the law. e > 0: gap <= 0 (METHOD.md,
/// section 2.5).
template <class M>
bool acts(typename Candidates<M>::Candidate& candidate, const typename M::Law::Pairing& pairing, double gap,
          double alert, bool passes) {
    const bool impact = pairing.restitution > 0;
    bool acts = impact ? gap <= 0 : ((gap <= alert) & !passes & !candidate.passes) | candidate.missed;
    const double range = range_of<typename M::Law>(pairing);
    acts |= (range > 0) & (gap <= range);
    candidate.free_gap = (impact | !acts) ? gap : Candidates<M>::Candidate::held;
    for (double& r : candidate.r) r = acts ? r : 0;
    return acts;
}

template <class M>
[[gnu::always_inline]] inline void fill(Contact<M>& c, const typename Candidates<M>::Candidate& candidate,
                                        const typename M::Law::Pairing& pairing, double gap, double h,
                                        const typename M::Vec& normal, double approach, double lever_i,
                                        double lever_j) {
    c.i = candidate.i;
    c.j = candidate.j;
    c.normal = normal;
    c.bias = pairing.restitution > 0 ? pairing.restitution * approach : (std::max)(gap, 0.0) / h;
    c.coefficients() = M::Law::coefficients(pairing, gap, h);
    c.r = admissible<M>(candidate.r, normal, c);
    if constexpr (M::friction) {
        c.lever_i = lever_i;
        c.lever_j = lever_j;
    }
}

template <class M>
void add_obstacle_contacts(Subdomain<M>& part, std::size_t begin, std::size_t end, const Materials<M>& materials,
                           double h, const Alert& alert, Overlap& worst);

/// Fills problem.contacts and wall_contacts from the positions of the grains and their velocities before the step.
/// `h`: step [s]. Returns the worst overlap found.
template <class M>
Overlap detect_contacts(Subdomain<M>& part, std::span<const Wall<M>> walls, const Materials<M>& materials, double h,
                        const Alert& alert) {
    Overlap worst;
    const auto note = [&](double gap, double radius, int i, int j) {
        if (-gap > worst.ratio * radius) worst = {-gap / radius, i, j};
    };
    ContactProblem<M>& problem = part.problem;
    const Cell<M> cell = part.cell;
    const bool repeats = cell.repeats(), flows = cell.flows();  // asked once: there are many candidates
    // Each candidate is written to contacts[count]; count grows only if it acts. Avoids a mispredicted branch.
    std::size_t count = 0;
    problem.contacts.resize(part.pairs.size());
    part.source.resize(part.pairs.size());
    for (std::size_t k = 0; k < part.pairs.size(); ++k) {
        auto& candidate = part.pairs[k];
        const Grain<M>& a = part.grains[static_cast<std::size_t>(candidate.i)];
        const Grain<M>& b = part.grains[static_cast<std::size_t>(candidate.j)];
        typename M::Vec normal = a.position - b.position;
        if (repeats) normal = cell.nearest(normal);
        const double distance = normal.norm(), gap = distance - a.radius - b.radius;
        note(gap, (std::min)(a.radius, b.radius), a.id, b.id);
        if (!(distance > 0)) continue;  // coincident centres have no normal; their overlap is noted
        const auto& pairing = materials(a.material, b.material);
        typename M::Vec v = a.velocity.template head<M::dim>() - b.velocity.template head<M::dim>();
        const typename M::Vec apart = normal;
        if (flows) v += flow_over<M>(cell.gradient, apart);
        normal /= distance;
        const double approach = v.dot(normal);
        const bool passes = gap > 0 && pass_by(apart, v, approach, gap / h, a.radius + b.radius, h,
                                               passing_way * (std::min)(a.radius, b.radius));
        const bool acts = detail::acts<M>(candidate, pairing, gap, alert.of(v), passes);
        fill(problem.contacts[count], candidate, pairing, gap, h, normal, approach, a.radius + 0.5 * gap,
             b.radius + 0.5 * gap);
        part.source[count] = static_cast<int>(k);
        count += acts;
    }
    problem.contacts.resize(count);
    part.source.resize(count);

    problem.wall_contacts.clear();
    part.wall_source.clear();
    part.touches.clear();
    for (std::size_t k = 0; k < part.wall_pairs.size(); ++k) {
        auto& candidate = part.wall_pairs[k];
        if (static_cast<std::size_t>(candidate.j) >= walls.size()) {
            const std::size_t begin = k;
            while (k + 1 < part.wall_pairs.size() && part.wall_pairs[k + 1].i == candidate.i) ++k;
            add_obstacle_contacts(part, begin, k + 1, materials, h, alert, worst);
            continue;
        }
        const Grain<M>& a = part.grains[static_cast<std::size_t>(candidate.i)];
        const Wall<M>& wall = walls[static_cast<std::size_t>(candidate.j)];
        const double gap = wall.distance(a.position) - a.radius;
        note(gap, a.radius, a.id, -1 - candidate.j);
        const auto& pairing = materials(a.material, wall.material);
        const typename M::Vec v = a.velocity.template head<M::dim>();
        const double speed = wall.normal_speed();
        if (!acts<M>(candidate, pairing, gap, alert.of(typename M::Vec(v - speed * wall.normal)), false)) continue;
        const double approach = v.dot(wall.normal) - (speed - wall.change.dot(wall.normal));
        fill(problem.wall_contacts.emplace_back(), candidate, pairing, gap, h, wall.normal, approach, a.radius, 0.0);
        part.wall_source.push_back(static_cast<int>(k));
    }
    return worst;
}

}}}  // namespace nscdd::NSCDD_ABI::detail

#include "nscdd/detect/obstacle_contacts.hpp"
