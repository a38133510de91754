/// @file
/// H^T V and M^-1 H dr of one contact, without the matrix H. The first is the velocity v at the contact point. The
/// second is the effect of an impulse on the bodies.
#pragma once

#include "nscdd/core/contact_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

struct BetweenGrains {};  ///< kind of contact that a function is compiled for: `j` is a grain
struct WithWall {};       ///< kind of contact that a function is compiled for: `j` is a wall

namespace detail {

/// Calls visit(contact, kind) for every contact, those with walls first. Sweeps have this order, because they need 1 %
/// fewer iterations so. All vectors over contacts have it, too.
///
/// Loops that only add up, as apply_impulses(), go the other way round. There this order would change the last bits of
/// velocities, and by them the accepted numbers of iterations, for nothing.
template <class Problem>
void each_contact(Problem& problem, auto&& visit) {
    for (auto& c : problem.wall_contacts) visit(c, WithWall{});
    for (auto& c : problem.contacts) visit(c, BetweenGrains{});
}

}  // namespace detail

///@{
/// Velocity of i relative to j at the contact point [m/s]. In a frictionless scene it is the normal component alone.
template <class M>
typename M::Impulse relative_velocity(const ContactProblem<M>& problem, const Contact<M>& c, BetweenGrains) {
    const Body<M>& a = problem.bodies[static_cast<std::size_t>(c.i)];
    const Body<M>& b = problem.bodies[static_cast<std::size_t>(c.j)];
    typename M::Vec v = a.linear() - b.linear();
    if constexpr (M::friction) {
        if (problem.flow) v += (c.lever_i + c.lever_j) * detail::flow_over<M>(problem.flow_gradient(), c.normal);
        const typename M::Spin spin = c.lever_i * a.spin() + c.lever_j * b.spin();
        return detail::with_couple<M>(v - detail::spin_cross<M>(spin, c.normal), a.spin() - b.spin());
    } else {
        return typename M::Impulse{v.dot(c.normal)};
    }
}

template <class M>
typename M::Impulse relative_velocity(const ContactProblem<M>& problem, const Contact<M>& c, WithWall) {
    const Body<M>& a = problem.bodies[static_cast<std::size_t>(c.i)];
    const WallBody<M>& wall = problem.walls[static_cast<std::size_t>(c.j)];
    const typename M::Vec v = a.linear() - wall.prescribed - wall.speed * c.normal;
    if constexpr (M::friction) {
        const typename M::Spin spin = c.lever_i * a.spin();
        typename M::Spin turning = a.spin();
        if constexpr (M::rolling) turning -= wall.spin.value;
        return detail::with_couple<M>(v - detail::spin_cross<M>(spin, c.normal), turning);
    } else {
        return typename M::Impulse{v.dot(c.normal)};
    }
}
///@}

namespace detail {

/// The impulse as a vector in world axes [N s].
template <class M>
typename M::Vec impulse_vector(const typename M::Impulse& r, const typename M::Vec& normal) {
    if constexpr (M::friction)
        return force_of<M>(r);
    else
        return r[0] * normal;
}

}  // namespace detail

///@{
/// V += M^-1 H dr. The impulse is dr on i and -dr on j [N s]; the inverse masses are taken as they stand.
template <class M>
void apply_impulse(ContactProblem<M>& problem, const Contact<M>& c, const typename M::Impulse& dr, BetweenGrains) {
    Body<M>& a = problem.bodies[static_cast<std::size_t>(c.i)];
    Body<M>& b = problem.bodies[static_cast<std::size_t>(c.j)];
    const typename M::Vec impulse = detail::impulse_vector<M>(dr, c.normal);
    a.linear() += a.inv_mass * impulse;
    b.linear() -= b.inv_mass * impulse;
    if constexpr (M::friction) {
        // the arms are -lever_i n and +lever_j n and the impulses opposite: both spins turn the same way
        const typename M::Spin turn = detail::arm_cross<M>(c.normal, impulse);
        a.spin() -= (c.lever_i * a.inv_inertia) * turn;
        b.spin() -= (c.lever_j * b.inv_inertia) * turn;
        if constexpr (M::rolling) {
            a.spin() += a.inv_inertia * detail::couple_of<M>(dr);
            b.spin() -= b.inv_inertia * detail::couple_of<M>(dr);
        }
        problem.each_side([&](WallBody<M>& side, int d) {
            side.speed += side.inv_mass * impulse[d] * (c.lever_i + c.lever_j) * c.normal[d] / problem.flow->length;
        });
    }
}

template <class M>
void apply_impulse(ContactProblem<M>& problem, const Contact<M>& c, const typename M::Impulse& dr, WithWall) {
    Body<M>& a = problem.bodies[static_cast<std::size_t>(c.i)];
    const typename M::Vec impulse = detail::impulse_vector<M>(dr, c.normal);
    a.linear() += a.inv_mass * impulse;
    if constexpr (M::friction) a.spin() -= (c.lever_i * a.inv_inertia) * detail::arm_cross<M>(c.normal, impulse);
    if constexpr (M::rolling) a.spin() += a.inv_inertia * detail::couple_of<M>(dr);
    WallBody<M>& wall = problem.walls[static_cast<std::size_t>(c.j)];
    wall.speed -= wall.inv_mass * impulse.dot(c.normal);
}
///@}

namespace detail {

/// Gives each contact c the impulse next(c) [N s], in the order of each_contact(). Bodies and driven walls get the
/// velocities that go with it.
template <class M>
void replace_impulses(ContactProblem<M>& problem, auto&& next) {
    each_contact(problem, [&](Contact<M>& c, auto kind) {
        const typename M::Impulse r = next(c), change = r - c.r;
        apply_impulse(problem, c, change, kind);
        c.r = r;
    });
}

/// The diagonal of the Delassus block, diag(W_n, W_t, W_t). W_nt = 0, and W_t is isotropic, for disks and spheres.
/// Where contacts have couples, W_s of these, and what friction does to spins.
struct DelassusDiagonal {
    double normal;        ///< W_n [1/kg]
    double tangential;    ///< W_t [1/kg]; 0 in a frictionless scene
    double spin = 0;      ///< W_s [1/(kg m^2)]; 0 without couples
    double coupling = 0;  ///< l_i/I_i - l_j/I_j [1/(kg m)]; 0 without couples
};

///@{
/// W_n and W_t of one contact. With `split` they have this copy's masses (the sweep), else whole masses (the residual).
template <class M>
DelassusDiagonal delassus(const ContactProblem<M>& problem, const Contact<M>& c, bool split, BetweenGrains) {
    const auto i = static_cast<std::size_t>(c.i), j = static_cast<std::size_t>(c.j);
    const double si = split ? 1.0 : 1.0 / problem.copies(i), sj = split ? 1.0 : 1.0 / problem.copies(j);
    const Body<M>&a = problem.bodies[i], &b = problem.bodies[j];
    DelassusDiagonal w{si * a.inv_mass + sj * b.inv_mass, 0};
    if constexpr (M::friction)
        w.tangential =
            w.normal + si * c.lever_i * c.lever_i * a.inv_inertia + sj * c.lever_j * c.lever_j * b.inv_inertia;
    if constexpr (M::rolling) {
        w.spin = si * a.inv_inertia + sj * b.inv_inertia;
        w.coupling = si * c.lever_i * a.inv_inertia - sj * c.lever_j * b.inv_inertia;
    }
    return w;
}

template <class M>
DelassusDiagonal delassus(const ContactProblem<M>& problem, const Contact<M>& c, bool split, WithWall) {
    const auto i = static_cast<std::size_t>(c.i), j = static_cast<std::size_t>(c.j);
    const double si = split ? 1.0 : 1.0 / problem.copies(i);
    const Body<M>& a = problem.bodies[i];
    DelassusDiagonal w{si * a.inv_mass, 0};
    // a driven wall gives way along its normal only, so it adds nothing to W_t
    if constexpr (M::friction) w.tangential = w.normal + si * c.lever_i * c.lever_i * a.inv_inertia;
    if constexpr (M::rolling) {
        w.spin = si * a.inv_inertia;
        w.coupling = si * c.lever_i * a.inv_inertia;
    }
    const double sw = split ? 1.0 : 1.0 / problem.wall_copies(j), give = sw * problem.walls[j].inv_mass;
    w.normal += give;
    if constexpr (M::friction) {
        // on a fixed body friction moves nothing: any scale does for its impulse
        if (w.tangential == 0) w.tangential = give;
        if constexpr (M::rolling)
            if (w.spin == 0) w.spin = give / (c.lever_i * c.lever_i);
    }
    return w;
}
///@}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
