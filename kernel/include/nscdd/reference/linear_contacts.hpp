/// @file
/// A contact problem written out as sparse matrices for Newton methods, from bodies or from a stored W.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/SparseCore>

#include "nscdd/core/delassus_problem.hpp"
#include "nscdd/reference/body_map.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail::bases {

/// Data of each contact for methods on the friction cone, in the order of each_contact() or of the rows of W.
template <int size>
struct ConeContacts {
    using Vec = Eigen::Matrix<double, size, 1, Eigen::DontAlign>;  ///< impulse, velocity or normal of one contact

    std::vector<Vec> normal;       ///< unit, in the axes of impulses and velocities
    std::vector<double> friction;  ///< mu of each contact
    std::vector<double> weight;    ///< D: mean of the diagonal of W_cc [1/kg]

    std::size_t contacts() const { return normal.size(); }  ///< number of contacts

    /// Adds the contacts of bodies, in world axes, or without friction along the normal alone.
    template <class M>
    void add(const ContactProblem<M>& problem, const Contact<M>& c, auto kind) {
        static_assert(SolvedOnCone<typename M::Law>, "methods on the friction cone know Coulomb's law alone");
        const DelassusDiagonal w = delassus(problem, c, true, kind);
        weight.push_back((w.normal + (size - 1) * w.tangential) / size);
        if constexpr (M::friction)
            normal.push_back(c.normal), friction.push_back(c.friction_coefficient);
        else
            normal.push_back(Vec{1.0}), friction.push_back(0);
    }
    /// Adds all contacts of a stored W. Throws std::invalid_argument where its diagonal is not positive.
    void add(const DelassusProblem<size>& problem) {
        normal.assign(problem.contact_count(), Vec::Unit(0));
        friction = problem.friction;
        for (const int k : problem.diagonal) {
            weight.push_back(problem.blocks[static_cast<std::size_t>(k)].trace() / size);
            if (!(weight.back() > 0 && std::isfinite(weight.back())))
                throw std::invalid_argument("contact " + std::to_string(weight.size() - 1) +
                                            ": the diagonal of W is not positive");
        }
    }
};

}  // namespace detail::bases

/// u = u_free + L B r with the scaled state x = B r, whose |x|^2 is an energy.
///
/// For bodies x = M^(1/2) (V - V_free), L = H^T M^(-1/2) and B = L^T. For a stored W x = D^(-1/2) W r and L = D^(1/2),
/// with D the weights below. Without the scaling, mass ratios of 1e6 would enter norms and pivots.
template <int size>
struct LinearContacts : detail::bases::ConeContacts<size> {
    using detail::bases::ConeContacts<size>::weight, detail::bases::ConeContacts<size>::contacts;

    Eigen::SparseMatrix<double> velocity;  ///< L, size*contacts x states
    Eigen::SparseMatrix<double> state;     ///< B, states x size*contacts
    Eigen::VectorXd free;                  ///< u_free, bias included, size*contacts [m/s]

    Eigen::Index states() const { return state.rows(); }  ///< number of components of x

    /// The part of contact c in a vector over all contacts, such as u or r.
    static auto at(auto& all, std::size_t c) { return all.template segment<size>(static_cast<Eigen::Index>(c) * size); }

    /// u of impulses r [m/s], size*contacts.
    Eigen::VectorXd relative_velocity(const Eigen::VectorXd& r) const { return free + velocity * (state * r); }

    /// Sum of r^T D r, D the weights [J].
    double energy(const Eigen::VectorXd& r) const {
        double sum = 0;
        for (std::size_t c = 0; c < contacts(); ++c) sum += weight[c] * at(r, c).squaredNorm();
        return sum;
    }
};

namespace detail {

/// Number of components of an impulse of this model: all, in world axes, or the normal one alone.
template <class M>
constexpr int impulse_size = M::Impulse::RowsAtCompileTime;

/// Type of the matrices of a model's problems.
template <class M>
using LinearContactsOf = LinearContacts<impulse_size<M>>;

/// Velocity v + b n [m/s] that the law is about. LinearContacts and the gradient methods call it u.
template <class M>
typename M::Impulse biased_velocity(const ContactProblem<M>& problem, const Contact<M>& c, auto kind) {
    if constexpr (M::friction)
        return relative_velocity(problem, c, kind) + c.bias * c.normal;
    else
        return relative_velocity(problem, c, kind) + typename M::Impulse{c.bias};
}

}  // namespace detail

/// Writes out a problem of bodies. Their velocities must be consistent with the impulses. Driven walls are states of
/// one component each.
template <class M>
detail::LinearContactsOf<M> linear_contacts(ContactProblem<M> problem) {
    detail::refuse_driven_cell(problem);
    constexpr int size = detail::impulse_size<M>;
    detail::LinearContactsOf<M> linear;
    linear.free.resize(static_cast<Eigen::Index>(problem.contact_count()) * size);
    std::vector<Eigen::Triplet<double>> entries;
    detail::replace_impulses(problem, [](const Contact<M>&) { return M::Impulse::Zero(); });

    const int walls = static_cast<int>(problem.bodies.size()) * M::dof;
    const bool driven = problem.driven_walls();
    detail::each_contact(problem, [&](const Contact<M>& c, auto kind) {
        const auto put = [&](int state, const auto& map, const auto& inverse_mass) {
            const auto row = static_cast<int>(linear.contacts()) * size;
            for (int k = 0; k < map.cols(); ++k)
                for (int d = 0; d < size; ++d)
                    entries.emplace_back(row + d, state + k, std::sqrt(inverse_mass[k]) * map(d, k));
        };
        const auto put_contact = [&](const auto& axes) {
            const auto put_body = [&](int body, double sign) {
                put(body * M::dof, detail::body_map(axes, c, sign),
                    detail::inverse_mass(problem.bodies[static_cast<std::size_t>(body)]));
            };
            put_body(c.i, 1);
            if constexpr (std::is_same_v<decltype(kind), BetweenGrains>) {
                put_body(c.j, -1);
            } else if (driven) {
                const double inverse = problem.walls[static_cast<std::size_t>(c.j)].inv_mass;
                put(walls + c.j, typename M::Impulse(-axes * c.normal), &inverse);
            }
        };
        if constexpr (M::friction)
            put_contact(Eigen::Matrix<double, size, size, Eigen::DontAlign>::Identity());
        else
            put_contact(c.normal.transpose());
        linear.at(linear.free, linear.contacts()) = detail::biased_velocity(problem, c, kind);
        linear.add(problem, c, kind);
    });

    const int states = walls + (driven ? static_cast<int>(problem.walls.size()) : 0);
    linear.velocity.resize(linear.free.size(), states);
    linear.velocity.setFromTriplets(entries.begin(), entries.end());
    linear.state = linear.velocity.transpose();
    return linear;
}

/// Writes out a problem with a stored W. Throws std::invalid_argument where the diagonal of W is not positive.
template <int dim>
LinearContacts<dim> linear_contacts(const DelassusProblem<dim>& problem) {
    const auto size = static_cast<Eigen::Index>(problem.contact_count()) * dim;
    LinearContacts<dim> linear;
    linear.free.resize(size);
    linear.add(problem);
    std::vector<Eigen::Triplet<double>> scales, blocks;
    for (std::size_t c = 0; c < problem.contact_count(); ++c) {
        linear.at(linear.free, c) = problem.q[c];
        const double scale = std::sqrt(linear.weight[c]);
        const int row = static_cast<int>(c) * dim;
        for (int d = 0; d < dim; ++d) scales.emplace_back(row + d, row + d, scale);
        for (int k = problem.row_begin[c]; k < problem.row_begin[c + 1]; ++k) {
            const auto& block = problem.blocks[static_cast<std::size_t>(k)];
            const int column = problem.columns[static_cast<std::size_t>(k)] * dim;
            for (int i = 0; i < dim; ++i)
                for (int j = 0; j < dim; ++j)
                    if (block(i, j) != 0) blocks.emplace_back(row + i, column + j, block(i, j) / scale);
        }
    }
    linear.velocity.resize(size, size);
    linear.velocity.setFromTriplets(scales.begin(), scales.end());
    linear.state.resize(size, size);
    linear.state.setFromTriplets(blocks.begin(), blocks.end());
    return linear;
}

}}  // namespace nscdd::NSCDD_ABI
