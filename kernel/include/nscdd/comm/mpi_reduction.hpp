/// @file
/// A reduction over MPI. Includes mpi.h, as mpi.hpp does.
#pragma once

#include <mpi.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "nscdd/comm/mpi_node.hpp"
#include "nscdd/comm/mpi_process.hpp"
#include "nscdd/comm/reduction_rounds.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

// SimGrid's SMPI 3.32 keeps every message that MPI_Test has completed, and searches them all whenever another one ends.
// There a message is seen to have come by its last number, a time, and is completed by MPI_Wait.
#ifdef SMPI_H
inline constexpr bool seen_by_stamp = true;
#else
inline constexpr bool seen_by_stamp = false;
#endif

/// A reduction in rounds of messages (ReductionRounds). In the iteration: traffic() counts its messages, and they go
/// through memory where they can.
class MpiReduction {
  public:
    MpiReduction(MpiProcess& mpi, int own_tag, bool in_iteration)
        : mpi_(mpi), rows_(mpi.hosted()), own_tag_(own_tag), in_iteration_(in_iteration) {
        for (int step = 1; in_iteration && rows_.rounds().has(step); step *= detail::ReductionRounds::group) {
            std::vector<NodeMemory::Message> outgoing, incoming;
            rows_.visit_partners(
                step,
                [&incoming](int process, std::size_t rows) {
                    incoming.push_back({process, rows * longest});
                },
                [&outgoing](int process, std::size_t rows) {
                    outgoing.push_back({process, rows * longest});
                });
            mailboxes_.push_back(mpi.node().open(outgoing, incoming));
        }
    }

    bool under_way() const { return rows_.under_way(); }
    bool awaits_mpi() const { return received_ < awaited_.size() && !awaited_[received_].mailbox; }
    const detail::ReducedRows& rows() const { return rows_; }

    void start(const std::vector<Buffer>& mine, std::size_t added, double stamp) {
        rows_.start(mine, added, stamp);
        round_ = 0;
        start_round();
    }
    /// Continues the reduction: to its end if `wait`, else as far as possible without waiting. One message is asked
    /// for at a time, so that a call costs little: the first one that is not there ends it.
    void go_on(bool wait) {
        for (; under_way(); finish_round())
            for (; received_ < awaited_.size(); ++received_)
                if (!receive(awaited_[received_], wait)) return;
    }

  private:
    static constexpr std::size_t longest = 64;  ///< doubles of a row that goes through memory

    struct Awaited {
        MPI_Request request = MPI_REQUEST_NULL;
        detail::Mailbox* mailbox = nullptr;
        Buffer* rows = nullptr;
    };

    /// False if the message is not there and must not be waited for.
    static bool receive(Awaited& awaited, bool wait) {
        if (awaited.mailbox) {
            if (!wait && !awaited.mailbox->there()) return false;
            awaited.mailbox->take(*awaited.rows);
            return true;
        }
        if (seen_by_stamp) wait = wait || !std::isnan(awaited.rows->back());
        int there = 1;
        check_mpi(wait ? MPI_Wait(&awaited.request, MPI_STATUS_IGNORE)
                       : MPI_Test(&awaited.request, &there, MPI_STATUS_IGNORE),
                  "reduce");
        return there != 0;
    }

    void start_round() {
        awaited_.clear();
        sending_.clear();
        received_ = 0;
        if (!under_way()) return;
        std::size_t from = 0, to = 0;  // in the mailboxes of the round
        rows_.trade(
            [&](int process, Buffer& rows) {
                Awaited& awaited = awaited_.emplace_back();
                awaited.rows = &rows;
                if (in_iteration_) awaited.mailbox = mailbox(mailboxes_[round_].incoming, from++, rows);
                if (seen_by_stamp) rows.back() = std::numeric_limits<double>::quiet_NaN();
                if (!awaited.mailbox)
                    check_mpi(MPI_Irecv(rows.data(), mpi_count(rows.size()), MPI_DOUBLE, process, own_tag_, mpi_.comm(),
                                        &awaited.request),
                              "reduce");
            },
            [&](int process, Buffer& rows) {
                if (in_iteration_) mpi_.charge_call(rows.size(), shared(mailboxes_[round_].outgoing_shared, to));
                if (detail::Mailbox* const way =
                        in_iteration_ ? mailbox(mailboxes_[round_].outgoing, to++, rows) : nullptr)
                    way->put(rows);
                else
                    check_mpi(MPI_Isend(rows.data(), mpi_count(rows.size()), MPI_DOUBLE, process, own_tag_, mpi_.comm(),
                                        &sending_.emplace_back()),
                              "reduce");
            },
            [this](std::span<const double> row) {
                if (in_iteration_) mpi_.count(Communicator::Operation::reduction, 1, row.size());
            });
    }
    /// Rows are short, so that MPI sends them at once: nobody waits here for a receiver that computes.
    void finish_round() {
        check_mpi(MPI_Waitall(mpi_count(sending_.size()), sending_.data(), MPI_STATUSES_IGNORE), "reduce");
        for (std::size_t m = 0; in_iteration_ && m < awaited_.size(); ++m)
            mpi_.charge_call(awaited_[m].rows->size(), shared(mailboxes_[round_].incoming_shared, m));
        rows_.finish_round();
        ++round_;
        start_round();
    }

    /// The m-th mailbox if it is one and these rows fit, else null.
    static detail::Mailbox* mailbox(std::vector<detail::Mailbox>& mailboxes, std::size_t m, const Buffer& rows) {
        return mailboxes[m] && rows.size() <= mailboxes[m].doubles() ? &mailboxes[m] : nullptr;
    }
    /// Whether the m-th message goes through memory, or is to be charged as if it did.
    bool shared(const std::vector<char>& shared, std::size_t m) const {
        return shared[m] && rows_.row(0).size() < longest;
    }

    MpiProcess& mpi_;
    detail::ReducedRows rows_;
    std::vector<NodeMemory::Mailboxes> mailboxes_;  ///< by round
    std::vector<Awaited> awaited_;                  ///< of the round under way
    std::vector<MPI_Request> sending_;
    std::size_t received_ = 0, round_ = 0;
    int own_tag_;
    bool in_iteration_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
