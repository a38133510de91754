/// @file
/// The contact problem in local form: u = W r + q and the law. The Delassus operator W is stored by blocks.
///
/// It is for problems of other codes, whose blocks need not be diagonal, and for checks. Scenes of grains are solved
/// matrix-free (contact_problem.hpp). Components of a contact are ordered as in FCLIB: normal first, then tangential,
/// then those of the couple where contacts have one.
#pragma once

#include "nscdd/core/abi.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace nscdd { inline namespace NSCDD_ABI {

/// A problem with this law at each contact: 0 <= u_n perp r_n >= 0, |r_t| <= mu r_n, and r_t = -mu r_n u_t/|u_t| where
/// u_t != 0. With `Rolls` a contact has a couple c besides, about its tangents, and the relative spin w_t there:
/// |c| <= mu_r r_n, and c = -mu_r r_n w_t/|w_t| where w_t != 0.
template <int Dimension, bool Rolls = false>
struct DelassusProblem {
    static constexpr int dim = Dimension;              ///< of space, 2 or 3
    static constexpr bool rolls = Rolls;               ///< whether contacts have a couple
    static constexpr int tangents = dim - 1;           ///< components of r_t, and of the couple
    static constexpr int parts = rolls ? 2 : 1;        ///< r_t, and the couple
    static constexpr int size = 1 + parts * tangents;  ///< components of a contact
    /// Of one contact: normal, then tangential [N s or m/s], then the couple or the spin [N m s or rad/s].
    using Vec = Eigen::Matrix<double, size, 1, Eigen::DontAlign>;
    using Block = Eigen::Matrix<double, size, size, Eigen::DontAlign>;  ///< of W [1/kg; 1/(kg m); 1/(kg m^2)]
    using Limits = std::array<double, std::size_t{parts}>;  ///< mu, then mu_r [m]: the largest |r_t| and |c| over r_n

    ///@{
    /// W by rows of blocks. Those of row c are blocks[k], in block column columns[k], for row_begin[c] <= k <
    /// row_begin[c + 1], by ascending column. The number k of W_cc, which is always there, is diagonal[c].
    std::vector<int> row_begin{0}, columns, diagonal;
    ///@}
    std::vector<Block> blocks;     ///< blocks of W that are stored, row by row [1/kg]
    std::vector<Vec> q;            ///< free relative velocity, bias included [m/s]
    std::vector<double> friction;  ///< mu of each contact
    std::vector<double> rolling;   ///< mu_r of each contact [m]; empty without couples

    std::size_t contact_count() const { return q.size(); }  ///< number of contacts, from the size of q

    /// What bounds the parts of an impulse at contact c, over r_n.
    Limits limits(std::size_t c) const {
        if constexpr (rolls)
            return {friction[c], rolling[c]};
        else
            return {friction[c]};
    }

    /// One block of W, for set_blocks().
    struct Entry {
        int row;      ///< number of a contact, from 0
        int column;   ///< number of a contact, from 0
        Block block;  ///< velocity at `row` by the impulse at `column` [1/kg]
    };
    /// Sets W, once q has its size. Entries come in any order; those of one place are added up, in the order given.
    /// Throws std::invalid_argument for an entry of no contact.
    void set_blocks(std::vector<Entry> entries) {
        for (const Entry& e : entries)
            for (const int index : {e.row, e.column})
                if (index < 0 || static_cast<std::size_t>(index) >= contact_count())
                    throw std::invalid_argument("W has a block at row " + std::to_string(e.row) + ", column " +
                                                std::to_string(e.column) + ", but there are " +
                                                std::to_string(contact_count()) + " contacts");
        for (int c = 0; c < static_cast<int>(contact_count()); ++c) entries.push_back({c, c, Block::Zero()});
        const auto place = [](const Entry& e) { return std::pair(e.row, e.column); };
        std::stable_sort(entries.begin(), entries.end(),
                         [&](const Entry& a, const Entry& b) { return place(a) < place(b); });
        row_begin.assign(contact_count() + 1, 0);
        columns.clear(), diagonal.clear(), blocks.clear();
        for (std::size_t e = 0; e < entries.size(); ++e) {
            if (e > 0 && place(entries[e]) == place(entries[e - 1])) {
                blocks.back() += entries[e].block;
                continue;
            }
            if (entries[e].row == entries[e].column) diagonal.push_back(static_cast<int>(blocks.size()));
            columns.push_back(entries[e].column);
            blocks.push_back(entries[e].block);
            row_begin[static_cast<std::size_t>(entries[e].row) + 1] = static_cast<int>(blocks.size());
        }
    }

    /// Velocity u = W r + q at contact c [m/s]. r has one impulse [N s] for each contact.
    Vec velocity(std::size_t c, const std::vector<Vec>& r) const {
        Vec u = q[c];
        for (int k = row_begin[c]; k < row_begin[c + 1]; ++k)
            u +=
                blocks[static_cast<std::size_t>(k)] * r[static_cast<std::size_t>(columns[static_cast<std::size_t>(k)])];
        return u;
    }

    /// Memory that a sweep over the blocks reads and writes [bytes].
    std::size_t bytes() const {
        return blocks.size() * (sizeof(Block) + sizeof(int)) + contact_count() * (2 * sizeof(Vec) + sizeof(double));
    }
};

}}  // namespace nscdd::NSCDD_ABI
