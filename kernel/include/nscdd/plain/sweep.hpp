/// @file
/// One sweep of NLGS, written as in METHOD.md, section 4: H, M^-1 and W are matrices, contact by contact. It is for
/// readers. It is some ten times slower than sweep/, which tests hold to it, and knows Coulomb's law and the
/// frictionless one alone.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <Eigen/Dense>
#include <type_traits>

#include "nscdd/core/contact_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace plain {

/// The law in the contact's own axes, normal first. W is any diagonal block with W_t isotropic.
template <class M>
Eigen::VectorXd contact_law(const Eigen::VectorXd& v, const Eigen::VectorXd& r, const Eigen::MatrixXd& w, double bias,
                            double mu) {
    Eigen::VectorXd next = r;
    next[0] = (std::max)(0.0, r[0] - (v[0] + bias) / w(0, 0));
    if constexpr (M::friction) {
        const Eigen::Index tangents = M::dim - 1;
        next.tail(tangents) = r.tail(tangents) - v.tail(tangents) / w(1, 1);
        const double length = next.tail(tangents).norm();
        if (length > mu * next[0]) next.tail(tangents) *= mu * next[0] / length;
    }
    return next;
}

/// Axes of a contact; rows are normal, then tangents. Any orthonormal tangents do. contact_frame() is not used, so that
/// no step is shared with the fast sweep.
template <class M>
Eigen::MatrixXd contact_axes(const typename M::Vec& normal) {
    Eigen::MatrixXd axes(M::friction ? M::dim : 1, M::dim);
    axes.row(0) = normal.transpose();
    if constexpr (M::friction && M::dim == 2) axes.row(1) << -normal[1], normal[0];
    if constexpr (M::friction && M::dim == 3) {
        const Eigen::Vector3d n = normal;
        const Eigen::Vector3d t = n.unitOrthogonal();
        axes.row(1) = t.transpose();
        axes.row(2) = n.cross(t).transpose();
    }
    return axes;
}

/// H^T of one body. It maps the generalised velocity to the velocity of the point at `arm`, in contact axes.
template <class M>
Eigen::MatrixXd contact_map(const Eigen::MatrixXd& axes, const typename M::Vec& arm) {
    Eigen::MatrixXd point(M::dim, M::dof);  // velocity of the point in world axes
    point.setZero();
    point.leftCols(M::dim).setIdentity();
    if constexpr (M::friction && M::dim == 2) point.col(2) << -arm[1], arm[0];
    if constexpr (M::friction && M::dim == 3)
        for (int k = 0; k < 3; ++k) {
            const Eigen::Vector3d unit = Eigen::Vector3d::Unit(k), a = arm;
            point.block<3, 1>(0, 3 + k) = unit.cross(a);
        }
    return axes * point;
}

/// The matrix M^-1 of a body.
template <class M>
Eigen::MatrixXd inverse_mass(const Body<M>& body) {
    Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(M::dof, body.inv_mass);
    if constexpr (M::friction) diagonal.tail(M::spins).setConstant(body.inv_inertia);
    return diagonal.asDiagonal();
}

/// Adds factor M^-1 H r to V.
template <class M>
void add_impulses(ContactProblem<M>& problem, double factor) {
    const auto add = [&](const Contact<M>& c, int body, double sign, double lever) {
        Body<M>& a = problem.bodies[static_cast<std::size_t>(body)];
        const Eigen::MatrixXd axes = contact_axes<M>(c.normal), h = contact_map<M>(axes, -sign * lever * c.normal);
        Eigen::VectorXd r = c.r;
        if constexpr (M::friction) r = axes * c.r;
        a.v += sign * factor * (inverse_mass(a) * h.transpose() * r);
    };
    for (const std::vector<Contact<M>>* contacts : {&problem.wall_contacts, &problem.contacts})
        for (const Contact<M>& c : *contacts) {
            double lever_i = 0, lever_j = 0;
            if constexpr (M::friction) lever_i = c.lever_i, lever_j = c.lever_j;
            add(c, c.i, 1, lever_i);
            if (contacts == &problem.contacts) add(c, c.j, -1, lever_j);
        }
}

/// Sweeps all contacts once, those with walls first. It reads and writes velocities and impulses of the problem.
template <class M>
void sweep(ContactProblem<M>& problem) {
    static_assert(std::is_same_v<typename M::Law, Coulomb> || std::is_same_v<typename M::Law, Frictionless>,
                  "nscdd: the plain sweep knows Coulomb's law and the frictionless one alone");
    const auto local = [](const Eigen::MatrixXd& axes, const Contact<M>& c) -> Eigen::VectorXd {
        if constexpr (M::friction)
            return axes * c.r;
        else
            return c.r;
    };
    const auto store = [](const Eigen::MatrixXd& axes, const Eigen::VectorXd& r, Contact<M>& c) {
        if constexpr (M::friction)
            c.r = axes.transpose() * r;
        else
            c.r = r;
    };
    double mu = 0, lever_i = 0, lever_j = 0;
    const auto read_friction = [&](const Contact<M>& c) {
        if constexpr (M::friction) mu = c.friction_coefficient, lever_i = c.lever_i, lever_j = c.lever_j;
    };

    for (Contact<M>& c : problem.wall_contacts) {
        read_friction(c);
        Body<M>& a = problem.bodies[static_cast<std::size_t>(c.i)];
        WallBody<M>& wall = problem.walls[static_cast<std::size_t>(c.j)];
        const Eigen::MatrixXd axes = contact_axes<M>(c.normal);
        const Eigen::MatrixXd ha = contact_map<M>(axes, -lever_i * c.normal);
        Eigen::MatrixXd w = ha * inverse_mass(a) * ha.transpose();
        Eigen::VectorXd v = ha * a.v - axes * wall.prescribed;
        w(0, 0) += wall.inv_mass;
        v[0] -= wall.speed;
        const Eigen::VectorXd r = local(axes, c);
        const Eigen::VectorXd next = contact_law<M>(v, r, w, c.bias, mu);
        a.v += inverse_mass(a) * ha.transpose() * (next - r);
        wall.speed -= wall.inv_mass * (next[0] - r[0]);
        store(axes, next, c);
    }
    for (Contact<M>& c : problem.contacts) {
        read_friction(c);
        Body<M>&a = problem.bodies[static_cast<std::size_t>(c.i)], &b = problem.bodies[static_cast<std::size_t>(c.j)];
        const Eigen::MatrixXd axes = contact_axes<M>(c.normal);
        const Eigen::MatrixXd ha = contact_map<M>(axes, -lever_i * c.normal),
                              hb = contact_map<M>(axes, lever_j * c.normal);
        const Eigen::MatrixXd w = ha * inverse_mass(a) * ha.transpose() + hb * inverse_mass(b) * hb.transpose();
        const Eigen::VectorXd r = local(axes, c);
        Eigen::VectorXd v = ha * a.v - hb * b.v;
        if (problem.flow) v += (lever_i + lever_j) * (axes * detail::flow_over<M>(problem.flow_gradient(), c.normal));
        const Eigen::VectorXd next = contact_law<M>(v, r, w, c.bias, mu);
        a.v += inverse_mass(a) * ha.transpose() * (next - r);
        b.v -= inverse_mass(b) * hb.transpose() * (next - r);
        problem.each_side([&](WallBody<M>& side, int d) {
            const Eigen::VectorXd impulse = axes.transpose() * (next - r);
            side.speed += side.inv_mass * impulse[d] * (lever_i + lever_j) * c.normal[d] / problem.flow->length;
        });
        store(axes, next, c);
    }
}

}}}  // namespace nscdd::NSCDD_ABI::plain
