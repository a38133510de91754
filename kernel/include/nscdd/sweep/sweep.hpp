/// @file
/// One nonlinear Gauss-Seidel sweep, contact by contact, on the problem as it stands.
#pragma once

#include "nscdd/iterate/anderson.hpp"
#include "nscdd/law/kinematics.hpp"
#include "nscdd/law/solve_contact.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Makes one pass over `contacts`, a list or part of a list of `problem`, in their order. It changes their impulses and
/// the velocities in `problem`. prepare_contacts() must have set inv_wn and inv_wt.
///
/// - `kind` is BetweenGrains{} or WithWall{}.
/// - `acceleration` has before(c) and after(c, change of its impulse), which are called at each contact c; else it is
///   Unaccelerated{}.
template <class M>
void sweep_contacts(ContactProblem<M>& problem, std::vector<Contact<M>>& contacts, auto kind, auto&& acceleration) {
    for (Contact<M>& c : contacts) {
        acceleration.before(c);
        const typename M::Impulse v = relative_velocity(problem, c, kind);
        double inv_wt = 0;
        if constexpr (M::friction) inv_wt = c.inv_wt;
        SpinBlock spin;
        if constexpr (M::rolling) spin = {c.inv_ws, c.coupling};
        const typename M::Impulse next = solve_contact<M>(c, v, c.inv_wn, inv_wt, spin);
        const typename M::Impulse dr = next - c.r;
        acceleration.after(c, dr);
        c.r = next;
        apply_impulse(problem, c, dr, kind);
    }
}

}  // namespace detail

///@{
/// Makes one pass over all contacts, each solved exactly with the latest velocities [Jean99]. It is sweep_contacts() of
/// both lists, in the order of each_contact().
template <class M>
void sweep(ContactProblem<M>& problem, auto&& acceleration) {
    detail::sweep_contacts(problem, problem.wall_contacts, WithWall{}, acceleration);
    detail::sweep_contacts(problem, problem.contacts, BetweenGrains{}, acceleration);
}
template <class M>
void sweep(ContactProblem<M>& problem) {
    sweep(problem, detail::Unaccelerated{});
}
///@}

/// Sets inv_wn and inv_wt of every contact from the (split) inverse masses, times omega, `relaxation`.
template <class M>
void prepare_contacts(ContactProblem<M>& problem, double relaxation = 1) {
    detail::each_contact(problem, [&](Contact<M>& c, auto kind) {
        const detail::DelassusDiagonal w = detail::delassus(problem, c, true, kind);
        c.inv_wn = relaxation / w.normal;
        if constexpr (M::friction) c.inv_wt = relaxation / w.tangential;
        if constexpr (M::rolling) c.inv_ws = relaxation / w.spin, c.coupling = w.coupling;
    });
}

namespace detail {

/// Sets V = V_free + M^-1 H r for the impulses that the contacts bring along (warm start). `bodies` hold V_free before.
template <class M>
void apply_impulses(ContactProblem<M>& problem) {
    for (const Contact<M>& c : problem.contacts) apply_impulse(problem, c, c.r, BetweenGrains{});
    for (const Contact<M>& c : problem.wall_contacts) apply_impulse(problem, c, c.r, WithWall{});
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
