/// @file
/// The communicator over MPI. Each process hosts one rank or several. No other header includes mpi.h but mpi_*.hpp, its
/// parts, and none includes this one.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/comm/mpi_messages.hpp"
#include "nscdd/comm/mpi_process.hpp"
#include "nscdd/comm/mpi_reduction.hpp"
#include "nscdd/comm/thread_pool.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A communicator over MPI. Meanings and shapes of the calls are in communicator.hpp. All are collective.
///
/// Calls throw std::runtime_error when MPI fails; a message longer than expected is such a failure. They throw
/// std::logic_error when a shape is wrong or a message shorter than expected. The other processes may then wait for
/// this one, so the caller can only abort. Channels must be gone before their communicator.
///
/// Wait and transfer are told apart as in late-sender analysis (Scalasca). Every message carries the time at which its
/// sender entered the call. Wait lies between our entry and that of the latest partner; the rest is transfer.
///
/// Processes get ranks in contiguous ranges. All that the ranks of one process send to those of another is one message.
class Mpi : public Communicator {
  public:
    /// Works on a duplicate of `comm`. The caller initialises MPI before and finalises it after. Collective.
    ///
    /// `charged`, if given, is called at every charge of the meter, and for the messages of channels and reductions.
    /// `size` is the number of ranks in all, the same on every process; 0 means one a process. `within` says how
    /// messages go between processes of a node. Throws std::invalid_argument for fewer ranks than processes.
    ///
    /// each_rank() deals the ranks of this process to so many `threads`, or fewer where there are fewer ranks. The
    /// caller's thread alone calls MPI, so MPI_THREAD_FUNNELED is enough. Throws std::invalid_argument for fewer
    /// threads than 1, and for several with `charged`.
    explicit Mpi(MPI_Comm comm = MPI_COMM_WORLD, Meter::Charged charged = {}, int size = 0,
                 WithinNode within = WithinNode::memory, int threads = 1)
        : mpi_(comm, checked(std::move(charged), threads), size, within),
          pool_((std::min)(threads, static_cast<int>(mpi_.hosted().count()))) {}

    int size() const override { return mpi_.hosted().size(); }
    std::span<const int> ranks() const override { return mpi_.hosted().ranks(); }
    void each_rank(const std::function<void(std::size_t)>& task) override {
        const Turn::Hold hold(turn(), "each_rank", true);
        pool_.each(ranks().size(), task);
    }

    /// Throws std::logic_error for a peer that is no rank, and for a message through memory of another length than
    /// expected. For other messages finish() throws std::logic_error when one is shorter, std::runtime_error when one
    /// is longer.
    std::unique_ptr<Channel> open(const std::vector<Links>& links) override {
        const Turn::Hold hold(turn(), "open");
        check_count(links.size(), "open");
        for (std::size_t k = 0; k < links.size(); ++k)
            for (const Link& link : links[k]) check_peer("open", k, link.peer);
        return std::make_unique<detail::MpiMessages>(mpi_, links);
    }

    /// Each message goes alone to its target. The target learns of it by probing and answers with an empty one. A rank
    /// that has all its answers enters a barrier. When the barrier is over, no message is under way; NBX does so by
    /// synchronous sends (Hoefler, Siebert, Lumsdaine, PPoPP 2010). The barrier is a reduction of nothing, because
    /// SimGrid 3.32 lets ranks through MPI_Ibarrier as soon as rank 0 has come to it.
    std::vector<Buffer> route(const std::vector<Outbox>& out) override {
        const Turn::Hold hold(turn(), "route");
        const double entry = now();
        check_count(out.size(), "route");
        std::map<int, Buffer> staged, arrived;  // by process: target, source, length, message, of each; then a stamp
        for (std::size_t k = 0; k < out.size(); ++k)
            for (const auto& [target, message] : out[k]) {
                check_peer("route", k, target);
                if (message.empty()) continue;
                Buffer& to = (mpi_.hosted().hosts(target) ? arrived : staged)[mpi_.hosted().process_of(target)];
                to.insert(to.end(), {double(target), double(mpi_.hosted().ranks()[k]), double(message.size())});
                to.insert(to.end(), message.begin(), message.end());
                if (target != mpi_.hosted().ranks()[k]) mpi_.count(Operation::route, 1, message.size());
            }
        requests_.clear();
        routes_ = 1 - routes_;
        const int tag = detail::MpiProcess::route_tag + routes_;  // messages of the next route do not meet this one's
        const auto send = [&](int process, const Buffer& message) {
            check_call(MPI_Isend(message.data(), detail::mpi_count(message.size()), MPI_DOUBLE, process, tag,
                                 mpi_.comm(), &requests_.emplace_back()),
                       "route");
        };
        for (auto& [process, message] : staged) {
            message.push_back(entry);
            send(process, message);
        }
        const Buffer answer;
        double latest = entry;
        std::size_t unanswered = staged.size();
        for (bool inside = false, over = false; !over;) {
            if (unanswered == 0 && !inside) {
                inside = true;
                barrier_.start(std::vector<Buffer>(mpi_.hosted().count()), 0, entry);
            }
            int there = 0, n = 0;
            MPI_Status status;
            check_call(MPI_Iprobe(MPI_ANY_SOURCE, tag, mpi_.comm(), &there, &status), "route");
            if (!there) {
                if (!inside) continue;
                barrier_.go_on(false);
                over = !barrier_.under_way();
                continue;
            }
            check_call(MPI_Get_count(&status, MPI_DOUBLE, &n), "route");
            Buffer message(static_cast<std::size_t>(n));
            check_call(MPI_Recv(message.data(), n, MPI_DOUBLE, status.MPI_SOURCE, tag, mpi_.comm(), MPI_STATUS_IGNORE),
                       "route");
            if (message.empty()) {
                --unanswered;
                continue;
            }
            latest = (std::max)(latest, message.back());
            message.pop_back();
            arrived[status.MPI_SOURCE] = std::move(message);
            send(status.MPI_SOURCE, answer);
        }
        check_call(MPI_Waitall(detail::mpi_count(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE), "route");
        std::vector<Buffer> in(mpi_.hosted().count());
        for (const auto& [process, messages] : arrived)
            for (auto at = messages.begin(); at != messages.end();) {
                Buffer& to = in[mpi_.hosted().index(static_cast<int>(at[0]))];
                const auto begin = at + 3, end = begin + static_cast<std::ptrdiff_t>(at[2]);
                to.insert(to.end(), begin, end);
                at = end;
            }
        mpi_.spent(Operation::route, entry, latest);
        return in;
    }

    /// Every process sends as many doubles, also one with fewer ranks than others.
    std::span<const double> all_gather(const std::vector<Buffer>& mine) override {
        const Turn::Hold hold(turn(), "all_gather");
        const double entry = now();
        check_count(mine.size(), "all_gather");
        const std::size_t n = mine[0].size(), most = mpi_.hosted().most() * n + 1,
                          size = static_cast<std::size_t>(mpi_.hosted().size());
        send_.assign(most, entry);  // the last is the stamp
        recv_.resize(static_cast<std::size_t>(mpi_.hosted().processes()) * most);
        for (std::size_t k = 0; k < mine.size(); ++k) std::copy(mine[k].begin(), mine[k].end(), send_.data() + k * n);
        check_call(MPI_Allgather(send_.data(), detail::mpi_count(most), MPI_DOUBLE, recv_.data(),
                                 detail::mpi_count(most), MPI_DOUBLE, mpi_.comm()),
                   "all_gather");
        double latest = entry;
        gathered_.clear();
        for (int p = 0; p < mpi_.hosted().processes(); ++p) {
            const double* const from = recv_.data() + static_cast<std::size_t>(p) * most;
            const auto rows = static_cast<std::size_t>(mpi_.hosted().first(p + 1) - mpi_.hosted().first(p));
            gathered_.insert(gathered_.end(), from, from + rows * n);
            latest = (std::max)(latest, from[most - 1]);
        }
        for (const int rank : mpi_.hosted().ranks())
            if (rank != 0)
                mpi_.count(Operation::all_gather, 1,
                           n);  // up to rank 0; MPI may do otherwise, the count is that of the contract
            else
                mpi_.count(Operation::all_gather, size - 1, (size - 1) * size * n);  // and down again
        mpi_.spent(Operation::all_gather, entry, latest);
        return gathered_;
    }

    /// MPI_Allreduce may add in any order, so the kernel sends messages of its own.
    void start_reduce(const std::vector<Buffer>& mine, std::size_t added) override {
        const Turn::Hold hold(turn(), "reduce");
        const double entry = now();
        check_count(mine.size(), "reduce");
        reduction_.start(mine, added, entry);
        mpi_.spent(Operation::reduction, entry, entry);
    }
    std::span<const double> finish_reduce() override {
        const Turn::Hold hold(turn(), "reduce");
        const double entry = now();
        reduction_.go_on(true);
        mpi_.spent(Operation::reduction, entry, reduction_.rows().stamp());
        return reduction_.rows().row(0);
    }
    /// A look into a mailbox takes less time than a look at the clock, and is not counted.
    void advance() override {
        if (!reduction_.awaits_mpi()) return reduction_.go_on(false);
        const double entry = now();
        reduction_.go_on(false);
        mpi_.spent(Operation::reduction, entry, entry);
    }

    double now() const override { return mpi_.now(); }
    Meter& meter() override { return mpi_.meter(); }
    Traffic traffic() const override { return mpi_.traffic(); }
    Seconds seconds() const override { return mpi_.seconds(); }

  private:
    static Meter::Charged checked(Meter::Charged charged, int threads) {
        if (threads < 1 || (threads > 1 && charged))
            throw std::invalid_argument(
                "Mpi: " + std::to_string(threads) +
                (threads < 1 ? " threads, needs at least 1" : " threads, `charged` is for one"));
        return charged;
    }
    static void check_call(int code, const char* call) { detail::check_mpi(code, call); }

    void check_count(std::size_t buffers, const char* call) const {
        if (buffers != mpi_.hosted().count())
            throw std::logic_error(std::string(call) + ": " + std::to_string(buffers) + " buffers for " +
                                   std::to_string(mpi_.hosted().count()) + " ranks");
    }

    void check_peer(const char* call, std::size_t k, int peer) const {
        if (peer < 0 || peer >= size())
            throw std::logic_error(std::string(call) + ": rank " + std::to_string(mpi_.hosted().ranks()[k]) +
                                   " has a message for rank " + std::to_string(peer) + " of " + std::to_string(size()));
    }

    detail::MpiProcess mpi_;
    detail::ThreadPool pool_;

    /// Staging memory, which only grows.
    Buffer send_, recv_, gathered_;
    detail::MpiReduction reduction_{mpi_, detail::MpiProcess::reduce_tag, true},
        barrier_{mpi_, detail::MpiProcess::barrier_tag, false};
    std::vector<MPI_Request> requests_;
    int routes_ = 0;
};

}}  // namespace nscdd::NSCDD_ABI
