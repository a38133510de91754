/// @file
/// All ranks in one process, on any number of threads, without MPI. Supersteps and numbers are the same as over MPI.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/comm/reduction_rounds.hpp"
#include "nscdd/comm/thread_pool.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A communicator whose ranks all live in this process. Meanings and shapes of the calls are in communicator.hpp. Each
/// throws std::logic_error, naming call and ranks, where a sender and its receiver disagree on a size, or a link has no
/// counterpart.
class InProcess final : public Communicator {
  public:
    /// Hosts the ranks 0..size-1, which each_rank() deals to so many threads. Throws std::invalid_argument unless 1 <=
    /// threads <= size.
    explicit InProcess(int size, int threads = 1) : pool_(std::clamp(threads, 1, (std::max)(size, 1))) {
        if (size < 1) throw std::invalid_argument("InProcess: " + std::to_string(size) + " ranks, needs at least 1");
        if (threads < 1 || threads > size)
            throw std::invalid_argument("InProcess: " + std::to_string(threads) + " threads for " +
                                        std::to_string(size) + " ranks, needs 1 to as many as ranks");
        ranks_.resize(static_cast<std::size_t>(size));
        std::iota(ranks_.begin(), ranks_.end(), 0);
        meter_ = Meter(ranks_.size());
    }

    int size() const override { return static_cast<int>(ranks_.size()); }
    std::span<const int> ranks() const override { return ranks_; }
    void each_rank(const std::function<void(std::size_t)>& task) override {
        const Turn::Hold hold(turn(), "each_rank", true);
        pool_.each(ranks_.size(), task);
    }

    std::unique_ptr<Channel> open(const std::vector<Links>& links) override {
        const Turn::Hold hold(turn(), "open");
        check_count(links.size(), "open");
        return std::make_unique<Messages>(*this, links);
    }

    std::vector<Buffer> route(const std::vector<Outbox>& out) override {
        const Turn::Hold hold(turn(), "route");
        check_count(out.size(), "route");
        std::vector<Buffer> in(ranks_.size());
        for (int source : ranks_)
            for (const auto& [target, message] : out[at(source)]) {
                if (target < 0 || target >= size()) throw no_rank("route", source, target);
                in[at(target)].insert(in[at(target)].end(), message.begin(), message.end());
                if (target != source && !message.empty()) traffic_.add(Operation::route, 1, message.size());
            }
        return in;
    }

    std::span<const double> all_gather(const std::vector<Buffer>& mine) override {
        const Turn::Hold hold(turn(), "all_gather");
        check_count(mine.size(), "all_gather");
        const std::size_t n = mine[0].size();
        gathered_.clear();
        for (int rank : ranks_) {
            if (mine[at(rank)].size() != n) throw mismatch("all_gather", rank, mine[at(rank)].size(), 0, n);
            gathered_.insert(gathered_.end(), mine[at(rank)].begin(), mine[at(rank)].end());
        }
        for (std::size_t k = 1; k < ranks_.size(); ++k) {
            traffic_.add(Operation::all_gather, 1, n);                  // up to rank 0
            traffic_.add(Operation::all_gather, 1, ranks_.size() * n);  // and down again
        }
        return gathered_;
    }

    void start_reduce(const std::vector<Buffer>& mine, std::size_t added) override {
        const Turn::Hold hold(turn(), "reduce");
        check_count(mine.size(), "reduce");
        const std::size_t n = mine[0].size();
        if (added > n) throw std::logic_error("reduce: adds more numbers than there are");
        for (int rank : ranks_)
            if (!mine[at(rank)].empty() && mine[at(rank)].size() != n)
                throw mismatch("reduce", rank, mine[at(rank)].size(), 0, n);
        tree_ = mine;
        const int p = tree_size(size());
        for (int rank = p; rank < size(); ++rank) combine_in_tree(tree_[at(rank - p)], tree_[at(rank)], added);
        for (int step = 1; step < p; step *= 2)
            for (int rank = 0; rank < p; rank += 2 * step)
                combine_in_tree(tree_[at(rank)], tree_[at(rank + step)], added);
        const detail::ReductionRounds rounds(size());  // counts the messages that this reduction takes over a network
        for (int step = 1; rounds.has(step); step *= detail::ReductionRounds::group)
            for (int rank : ranks_)
                rounds.visit_targets(step, rank, [&](int) { traffic_.add(Operation::reduction, 1, n); });
    }
    std::span<const double> finish_reduce() override { return tree_[0]; }
    void advance() override {}

    double now() const override {
        return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    }
    Meter& meter() override { return meter_; }
    Traffic traffic() const override { return traffic_; }
    Seconds seconds() const override { return {}; }

  private:
    /// A channel that copies at finish(). So a rank may fill the next message while another has not yet read this one.
    class Messages final : public Channel {
      public:
        Messages(InProcess& comm, const std::vector<Links>& links) : comm_(comm) {
            std::size_t all = 0;
            for (int rank : comm.ranks_)
                for (const Link& link : links[at(rank)]) {
                    const Link& back = counterpart(links, link.peer, rank);
                    if (back.send != link.recv) throw mismatch("open", link.peer, back.send, rank, link.recv);
                    all += link.send + link.recv;
                }
            memory_.resize(all);
            double* next = memory_.data();
            send_.resize(links.size()), recv_.resize(links.size());
            for (int rank : comm.ranks_)
                for (const Link& link : links[at(rank)]) {
                    send_[at(rank)].emplace_back(next, link.send);
                    recv_[at(rank)].emplace_back(next + link.send, link.recv);
                    next += link.send + link.recv;
                    if (link.peer != rank) messages_.push_back(link.send);
                }
            for (int rank : comm.ranks_)
                for (std::size_t l = 0; l < links[at(rank)].size(); ++l) {
                    const int peer = links[at(rank)][l].peer;
                    const auto back =
                        static_cast<std::size_t>(&counterpart(links, peer, rank) - links[at(peer)].data());
                    copies_.push_back({send_[at(peer)][back], recv_[at(rank)][l]});
                }
        }
        void start() override {
            for (const std::size_t doubles : messages_) comm_.traffic_.add(operation_, 1, doubles);
        }
        void finish() override {
            for (const Copy& copy : copies_) std::copy(copy.from.begin(), copy.from.end(), copy.to.begin());
        }

      private:
        struct Copy {
            std::span<const double> from;
            std::span<double> to;
        };
        InProcess& comm_;
        Buffer memory_;
        std::vector<std::size_t> messages_;
        std::vector<Copy> copies_;
    };

    static std::logic_error mismatch(const char* call, int source, std::size_t sent, int target, std::size_t expected) {
        return std::logic_error(std::string(call) + ": rank " + std::to_string(source) + " sends " +
                                std::to_string(sent) + " doubles, rank " + std::to_string(target) + " expects " +
                                std::to_string(expected));
    }

    static std::logic_error no_rank(const char* call, int source, int target) {
        return std::logic_error(std::string(call) + ": rank " + std::to_string(source) + " sends to rank " +
                                std::to_string(target) + ", which is none");
    }

    void check_count(std::size_t buffers, const char* call) const {
        if (buffers != ranks_.size())
            throw std::logic_error(std::string(call) + ": " + std::to_string(buffers) + " buffers for " +
                                   std::to_string(ranks_.size()) + " ranks");
    }

    static std::size_t at(int rank) { return static_cast<std::size_t>(rank); }  ///< place of a rank in lists

    /// The end at `peer` of the link that `rank` has with it.
    static const Link& counterpart(const std::vector<Links>& links, int peer, int rank) {
        if (peer >= 0 && static_cast<std::size_t>(peer) < links.size()) {
            const Links& back = links[at(peer)];
            const auto found = std::lower_bound(back.begin(), back.end(), rank,
                                                [](const Link& link, int other) { return link.peer < other; });
            if (found != back.end() && found->peer == rank) return *found;
        }
        throw std::logic_error("open: rank " + std::to_string(rank) + " has a link to rank " + std::to_string(peer) +
                               ", which has none back");
    }

    detail::ThreadPool pool_;
    std::vector<int> ranks_;
    Meter meter_;
    Buffer gathered_;
    std::vector<Buffer> tree_;
    Traffic traffic_;
};

}}  // namespace nscdd::NSCDD_ABI
