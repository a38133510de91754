/// @file
/// H^T of one contact, written out. Solvers that store matrices assemble them from it.
#pragma once

#include "nscdd/law/kinematics.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Throws std::invalid_argument for a cell whose sides a stress drives: they couple all contacts.
template <class M>
void refuse_driven_cell(const ContactProblem<M>& problem) {
    if (problem.flow && problem.flow->driven())
        throw std::invalid_argument(
            "a cell that a stress drives has no local form: Newton's method and exchange files do not know it");
}

/// From the velocity of grain i (sign 1) or j (-1) of a contact to its part of the relative velocity. `axes`: rows of
/// unit vectors in which that is wanted.
template <class M>
auto body_map(const auto& axes, const Contact<M>& c, double sign) {
    constexpr int rows = std::decay_t<decltype(axes)>::RowsAtCompileTime;
    Eigen::Matrix<double, rows, M::dof, Eigen::DontAlign | (rows == 1 ? Eigen::RowMajor : Eigen::ColMajor)> map;
    map.template leftCols<M::dim>() = sign * axes;
    if constexpr (M::friction) {
        const typename M::Vec arm = (sign > 0 ? -c.lever_i : c.lever_j) * c.normal;
        for (int k = 0; k < M::spins; ++k)
            map.col(M::dim + k) = sign * (axes * spin_cross<M>(typename M::Spin(M::Spin::Unit(k)), arm));
    }
    return map;
}

/// The diagonal of M^-1 of one body, 1/mass for translations, then 1/inertia for spins.
template <class M>
typename M::Velocity inverse_mass(const Body<M>& body) {
    typename M::Velocity diagonal = M::Velocity::Constant(body.inv_mass);
    if constexpr (M::friction) diagonal.template tail<M::spins>().setConstant(body.inv_inertia);
    return diagonal;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
