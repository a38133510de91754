/// @file
/// The messages of a reduction: who sends its row to whom. Every rank gets the bits of combine_in_tree() in few rounds.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "nscdd/comm/rank_map.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Rounds of a reduction, each over two levels of the tree: four ranks send each other their rows, and each combines
/// all. A rank r >= p = tree_size(ranks) is the double of rank r - p. In the first round both send their rows.
/// Afterwards whoever sends to r - p sends to r as well. 48 ranks need 3 rounds; with one partner a round they would
/// need 7.
class ReductionRounds {
  public:
    static constexpr int group = 4;  ///< ranks that tell each other their rows in one round
    /// Places for rows of a group: those of its members first, then those of their doubles.
    static constexpr std::size_t slots = 2 * group;

    /// For so many ranks, at least 1.
    explicit ReductionRounds(int ranks) : ranks_(ranks), p_(Communicator::tree_size(ranks)) {}

    /// The step of a round is the distance of the ranks in a group: 1, group, group^2 ... True if a round has this
    /// step.
    bool has(int step) const { return step < p_; }
    /// visit(source, slot) for each rank that sends a row to this one in the round of this step, ascending, without
    /// itself; the row belongs in that slot.
    void visit_sources(int step, int rank, auto&& visit) const {
        visit_group(step, rank, [&](int other, std::size_t slot) {
            if (other != rank && (step == 1 || (other < p_ && other != origin(rank)))) visit(other, slot);
        });
    }
    /// visit(target) for each rank that this one sends its row to, ascending, without itself.
    void visit_targets(int step, int rank, auto&& visit) const {
        if (step > 1 && rank >= p_) return;
        visit_group(step, rank, [&](int other, std::size_t) {
            if (other != rank && (step == 1 || origin(other) != rank)) visit(other);
        });
    }
    /// The slot of the rank's own row.
    std::size_t slot(int step, int rank) const {
        return static_cast<std::size_t>(origin(rank) / step % group + (step == 1 && rank >= p_ ? group : 0));
    }
    /// The rows of a round, one in each slot that is used, become one, in the first slot; `added` as in reduce().
    void combine(int step, int rank, std::span<Buffer> rows, std::size_t added) const {
        if (step == 1)
            visit_group(step, rank, [&](int other, std::size_t slot) {
                if (other >= p_) Communicator::combine_in_tree(rows[slot - group], rows[slot], added);
            });
        const auto members = static_cast<std::size_t>((std::min)(group, p_ / step));
        for (std::size_t half = 1; half < members; half *= 2)
            for (std::size_t s = 0; s < members; s += 2 * half)
                Communicator::combine_in_tree(rows[s], rows[s + half], added);
    }

  private:
    int origin(int rank) const { return rank < p_ ? rank : rank - p_; }

    /// visit(rank, slot) of the members, then of their doubles.
    void visit_group(int step, int rank, auto&& visit) const {
        const int members = (std::min)(group, p_ / step), first = origin(rank) - origin(rank) / step % group * step;
        for (int s = 0; s < members; ++s) visit(first + s * step, static_cast<std::size_t>(s));
        for (int s = 0; s < members; ++s)
            if (first + s * step + p_ < ranks_) visit(first + s * step + p_, static_cast<std::size_t>(s + group));
    }

    int ranks_, p_;
};

/// The rows of one process's ranks during the rounds. Behind each row is a stamp; the largest stamp of all ranks
/// arrives. The caller carries the messages: it receives and sends what trade() says, then calls finish_round().
class ReducedRows {
  public:
    /// `hosted` must live as long as this.
    explicit ReducedRows(const RankMap& hosted)
        : hosted_(hosted), rounds_(hosted.size()), rows_(hosted.count()), groups_(hosted.count()) {}

    /// Begins with mine[k] of the k-th hosted rank, empty where reduce() allows it, and one stamp for all of them, such
    /// as a time [s]; `added` as in reduce(). Throws std::logic_error when the hosted ranks' rows are not of one
    /// length, or shorter than `added`, or others are under way.
    void start(const std::vector<Buffer>& mine, std::size_t added, double stamp) {
        if (under_way()) throw std::logic_error("reduce: another reduction is under way");
        const std::size_t n = mine[0].size();
        if (added > n) throw std::logic_error("reduce: adds more numbers than there are");
        for (std::size_t k = 0; k < mine.size(); ++k) {
            if (!mine[k].empty() && mine[k].size() != n)
                throw std::logic_error("reduce: hosted ranks have rows of different lengths");
            rows_[k].assign(n + 1, -std::numeric_limits<double>::infinity());  // what an empty one stands for
            std::fill_n(rows_[k].begin(), added, 0.0);
            std::copy(mine[k].begin(), mine[k].end(), rows_[k].begin());
            rows_[k].back() = stamp;
            for (Buffer& row : groups_[k]) row.resize(n + 1);
        }
        added_ = added;
        step_ = 1;
    }
    bool under_way() const { return rounds_.has(step_); }      ///< whether a round is still to be done
    const ReductionRounds& rounds() const { return rounds_; }  ///< who sends to whom

    /// receives(process, rows) and sends(process, rows) for each other process, ascending, that rows come from or go to
    /// in the round of this step: how many.
    void visit_partners(int step, auto&& receives, auto&& sends) const {
        std::map<int, std::size_t> from, to;
        for (const int rank : hosted_.ranks()) {
            rounds_.visit_sources(step, rank, [&](int source, std::size_t) { ++from[hosted_.process_of(source)]; });
            rounds_.visit_targets(step, rank, [&](int target) { ++to[hosted_.process_of(target)]; });
        }
        for (const auto& [process, rows] : from)
            if (process != hosted_.process()) receives(process, rows);
        for (const auto& [process, rows] : to)
            if (process != hosted_.process()) sends(process, rows);
    }

    /// receive(process, rows) and send(process, rows) of the round, by process, at most one of each for another one:
    /// what its ranks and those of this process send each other, by source, then target. sent(row) for each row that is
    /// sent, also within this process.
    void trade(auto&& receive, auto&& send, auto&& sent) {
        awaited_.clear();
        for (auto* messages : {&incoming_, &outgoing_})
            for (auto& [process, rows] : *messages) rows.clear();
        for (std::size_t k = 0; k < rows_.size(); ++k)
            rounds_.visit_sources(step_, hosted_.ranks()[k], [&](int source, std::size_t slot) {
                if (hosted_.hosts(source))
                    groups_[k][slot] = rows_[hosted_.index(source)];
                else
                    awaited_.push_back({source, k, &groups_[k][slot]});
            });
        std::sort(awaited_.begin(), awaited_.end(), [](const Awaited& a, const Awaited& b) {
            return std::pair(a.source, a.k) < std::pair(b.source, b.k);
        });
        for (const Awaited& a : awaited_) {
            Buffer& rows = incoming_[hosted_.process_of(a.source)];
            rows.resize(rows.size() + a.row->size());
        }
        for (std::size_t k = 0; k < rows_.size(); ++k)
            rounds_.visit_targets(step_, hosted_.ranks()[k], [&](int target) {
                sent(row(k));
                if (hosted_.hosts(target)) return;
                Buffer& rows = outgoing_[hosted_.process_of(target)];
                rows.insert(rows.end(), rows_[k].begin(), rows_[k].end());
            });
        for (auto& [process, rows] : incoming_)
            if (!rows.empty()) receive(process, rows);
        for (auto& [process, rows] : outgoing_)
            if (!rows.empty()) send(process, rows);
    }
    /// Combines what has come in this round, and goes on to the next one.
    void finish_round() {
        for (std::size_t a = 0; a < awaited_.size();) {
            const int process = hosted_.process_of(awaited_[a].source);
            const double* from = incoming_[process].data();
            for (; a < awaited_.size() && hosted_.process_of(awaited_[a].source) == process; ++a) {
                Buffer& row = *awaited_[a].row;
                std::copy_n(from, row.size(), row.begin());
                from += row.size();
            }
        }
        for (std::size_t k = 0; k < rows_.size(); ++k) {
            const int rank = hosted_.ranks()[k];
            groups_[k][rounds_.slot(step_, rank)] = rows_[k];
            rounds_.combine(step_, rank, groups_[k], added_);
            rows_[k].swap(groups_[k][0]);
        }
        step_ *= ReductionRounds::group;
    }

    /// Of the k-th hosted rank, without its stamp: the result, when no round is under way.
    std::span<const double> row(std::size_t k) const { return std::span(rows_[k]).first(rows_[k].size() - 1); }
    double stamp() const { return rows_[0].back(); }  ///< the largest so far

  private:
    const RankMap& hosted_;
    ReductionRounds rounds_;
    std::vector<Buffer> rows_;                                        ///< of the hosted ranks
    std::vector<std::array<Buffer, ReductionRounds::slots>> groups_;  ///< rows of their groups
    /// A row from another process.
    struct Awaited {
        int source;
        std::size_t k;  ///< of the hosted rank that it is for
        Buffer* row;
    };
    std::vector<Awaited> awaited_;               ///< by source, then k
    std::map<int, Buffer> incoming_, outgoing_;  ///< of the round, by process; what is empty is not sent
    std::size_t added_ = 0;
    int step_ = 1 << 30;  ///< beyond the last round: none is under way
};

}}}  // namespace nscdd::NSCDD_ABI::detail
