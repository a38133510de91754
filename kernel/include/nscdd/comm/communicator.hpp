/// @file
/// The contract of a communicator: all that Alg. 1 asks of a machine, in supersteps.
///
/// A process hosts one or more ranks. Code written against the contract loops over the ranks that it hosts, fills their
/// buffers, and makes one collective call for all of them:
/// ```
/// const auto channel = comm.open(links);                              // once for many messages of one size
/// comm.each_rank([&](std::size_t k) { fill(channel->send(k, 0)); });
/// channel->start();
/// comm.each_rank(work);                                               // while messages are under way
/// channel->finish();
/// ```
/// Every message is a row of doubles (indices below 2^53 travel exactly). Received messages are stored by source rank.
/// Sums are taken in an order of the ranks, never by order of arrival, so results are the same on every machine.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "nscdd/comm/meter.hpp"
#include "nscdd/comm/turn.hpp"
#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

using Buffer = std::vector<double>;  ///< a message, or the numbers of one rank

namespace detail {

/// Names of Communicator::Operation, in their order, as files have them.
constexpr std::array<const char*, 6> operation_names{"exchange", "route",     "gather",
                                                     "scatter",  "reduction", "all_gather"};
/// A number for each operation, in their order.
using ByOperation = std::array<double, operation_names.size()>;

}  // namespace detail

/// The ranks of a run, and their messages. Calls are coarse, one per superstep, so a virtual call costs nothing and a
/// solver is compiled once for all machines. Each implementation says what its calls throw.
class Communicator {
  public:
    /// Sizes of the messages between a rank and another, in doubles.
    struct Link {
        int peer;              ///< the other rank; a link of a rank with itself is allowed
        std::size_t send = 0;  ///< doubles to the peer
        std::size_t recv = 0;  ///< doubles from it
    };
    using Links = std::vector<Link>;  ///< links of one rank, by ascending peer, at most one per peer

    /// The operation that a message is part of. Exchanges of a channel and routes go from rank to rank. All others are
    /// collective: gathers to one rank and scatters from it (channels as well), reductions, all-gathers.
    enum class Operation { exchange, route, gather, scatter, reduction, all_gather };

    /// Messages that are sent again and again, with their places in memory. Nothing is allocated in the iteration.
    /// Communicator::open() makes one.
    class Channel {
      public:
        virtual ~Channel() = default;

        /// The message that link l of the k-th hosted rank sends. It may be written until start() and after finish().
        std::span<double> send(std::size_t k, std::size_t l) { return send_[k][l]; }
        /// The message that link l receives. It may be read from finish() until the next start().
        std::span<const double> recv(std::size_t k, std::size_t l) const { return recv_[k][l]; }
        /// Sets the operation that messages and their time are counted as: an exchange, unless told. It is the same on
        /// all ranks.
        void count_as(Operation operation) { operation_ = operation; }

        /// Sends the messages. Collective among ranks with a link to each other; start() and finish() are called in
        /// turn.
        virtual void start() = 0;
        virtual void finish() = 0;  ///< waits until all messages are here and send() may be written again

      protected:
        std::vector<std::vector<std::span<double>>> send_;  ///< by hosted rank, then link; set by the implementation
        std::vector<std::vector<std::span<double>>> recv_;  ///< by hosted rank, then link
        Operation operation_ = Operation::exchange;         ///< operation that it is part of
    };

    using Outbox = std::map<int, Buffer>;  ///< messages of one rank, by the rank that they go to

    /// Messages and bytes, counted the same way by every communicator and summed over the ranks of this process.
    /// Messages of a rank to itself are not counted, nor are empty ones of route(). An all-gather counts 2(size-1): up
    /// to rank 0 and down again. A reduction counts those of its rounds (reduction_rounds.hpp). Bytes are those of the
    /// doubles passed in, without any header.
    struct Traffic {
        double messages = 0;                ///< sent since the communicator was made
        double bytes = 0;                   ///< sent in these messages
        detail::ByOperation messages_of{};  ///< messages of each operation

        /// Counts a number of messages, with so many doubles in all.
        void add(Operation operation, std::size_t number, std::size_t doubles) {
            messages += static_cast<double>(number);
            bytes += static_cast<double>(doubles * sizeof(double));
            messages_of[static_cast<std::size_t>(operation)] += static_cast<double>(number);
        }
    };

    /// Time of this process inside the communicator [s]. `wait` lasts until the slowest partner has arrived, `transfer`
    /// is the rest. In-process ranks spend none.
    struct Seconds {
        double wait = 0;                    ///< for partners that enter their call later [s]
        double transfer = 0;                ///< in calls, without waiting [s]
        detail::ByOperation wait_of{};      ///< `wait` in the calls of each operation [s]
        detail::ByOperation transfer_of{};  ///< `transfer` in the calls of each operation [s]

        /// Counts a call that waited and transferred for so long [s].
        void add(Operation operation, double waited, double transferred) {
            wait += waited;
            transfer += transferred;
            wait_of[static_cast<std::size_t>(operation)] += waited;
            transfer_of[static_cast<std::size_t>(operation)] += transferred;
        }
    };

    virtual ~Communicator() = default;

    virtual int size() const = 0;                    ///< number of ranks, on all processes together
    virtual std::span<const int> ranks() const = 0;  ///< ranks that this process hosts, ascending

    /// The turn to call this communicator. A Turn::Hold on it keeps calls together that belong together: other threads
    /// are refused until the last of them. Collective calls of InProcess and Mpi take the turn themselves, each for its
    /// own time, and throw as Turn::Hold does.
    Turn& turn() { return turn_; }

    /// Runs task(k) once for each hosted rank ranks()[k], perhaps several at a time. A task must not touch data of
    /// another. Of the communicator it may call size(), ranks(), now() and meter() alone.
    virtual void each_rank(const std::function<void(std::size_t)>& task) {
        const Turn::Hold hold(turn_, "each_rank", true);
        for (std::size_t k = 0; k < ranks().size(); ++k) task(k);
    }

    /// Opens a channel with links[k] of ranks()[k]. The peer of each link has one back, of the same sizes.
    virtual std::unique_ptr<Channel> open(const std::vector<Links>& links) = 0;
    /// Sends out[k] of ranks()[k], of any sizes. Returns in[k], all messages that came, by ascending source. The cost
    /// is a message to each rank that something is sent to, and a barrier.
    virtual std::vector<Buffer> route(const std::vector<Outbox>& out) = 0;
    /// Sends mine[k], all of one length n, to everyone. Returns size()*n doubles by rank, valid until the next call.
    /// The result grows with the number of ranks, so it is for rare use.
    virtual std::span<const double> all_gather(const std::vector<Buffer>& mine) = 0;
    /// Combines mine[k], all of one length, over all ranks. Returns the sums of the first `added` entries and the
    /// largest of the others, NaN if there is one. They are valid until the next reduction. The order is that of the
    /// tree (combine_in_tree).
    ///
    /// All ranks of a process but the first may have an empty one, which changes nothing. So many ranks need no memory.
    std::span<const double> reduce(const std::vector<Buffer>& mine, std::size_t added) {
        start_reduce(mine, added);
        return finish_reduce();
    }
    /// Starts a reduce() that finish_reduce() ends, with other work in between, but no other reduction. advance() may
    /// be called between pieces of that work.
    virtual void start_reduce(const std::vector<Buffer>& mine, std::size_t added) = 0;
    virtual std::span<const double> finish_reduce() = 0;  ///< waits for the end, returns the numbers of reduce()
    /// Moves a reduction that is under way as far as it can go without waiting. Not collective.
    virtual void advance() = 0;

    virtual double now() const = 0;       ///< clock of this machine, real or simulated [s]
    virtual Meter& meter() = 0;           ///< meter of the work of the hosted ranks
    virtual Traffic traffic() const = 0;  ///< messages so far, of the ranks that this process hosts
    virtual Seconds seconds() const = 0;  ///< time in calls so far, of this process

    /// The tree of reduce(). p is the largest power of two that is not above the number of ranks. First, each rank r >=
    /// p adds its numbers to those of r - p. Then neighbours add theirs to each other's, pairs of neighbours follow,
    /// and so on. Both of a pair get the same bits, since a + b is b + a. Returns p.
    static int tree_size(int ranks) {
        int p = 1;
        while (2 * p <= ranks) p *= 2;
        return p;
    }
    /// Does one step of the tree of reduce(). The first `added` entries of `mine` become sums, the others the larger of
    /// both, NaN if one is.
    static void combine_in_tree(std::span<double> mine, std::span<const double> other, std::size_t added) {
        for (std::size_t n = 0; n < added; ++n) mine[n] += other[n];
        for (std::size_t n = added; n < mine.size(); ++n) {
            if (!(mine[n] >= other[n]) && mine[n] == mine[n]) mine[n] = other[n];
            mine[n] += 0.0;  // of zeros of both signs the positive one
        }
    }
    /// Does the same where either may be empty, as if it had zeros to add and nothing that is larger, to the last bit.
    static void combine_in_tree(Buffer& mine, const Buffer& other, std::size_t added) {
        if (!mine.empty() && !other.empty()) return combine_in_tree(std::span(mine), std::span(other), added);
        if (mine.empty()) mine = other;
        for (double& number : mine) number += 0.0;
    }

  private:
    Turn turn_;
};

/// Reduces the numbers that task(k) returns for each hosted rank. Tasks run at the same time, as those of each_rank().
inline std::span<const double> reduce(Communicator& comm, std::size_t added, auto&& task) {
    std::vector<Buffer> mine(comm.ranks().size());
    comm.each_rank([&](std::size_t k) { mine[k] = task(k); });
    return comm.reduce(mine, added);
}

}}  // namespace nscdd::NSCDD_ABI
