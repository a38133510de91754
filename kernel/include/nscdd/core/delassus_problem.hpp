// The contact problem in local form: u = W r + q and the law, with the Delassus operator W stored by blocks.
//
// For problems of other codes, whose blocks need not be diagonal, and as an oracle; scenes of grains are solved
// matrix-free (contact_problem.hpp). Components of a contact: normal first, then tangential, as in FCLIB.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace nscdd {

// Law of each contact: 0 <= u_n perp r_n >= 0, |r_t| <= mu r_n, u_t != 0 => r_t = -mu r_n u_t/|u_t|.
template <int Dimension>
struct DelassusProblem {
    static constexpr int dim = Dimension;
    using Vec = Eigen::Matrix<double, dim, 1, Eigen::DontAlign>;
    using Block = Eigen::Matrix<double, dim, dim, Eigen::DontAlign>;

    // W by rows of blocks: those of row c are blocks[k], in block column columns[k], for row_begin[c] <= k <
    // row_begin[c + 1], by ascending column; diagonal[c] is the k of W_cc, which is always there.
    std::vector<int> row_begin{0}, columns, diagonal;
    std::vector<Block> blocks;
    std::vector<Vec> q;            // free relative velocity, bias included [m/s]
    std::vector<double> friction;  // mu of each contact

    std::size_t contact_count() const { return q.size(); }

    // u = W r + q at one contact.
    Vec velocity(std::size_t c, const std::vector<Vec>& r) const {
        Vec u = q[c];
        for (int k = row_begin[c]; k < row_begin[c + 1]; ++k)
            u +=
                blocks[static_cast<std::size_t>(k)] * r[static_cast<std::size_t>(columns[static_cast<std::size_t>(k)])];
        return u;
    }

    std::size_t bytes() const {
        return blocks.size() * (sizeof(Block) + sizeof(int)) + contact_count() * (2 * sizeof(Vec) + sizeof(double));
    }
};

}  // namespace nscdd
