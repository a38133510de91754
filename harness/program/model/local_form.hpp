// Between problems as files hold them and as the kernel solves them.
#pragma once

#include <fmt/format.h>

#include "files/fclib.hpp"
#include "nscdd/law/error_measures.hpp"

namespace nscdd {

template <int dim>
using LocalVectors = std::vector<typename DelassusProblem<dim>::Vec>;

template <int dim>
Eigen::VectorXd flat(const LocalVectors<dim>& vectors) {
    Eigen::VectorXd out(dim * static_cast<Eigen::Index>(vectors.size()));
    for (std::size_t c = 0; c < vectors.size(); ++c) out.segment<dim>(dim * static_cast<Eigen::Index>(c)) = vectors[c];
    return out;
}

template <int dim>
LocalVectors<dim> by_contact(const Eigen::VectorXd& values) {
    LocalVectors<dim> out;
    for (Eigen::Index c = 0; c < values.size(); c += dim) out.emplace_back(values.segment<dim>(c));
    return out;
}

// Throws std::runtime_error when a contact cannot move along its normal.
template <int dim>
DelassusProblem<dim> to_blocks(const LocalProblem& local) {
    DelassusProblem<dim> problem;
    problem.q = by_contact<dim>(local.q);
    problem.friction.assign(local.friction.begin(), local.friction.end());
    std::vector<typename DelassusProblem<dim>::Entry> entries;
    std::vector<std::size_t> entry_of_row(problem.contact_count(), 0);  // plus one; 0: none yet
    for (int column = 0; column < static_cast<int>(problem.contact_count()); ++column) {
        const std::size_t first = entries.size();
        for (int k = 0; k < dim; ++k)
            for (Eigen::SparseMatrix<double>::InnerIterator value(local.w, column * dim + k); value; ++value) {
                const auto row = value.row() / dim;
                std::size_t& entry = entry_of_row[static_cast<std::size_t>(row)];
                if (entry <= first) {
                    entries.push_back({static_cast<int>(row), column, DelassusProblem<dim>::Block::Zero()});
                    entry = entries.size();
                }
                entries[entry - 1].block(value.row() % dim, k) += value.value();
            }
    }
    problem.set_blocks(std::move(entries));
    for (std::size_t c = 0; c < problem.contact_count(); ++c)
        if (const double wn = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])](0, 0); !(wn > 0))
            throw std::runtime_error(fmt::format("contact {}: W_NN is {}, it must be positive", c, wn));
    return problem;
}

template <int dim>
LocalProblem to_sparse(const DelassusProblem<dim>& problem) {
    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(problem.blocks.size() * dim * dim);
    for (std::size_t row = 0; row < problem.contact_count(); ++row)
        for (int b = problem.row_begin[row]; b < problem.row_begin[row + 1]; ++b) {
            const auto block = static_cast<std::size_t>(b);
            for (int i = 0; i < dim; ++i)
                for (int j = 0; j < dim; ++j)
                    triplets.emplace_back(static_cast<int>(row) * dim + i, problem.columns[block] * dim + j,
                                          problem.blocks[block](i, j));
        }
    LocalProblem local;
    local.dim = dim;
    local.q = flat<dim>(problem.q);
    local.friction =
        Eigen::Map<const Eigen::VectorXd>(problem.friction.data(), static_cast<Eigen::Index>(problem.friction.size()));
    local.w.resize(local.q.size(), local.q.size());
    local.w.setFromTriplets(triplets.begin(), triplets.end());
    return local;
}

// r as a solution, with u = W r + q and its errors.
template <int dim>
FclibSolution to_solution(const DelassusProblem<dim>& problem, const LocalVectors<dim>& r, const ErrorMeasures& errors,
                          const std::string& solver) {
    LocalVectors<dim> u;
    for (std::size_t c = 0; c < r.size(); ++c) u.push_back(problem.velocity(c, r));
    FclibSolution solution;
    solution.r = flat<dim>(r);
    solution.u = flat<dim>(u);
    solution.natural_map = errors.natural_map;
    solution.eta = errors.eta;
    solution.solver = solver;
    return solution;
}

}  // namespace nscdd
