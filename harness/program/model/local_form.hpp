// Between problems as files hold them and as the kernel solves them.
#pragma once

#include <fmt/format.h>

#include "files/fclib.hpp"
#include "nscdd/law/error_measures.hpp"

namespace nscdd {

template <int dim, bool rolls = false>
using LocalVectors = std::vector<typename DelassusProblem<dim, rolls>::Vec>;

template <class Vec>
Eigen::VectorXd flat(const std::vector<Vec>& vectors) {
    constexpr int size = Vec::RowsAtCompileTime;
    Eigen::VectorXd out(size * static_cast<Eigen::Index>(vectors.size()));
    for (std::size_t c = 0; c < vectors.size(); ++c)
        out.segment<size>(size * static_cast<Eigen::Index>(c)) = vectors[c];
    return out;
}

template <class Vec>
std::vector<Vec> by_contact(const Eigen::VectorXd& values) {
    constexpr int size = Vec::RowsAtCompileTime;
    std::vector<Vec> out;
    for (Eigen::Index c = 0; c < values.size(); c += size) out.emplace_back(values.segment<size>(c));
    return out;
}

// Throws std::runtime_error when a contact cannot move along its normal.
template <int dim, bool rolls = false>
DelassusProblem<dim, rolls> to_blocks(const LocalProblem& local) {
    using Problem = DelassusProblem<dim, rolls>;
    constexpr int size = Problem::size;
    Problem problem;
    problem.q = by_contact<typename Problem::Vec>(local.q);
    problem.friction.assign(local.friction.begin(), local.friction.end());
    problem.rolling.assign(local.rolling.begin(), local.rolling.end());
    std::vector<typename Problem::Entry> entries;
    std::vector<std::size_t> entry_of_row(problem.contact_count(), 0);  // plus one; 0: none yet
    for (int column = 0; column < static_cast<int>(problem.contact_count()); ++column) {
        const std::size_t first = entries.size();
        for (int k = 0; k < size; ++k)
            for (Eigen::SparseMatrix<double>::InnerIterator value(local.w, column * size + k); value; ++value) {
                const auto row = value.row() / size;
                std::size_t& entry = entry_of_row[static_cast<std::size_t>(row)];
                if (entry <= first) {
                    entries.push_back({static_cast<int>(row), column, Problem::Block::Zero()});
                    entry = entries.size();
                }
                entries[entry - 1].block(value.row() % size, k) += value.value();
            }
    }
    problem.set_blocks(std::move(entries));
    for (std::size_t c = 0; c < problem.contact_count(); ++c)
        if (const double wn = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])](0, 0); !(wn > 0))
            throw std::runtime_error(fmt::format("contact {}: W_NN is {}, it must be positive", c, wn));
    return problem;
}

template <int dim, bool rolls>
LocalProblem to_sparse(const DelassusProblem<dim, rolls>& problem) {
    constexpr int size = DelassusProblem<dim, rolls>::size;
    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(problem.blocks.size() * size * size);
    for (std::size_t row = 0; row < problem.contact_count(); ++row)
        for (int b = problem.row_begin[row]; b < problem.row_begin[row + 1]; ++b) {
            const auto block = static_cast<std::size_t>(b);
            for (int i = 0; i < size; ++i)
                for (int j = 0; j < size; ++j)
                    triplets.emplace_back(static_cast<int>(row) * size + i, problem.columns[block] * size + j,
                                          problem.blocks[block](i, j));
        }
    LocalProblem local;
    local.dim = dim;
    local.q = flat(problem.q);
    local.friction = to_vector(problem.friction);
    local.rolling = to_vector(problem.rolling);
    local.w.resize(local.q.size(), local.q.size());
    local.w.setFromTriplets(triplets.begin(), triplets.end());
    return local;
}

// r as a solution, with u = W r + q and its errors.
template <int dim, bool rolls>
FclibSolution to_solution(const DelassusProblem<dim, rolls>& problem, const LocalVectors<dim, rolls>& r,
                          const ErrorMeasures& errors, const std::string& solver) {
    LocalVectors<dim, rolls> u;
    for (std::size_t c = 0; c < r.size(); ++c) u.push_back(problem.velocity(c, r));
    FclibSolution solution;
    solution.r = flat(r);
    solution.u = flat(u);
    solution.natural_map = errors.natural_map;
    solution.eta = errors.eta;
    solution.solver = solver;
    return solution;
}

}  // namespace nscdd
