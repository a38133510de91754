/// @file
/// A scene's contact problem in local form, W = H^T M^-1 H stored by blocks, and its impulses there and back.
///
/// The order is that of each_contact(), the axes those of contact_frame(). The bias (g+/h, or e v_n-) is part of q_n.
/// The couple of a contact that rolls is about its tangents; there must be no resistance to twisting. A frictionless
/// model gives all components too, with mu = 0 and grains that do not turn. Inverse masses are taken as they stand:
/// whole ones on one subdomain. A driven wall couples all its contacts.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <concepts>
#include <stdexcept>

#include <Eigen/Geometry>

#include "nscdd/core/delassus_problem.hpp"
#include "nscdd/core/rolling.hpp"
#include "nscdd/reference/body_map.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Axes of one contact, unit vectors in world axes: rows N, T(, S).
template <class M>
using ContactFrame = Eigen::Matrix<double, M::dim, M::dim, Eigen::DontAlign>;

/// Axes of a contact, in rows N, T(, S). The normal comes first; the tangents depend on nothing else and are
/// right-handed.
template <class M>
ContactFrame<M> contact_frame(const typename M::Vec& normal) {
    ContactFrame<M> frame;
    frame.row(0) = normal.transpose();
    if constexpr (M::dim == 2) {
        frame.row(1) << -normal[1], normal[0];
    } else {
        const Eigen::Vector3d n = normal, t = n.unitOrthogonal();
        frame.row(1) = t.transpose();
        frame.row(2) = n.cross(t).transpose();
    }
    return frame;
}

/// A law that problems in local form have: Coulomb's, which may resist rolling.
template <class L>
concept InLocalForm = SolvedOnCone<L> || std::same_as<L, Rolling>;

/// The local form of a model's problem.
template <class M>
using LocalForm = DelassusProblem<M::dim, M::rolling>;

/// Axes of the couple, in rows, from the axes of the contact: its tangents; in 2D across the plane.
template <class M>
auto couple_frame(const ContactFrame<M>& frame) {
    Eigen::Matrix<double, M::dim - 1, M::spins, Eigen::DontAlign | (M::dim == 2 ? Eigen::RowMajor : Eigen::ColMajor)>
        axes;
    if constexpr (M::dim == 2)
        axes << 1;
    else
        axes = frame.template bottomRows<2>();
    return axes;
}

/// From the velocity of grain i (sign 1) or j (-1) to its part of u.
template <class M>
auto local_map(const ContactFrame<M>& frame, const Contact<M>& c, double sign) {
    Eigen::Matrix<double, LocalForm<M>::size, M::dof, Eigen::DontAlign> map;
    map.template topRows<M::dim>() = body_map(frame, c, sign);
    if constexpr (M::rolling) {
        map.template bottomLeftCorner<M::dim - 1, M::dim>().setZero();
        map.template bottomRightCorner<M::dim - 1, M::spins>() = sign * couple_frame<M>(frame);
    }
    return map;
}

template <class M>
double friction_of(const Contact<M>& c) {
    if constexpr (M::friction)
        return c.friction_coefficient;
    else
        return 0;
}

/// Throws std::invalid_argument for a contact that resists twisting, which the local form does not know.
template <class M>
void refuse_twisting(const ContactProblem<M>& problem) {
    if constexpr (M::rolling && M::dim == 3)
        each_contact(problem, [](const Contact<M>& c, auto) {
            if (c.twisting_coefficient > 0)
                throw std::invalid_argument("resistance to twisting has no local form: exchange files do not know it");
        });
}

/// The part of u that no body and no driven wall makes: bias, flow, and what moves as prescribed.
template <class M>
typename LocalForm<M>::Vec prescribed_velocity(const ContactProblem<M>& problem, const Contact<M>& c,
                                               const ContactFrame<M>& frame, auto kind) {
    typename LocalForm<M>::Vec u = LocalForm<M>::Vec::Unit(0) * c.bias;
    if constexpr (std::is_same_v<decltype(kind), BetweenGrains>) {
        if constexpr (M::friction)
            if (problem.flow)
                u.template head<M::dim>() +=
                    (c.lever_i + c.lever_j) * (frame * flow_over<M>(problem.flow_gradient(), c.normal));
    } else {
        u.template head<M::dim>() -= frame * problem.walls[static_cast<std::size_t>(c.j)].prescribed;
    }
    return u;
}

}  // namespace detail

/// The impulses in the axes of each contact [N s, couples N m s], in the order of each_contact().
template <class M>
std::vector<typename detail::LocalForm<M>::Vec> local_impulses(const ContactProblem<M>& problem) {
    std::vector<typename detail::LocalForm<M>::Vec> r;
    detail::each_contact(problem, [&](const Contact<M>& c, auto) {
        const detail::ContactFrame<M> frame = detail::contact_frame<M>(c.normal);
        auto& local = r.emplace_back(detail::LocalForm<M>::Vec::Zero());
        if constexpr (M::friction)
            local.template head<M::dim>() = frame * detail::force_of<M>(c.r);
        else
            local[0] = c.r[0];
        if constexpr (M::rolling)
            local.template tail<M::dim - 1>() = detail::couple_frame<M>(frame) * detail::couple_of<M>(c.r);
    });
    return r;
}

/// Gives the contacts these impulses, and the bodies and driven walls the velocities that go with them.
template <class M>
void set_local_impulses(ContactProblem<M>& problem, const std::vector<typename detail::LocalForm<M>::Vec>& r) {
    detail::replace_impulses(problem, [&r, k = std::size_t{0}](const Contact<M>& c) mutable -> typename M::Impulse {
        const typename detail::LocalForm<M>::Vec& local = r[k++];
        const detail::ContactFrame<M> frame = detail::contact_frame<M>(c.normal);
        if constexpr (M::rolling)
            return detail::with_couple<M>(
                frame.transpose() * local.template head<M::dim>(),
                detail::couple_frame<M>(frame).transpose() * local.template tail<M::dim - 1>());
        else if constexpr (M::friction)
            return frame.transpose() * local;
        else
            return local.template head<1>();
    });
}

/// W [1/kg], q [m/s] and mu of a problem; where it rolls mu_r [m], too. Its velocities must be consistent with the
/// impulses, as before or after nlgs(). Throws std::invalid_argument for a contact that resists twisting.
template <class M>
detail::LocalForm<M> assemble(ContactProblem<M> problem) {
    static_assert(detail::InLocalForm<typename M::Law>, "problems in local form have Coulomb's law, or Rolling");
    using Local = detail::LocalForm<M>;
    detail::refuse_driven_cell(problem);
    detail::refuse_twisting(problem);
    detail::replace_impulses(problem, [](const Contact<M>&) { return M::Impulse::Zero(); });

    struct Side {  // a contact as one of its bodies sees it
        int contact;
        Eigen::Matrix<double, Local::size, M::dof, Eigen::DontAlign> map;
    };
    std::vector<std::vector<Side>> sides(problem.bodies.size());
    std::vector<std::vector<int>> pushes(problem.walls.size());
    Local local;
    detail::each_contact(problem, [&](const Contact<M>& c, auto kind) {
        const int index = static_cast<int>(local.q.size());
        const detail::ContactFrame<M> frame = detail::contact_frame<M>(c.normal);
        typename Local::Vec u = detail::prescribed_velocity(problem, c, frame, kind);
        const auto add = [&](int body, double sign) {
            const auto b = static_cast<std::size_t>(body);
            sides[b].push_back({index, detail::local_map(frame, c, sign)});
            u += sides[b].back().map * problem.bodies[b].v;
        };
        add(c.i, 1);
        if constexpr (std::is_same_v<decltype(kind), BetweenGrains>) {
            add(c.j, -1);
        } else {
            const auto w = static_cast<std::size_t>(c.j);
            u[0] -= problem.walls[w].speed;
            if (problem.walls[w].inv_mass > 0) pushes[w].push_back(index);
        }
        local.q.push_back(u);
        local.friction.push_back(detail::friction_of(c));
        if constexpr (M::rolling) local.rolling.push_back(c.rolling_coefficient);
    });

    std::vector<typename Local::Entry> entries;
    for (std::size_t b = 0; b < sides.size(); ++b)
        for (const Side& row : sides[b]) {
            const auto scaled = (row.map * detail::inverse_mass(problem.bodies[b]).asDiagonal()).eval();
            for (const Side& column : sides[b])
                entries.push_back({row.contact, column.contact, scaled * column.map.transpose()});
        }
    for (std::size_t w = 0; w < pushes.size(); ++w) {
        typename Local::Block block = Local::Block::Zero();
        block(0, 0) = problem.walls[w].inv_mass;
        for (int row : pushes[w])
            for (int column : pushes[w]) entries.push_back({row, column, block});
    }
    local.set_blocks(std::move(entries));
    return local;
}

}}  // namespace nscdd::NSCDD_ABI
