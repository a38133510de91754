#pragma once

#include "nscdd/core/contact_law.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Dimension and contact law of a scene (contact_law.hpp), decided at compile time.
/// ```
/// using Model = nscdd::Model<3, nscdd::Coulomb>;
/// Model::Velocity v;                 // 3 translations, 3 spins
/// ```
/// A model stores and computes only its own parts: a frictionless grain has no spin, a frictionless contact one scalar
/// impulse. Wall::driven says at run time whether a force pushes a wall.
template <int Dimension, class ContactLaw>
struct Model {
    static_assert(Dimension == 2 || Dimension == 3, "nscdd models disks (2) and spheres (3)");
    static_assert(detail::complete_law<ContactLaw>());

    using Law = ContactLaw;                                              ///< contact law of all contacts
    static constexpr int dim = Dimension;                                ///< 2: disks, 3: spheres
    static constexpr bool friction = Law::friction;                      ///< whether impulses have a tangential part
    static constexpr int spins = friction ? (dim == 3 ? 3 : 1) : 0;      ///< spins of one grain
    static constexpr int dof = dim + spins;                              ///< degrees of freedom of one grain
    static constexpr bool rolling = friction && detail::law_rolls<Law>;  ///< whether impulses have a couple
    static constexpr int couples = rolling ? spins : 0;                  ///< components of it

    using Vec = Eigen::Matrix<double, dim, 1, Eigen::DontAlign>;       ///< a place, a direction, a translation
    using Spin = Eigen::Matrix<double, spins, 1, Eigen::DontAlign>;    ///< [rad/s]; of size 0 without friction
    using Velocity = Eigen::Matrix<double, dof, 1, Eigen::DontAlign>;  ///< translations, then spins
    /// World axes, or along n alone; then the couple, if there is one.
    using Impulse = Eigen::Matrix<double, (friction ? dim : 1) + couples, 1, Eigen::DontAlign>;
    using Couple = Eigen::Matrix<double, couples, 1, Eigen::DontAlign>;  ///< [N m s]; of size 0 without couples
    /// Velocity gradient of a flow [1/s]; row: what moves, column: along what.
    using Gradient = Eigen::Matrix<double, dim, dim, Eigen::DontAlign>;
};

namespace detail {

///@{
/// The parts of an impulse: without the couple, in world axes or along n alone [N s]; and the couple [N m s]. Of a
/// relative velocity likewise: at the contact point [m/s], and the relative spin [rad/s].
template <class M>
decltype(auto) force_of(const typename M::Impulse& r) {
    if constexpr (M::rolling)
        return typename M::Vec(r.template head<M::dim>());
    else
        return (r);
}
template <class M>
typename M::Couple couple_of(const typename M::Impulse& r) {
    return r.template tail<M::couples>();
}
/// An impulse or a relative velocity of both parts. Without couples the second one is not looked at.
template <class M>
typename M::Impulse with_couple(const auto& force, const auto& couple) {
    if constexpr (M::rolling) {
        typename M::Impulse both;
        both.template head<M::dim>() = force;
        both.template tail<M::couples>() = couple;
        return both;
    } else {
        return force;
    }
}
///@}

/// Velocity spin x arm of a point at `arm` from the centre [m/s].
template <class M>
typename M::Vec spin_cross(const auto& spin, const typename M::Vec& arm) {
    if constexpr (M::dim == 3)
        return {spin[1] * arm[2] - spin[2] * arm[1], spin[2] * arm[0] - spin[0] * arm[2],
                spin[0] * arm[1] - spin[1] * arm[0]};
    else
        return {-spin[0] * arm[1], spin[0] * arm[0]};
}

/// Angular impulse arm x impulse about the centre [N m s]; one component in 2D.
template <class M>
typename M::Spin arm_cross(const typename M::Vec& arm, const typename M::Vec& impulse) {
    if constexpr (M::dim == 3)
        return {arm[1] * impulse[2] - arm[2] * impulse[1], arm[2] * impulse[0] - arm[0] * impulse[2],
                arm[0] * impulse[1] - arm[1] * impulse[0]};
    else
        return typename M::Spin{arm[0] * impulse[1] - arm[1] * impulse[0]};
}

/// What a flow adds to the velocity of a place that is `apart` from another one [m/s], in an order that no compiler
/// changes.
template <class M>
typename M::Vec flow_over(const typename M::Gradient& gradient, const typename M::Vec& apart) {
    typename M::Vec velocity = gradient.col(0) * apart[0];
    for (int d = 1; d < M::dim; ++d) velocity += gradient.col(d) * apart[d];
    return velocity;
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
