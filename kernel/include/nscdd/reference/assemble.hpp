/// @file
/// A scene's contact problem in local form, W = H^T M^-1 H stored by blocks, and its impulses there and back.
///
/// The order is that of each_contact(), the axes those of contact_frame(). The bias (g+/h, or e v_n-) is part of q_n. A
/// frictionless model gives all components too, with mu = 0 and grains that do not turn. Inverse masses are taken as
/// they stand: whole ones on one subdomain. A driven wall couples all its contacts.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <Eigen/Geometry>

#include "nscdd/core/delassus_problem.hpp"
#include "nscdd/reference/body_map.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

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

/// The impulses in the axes of each contact [N s], in the order of each_contact().
template <class M>
std::vector<typename DelassusProblem<M::dim>::Vec> local_impulses(const ContactProblem<M>& problem) {
    std::vector<typename DelassusProblem<M::dim>::Vec> r;
    each_contact(problem, [&](const Contact<M>& c, auto) {
        if constexpr (M::friction)
            r.push_back(contact_frame<M>(c.normal) * c.r);
        else
            r.push_back(DelassusProblem<M::dim>::Vec::Unit(0) * c.r[0]);
    });
    return r;
}

/// Gives the contacts these impulses, and the bodies and driven walls the velocities that go with them.
template <class M>
void set_local_impulses(ContactProblem<M>& problem, const std::vector<typename DelassusProblem<M::dim>::Vec>& r) {
    replace_impulses(problem, [&r, k = std::size_t{0}](const Contact<M>& c) mutable -> typename M::Impulse {
        if constexpr (M::friction)
            return contact_frame<M>(c.normal).transpose() * r[k++];
        else
            return r[k++].template head<1>();
    });
}

/// W [1/kg], q [m/s] and mu of a problem. Its velocities must be consistent with the impulses, as before or after
/// nlgs().
template <class M>
DelassusProblem<M::dim> assemble(ContactProblem<M> problem) {
    static_assert(SolvedOnCone<typename M::Law>, "problems in local form have Coulomb's law");
    using Local = DelassusProblem<M::dim>;
    detail::refuse_driven_cell(problem);
    replace_impulses(problem, [](const Contact<M>&) { return M::Impulse::Zero(); });

    struct Side {  // a contact as one of its bodies sees it
        int contact;
        Eigen::Matrix<double, M::dim, M::dof, Eigen::DontAlign> map;
    };
    std::vector<std::vector<Side>> sides(problem.bodies.size());
    std::vector<std::vector<int>> pushes(problem.walls.size());
    Local local;
    each_contact(problem, [&](const Contact<M>& c, auto kind) {
        const int index = static_cast<int>(local.q.size());
        const ContactFrame<M> frame = contact_frame<M>(c.normal);
        double mu = 0;
        if constexpr (M::friction) mu = c.friction_coefficient;
        typename Local::Vec u = Local::Vec::Unit(0) * c.bias;
        const auto add = [&](int body, double sign) {
            const auto b = static_cast<std::size_t>(body);
            sides[b].push_back({index, detail::body_map(frame, c, sign)});
            u += sides[b].back().map * problem.bodies[b].v;
        };
        add(c.i, 1);
        if constexpr (std::is_same_v<decltype(kind), BetweenGrains>) {
            add(c.j, -1);
            if constexpr (M::friction)
                if (problem.flow)
                    u += (c.lever_i + c.lever_j) * (frame * flow_over<M>(problem.flow_gradient(), c.normal));
        } else {
            const auto w = static_cast<std::size_t>(c.j);
            u -= frame * problem.walls[w].prescribed;
            u[0] -= problem.walls[w].speed;
            if (problem.walls[w].inv_mass > 0) pushes[w].push_back(index);
        }
        local.q.push_back(u);
        local.friction.push_back(mu);
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
