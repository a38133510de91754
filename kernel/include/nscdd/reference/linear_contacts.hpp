// A contact problem written out as sparse matrices, what a Newton method needs: from bodies, or from a stored W.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/SparseCore>

#include "nscdd/core/delassus_problem.hpp"
#include "nscdd/law/kinematics.hpp"

namespace nscdd::inline NSCDD_ABI {

// u = u_free + L B r with the scaled state x = B r, whose |x|^2 is an energy: M^(1/2) (V - V_free) for bodies, where
// L = H^T M^(-1/2) and B = L^T; D^(-1/2) W r for a stored W, where L = D^(1/2), D the weights below. Without the
// scaling, mass ratios of 1e6 would enter norms and pivots.
template <int size>
struct LinearContacts {
    using Vec = Eigen::Matrix<double, size, 1, Eigen::DontAlign>;  // impulse, velocity or normal of one contact

    Eigen::SparseMatrix<double> velocity;  // L, size*contacts x states
    Eigen::SparseMatrix<double> state;     // B, states x size*contacts
    Eigen::VectorXd free;                  // u_free, bias included, size*contacts [m/s]
    std::vector<Vec> normal;               // unit, in the axes of u and r
    std::vector<double> friction;          // mu of each contact
    std::vector<double> weight;            // mean of the diagonal of W_cc [1/kg]

    std::size_t contacts() const { return normal.size(); }  // number of contacts
    Eigen::Index states() const { return state.rows(); }    // number of components of x

    // The part of contact c in a vector over all contacts, such as u or r.
    static auto at(auto& all, std::size_t c) { return all.template segment<size>(static_cast<Eigen::Index>(c) * size); }

    // u of impulses r [m/s], size*contacts.
    Eigen::VectorXd relative_velocity(const Eigen::VectorXd& r) const { return free + velocity * (state * r); }

    // Sum of r^T D r, D the weights [J].
    double energy(const Eigen::VectorXd& r) const {
        double sum = 0;
        for (std::size_t c = 0; c < contacts(); ++c) sum += weight[c] * at(r, c).squaredNorm();
        return sum;
    }
};

// Number of components of an impulse of this model: all, in world axes, or the normal one alone.
template <class M>
constexpr int impulse_size = M::Impulse::RowsAtCompileTime;

// The matrices of a model's problems.
template <class M>
using LinearContactsOf = LinearContacts<impulse_size<M>>;

// Impulses of all contacts [N s], those between grains first.
template <class M>
Eigen::VectorXd gather_impulses(const ContactProblem<M>& problem) {
    Eigen::VectorXd r(static_cast<Eigen::Index>(problem.contact_count()) * impulse_size<M>);
    std::size_t k = 0;
    for (const auto* contacts : {&problem.contacts, &problem.wall_contacts})
        for (const Contact<M>& c : *contacts) LinearContactsOf<M>::at(r, k++) = c.r;
    return r;
}

// From bodies; their velocities must be consistent with the impulses. Driven walls are states of one component each.
template <class M>
LinearContactsOf<M> linear_contacts(const ContactProblem<M>& problem) {
    static_assert(SolvedOnCone<typename M::Law>, "Newton's methods know Coulomb's law alone");
    constexpr int size = impulse_size<M>;
    LinearContactsOf<M> linear;
    linear.free.resize(static_cast<Eigen::Index>(problem.contact_count()) * size);
    std::vector<Eigen::Triplet<double>> entries;

    const auto put = [&](int state, double inverse_mass, const typename M::Vec& moves, const Contact<M>& c) {
        const auto row = static_cast<int>(linear.contacts()) * size;
        const double scale = std::sqrt(inverse_mass);
        if constexpr (M::friction)
            for (int d = 0; d < size; ++d) entries.emplace_back(row + d, state, scale * moves[d]);
        else
            entries.emplace_back(row, state, scale * moves.dot(c.normal));
    };
    const auto put_body = [&](int index, double side, const Contact<M>& c) {
        const Body<M>& body = problem.bodies[static_cast<std::size_t>(index)];
        for (int d = 0; d < M::dim; ++d) put(index * M::dof + d, body.inv_mass, side * M::Vec::Unit(d), c);
        if constexpr (M::friction)
            for (int d = 0; d < M::spins; ++d) {
                const typename M::Spin spin = (side > 0 ? c.lever_i : c.lever_j) * M::Spin::Unit(d);
                put(index * M::dof + M::dim + d, body.inv_inertia, -spin_cross<M>(spin, c.normal), c);
            }
    };
    const auto put_contact = [&](const Contact<M>& c, auto kind) {
        const DelassusDiagonal w = delassus(problem, c, true, kind);
        auto u = linear.at(linear.free, linear.contacts());
        u = relative_velocity(problem, c, kind);
        if constexpr (M::friction) {
            u += c.bias * c.normal;
            linear.normal.push_back(c.normal);
            linear.friction.push_back(c.friction_coefficient);
            linear.weight.push_back((w.normal + (size - 1) * w.tangential) / size);
        } else {
            u[0] += c.bias;
            linear.normal.push_back(typename M::Impulse{1.0});
            linear.friction.push_back(0);
            linear.weight.push_back(w.normal);
        }
    };

    for (const Contact<M>& c : problem.contacts) {
        put_body(c.i, 1, c);
        put_body(c.j, -1, c);
        put_contact(c, BetweenGrains{});
    }
    const int walls = static_cast<int>(problem.bodies.size()) * M::dof;
    const bool driven = problem.driven_walls();
    for (const Contact<M>& c : problem.wall_contacts) {
        put_body(c.i, 1, c);
        if (driven) put(walls + c.j, problem.walls[static_cast<std::size_t>(c.j)].inv_mass, -c.normal, c);
        put_contact(c, WithWall{});
    }

    const int states = walls + (driven ? static_cast<int>(problem.walls.size()) : 0);
    linear.velocity.resize(linear.free.size(), states);
    linear.velocity.setFromTriplets(entries.begin(), entries.end());
    linear.state = linear.velocity.transpose();
    linear.free -= linear.velocity * (linear.state * gather_impulses(problem));
    return linear;
}

// From a stored W. Throws std::invalid_argument where the diagonal of W is not positive.
template <int dim>
LinearContacts<dim> linear_contacts(const DelassusProblem<dim>& problem) {
    const auto size = static_cast<Eigen::Index>(problem.contact_count()) * dim;
    LinearContacts<dim> linear;
    linear.free.resize(size);
    linear.friction = problem.friction;
    linear.normal.assign(problem.contact_count(), LinearContacts<dim>::Vec::Unit(0));
    std::vector<Eigen::Triplet<double>> scales, blocks;
    for (std::size_t c = 0; c < problem.contact_count(); ++c) {
        linear.at(linear.free, c) = problem.q[c];
        const double weight = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])].trace() / dim;
        if (!(weight > 0 && std::isfinite(weight)))
            throw std::invalid_argument("contact " + std::to_string(c) + ": the diagonal of W is not positive");
        linear.weight.push_back(weight);
        const double scale = std::sqrt(weight);
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

}  // namespace nscdd
