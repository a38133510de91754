// Nonlinear Gauss-Seidel, the sequential reference: matrix-free, contacts in the order given.
//
//   nscdd::SolveReport report = nscdd::nlgs(problem, {.tolerance = 1e-6});
#pragma once

#include "nscdd/solve/options.hpp"

namespace nscdd {

template <class M>
void sweep_contacts(ContactProblem<M>& problem, std::vector<Contact<M>>& contacts, auto kind) {
    for (Contact<M>& c : contacts) {
        const typename M::Impulse v = relative_velocity(problem, c, kind);
        double inv_wt = 0;
        if constexpr (M::friction) inv_wt = c.inv_wt;
        const typename M::Impulse next = contact_law<M>(c, v, c.inv_wn, inv_wt);
        const typename M::Impulse dr = next - c.r;
        c.r = next;
        apply_impulse(problem, c, dr, kind);
    }
}

// One pass over all contacts, each solved exactly with the latest velocities [Jean99].
template <class M>
void sweep(ContactProblem<M>& problem) {
    sweep_contacts(problem, problem.wall_contacts, WithWall{});  // first: 1 % fewer iterations than last
    sweep_contacts(problem, problem.contacts, BetweenGrains{});
}

// Sets inv_wn and inv_wt of every contact from the (split) inverse masses.
template <class M>
void prepare_contacts(ContactProblem<M>& problem) {
    const auto prepare = [&](std::vector<Contact<M>>& contacts, auto kind) {
        for (Contact<M>& c : contacts) {
            const DelassusDiagonal w = delassus(problem, c, true, kind);
            c.inv_wn = 1.0 / w.normal;
            if constexpr (M::friction) c.inv_wt = 1.0 / w.tangential;
        }
    };
    prepare(problem.contacts, BetweenGrains{});
    prepare(problem.wall_contacts, WithWall{});
}

// V = V_free + M^-1 H r for the impulses that the contacts bring along (warm start). `bodies` hold V_free before.
template <class M>
void apply_impulses(ContactProblem<M>& problem) {
    for (const Contact<M>& c : problem.contacts) apply_impulse(problem, c, c.r, BetweenGrains{});
    for (const Contact<M>& c : problem.wall_contacts) apply_impulse(problem, c, c.r, WithWall{});
}

// Sweeps until eta and the penetration are small enough. In: prepared contacts, velocities consistent with the
// impulses. Throws std::runtime_error when the residual is not finite.
template <class M>
SolveReport nlgs(ContactProblem<M>& problem, const SolveOptions& options) {
    SolveReport report;
    if (problem.contact_count() == 0) return report;
    do {
        for (int k = 0; k < options.check_every; ++k)
            for (int s = 0; s < options.sweeps; ++s) sweep(problem);
        report.iterations += options.check_every;
    } while (!finished(residual_parts(problem), options, problem.least_radius, report));
    return report;
}

}  // namespace nscdd
