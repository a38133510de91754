// All ranks in one process: the same supersteps and the same numbers as over MPI, on any number of threads, without
// MPI.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/comm/team.hpp"

namespace nscdd::inline NSCDD_ABI {

// Meanings and shapes of the calls: communicator.hpp. Each throws std::logic_error, naming call and ranks, if a
// sender and its receiver disagree on a size, or a link has no counterpart.
class InProcess final : public Communicator {
  public:
    // Hosts the ranks 0..size-1; each_rank() deals them to so many threads. Throws std::invalid_argument unless
    // 1 <= threads <= size.
    explicit InProcess(int size, int threads = 1) : team_(std::clamp(threads, 1, std::max(size, 1))) {
        if (size < 1) throw std::invalid_argument("InProcess: " + std::to_string(size) + " ranks, needs at least 1");
        if (threads < 1 || threads > size)
            throw std::invalid_argument("InProcess: " + std::to_string(threads) + " threads for " +
                                        std::to_string(size) + " ranks, needs 1 to as many as ranks");
        ranks_.resize(static_cast<std::size_t>(size));
        std::iota(ranks_.begin(), ranks_.end(), 0);
        work_.resize(ranks_.size());
    }

    int size() const override { return static_cast<int>(ranks_.size()); }
    std::span<const int> ranks() const override { return ranks_; }
    void each_rank(const std::function<void(std::size_t)>& task) override { team_.each(ranks_.size(), task); }

    void exchange(std::vector<Links>& links) override {
        check_count(links.size(), "exchange");
        for (int rank : ranks_)
            for (Link& link : links[rank]) {
                copy(counterpart(links, link.peer, rank).send, link.recv, "exchange", link.peer, rank);
                if (link.peer != rank) count(link.send.size());
            }
    }

    std::vector<Buffer> route(const std::vector<std::vector<Buffer>>& out) override {
        check_count(out.size(), "route");
        std::vector<Buffer> in(ranks_.size());
        for (int source : ranks_) {
            check_count(out[source].size(), "route");
            for (int target : ranks_) {
                const Buffer& message = out[source][target];
                in[target].insert(in[target].end(), message.begin(), message.end());
                if (target != source && !message.empty()) count(message.size());
            }
        }
        return in;
    }

    void gather(const std::vector<Buffer>& mine, std::vector<Buffer>& all) override {
        check_count(mine.size(), "gather");
        check_count(all.size(), "gather");
        for (int rank : ranks_) {
            copy(mine[rank], all[rank], "gather", rank, 0);
            if (rank != 0) count(mine[rank].size());
        }
    }

    void scatter(const std::vector<Buffer>& all, std::vector<Buffer>& mine) override {
        check_count(all.size(), "scatter");
        check_count(mine.size(), "scatter");
        for (int rank : ranks_) {
            copy(all[rank], mine[rank], "scatter", 0, rank);
            if (rank != 0) count(all[rank].size());
        }
    }

    std::span<const double> all_gather(const std::vector<Buffer>& mine) override {
        check_count(mine.size(), "all_gather");
        const std::size_t n = mine[0].size();
        gathered_.clear();
        for (int rank : ranks_) {
            if (mine[rank].size() != n) throw mismatch("all_gather", rank, mine[rank].size(), 0, n);
            gathered_.insert(gathered_.end(), mine[rank].begin(), mine[rank].end());
        }
        for (std::size_t k = 1; k < ranks_.size(); ++k) {
            count(n);                  // up to rank 0
            count(ranks_.size() * n);  // and down again
        }
        return gathered_;
    }

    double now() const override {
        return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    }
    // Throws std::out_of_range for a rank that is not hosted.
    void charge(int rank, double cost) override { work_.at(static_cast<std::size_t>(rank)) += cost; }
    std::span<const double> work() const override { return work_; }
    Traffic traffic() const override { return traffic_; }
    CommSeconds seconds() const override { return {}; }

  private:
    static std::logic_error mismatch(const char* call, int source, std::size_t sent, int target, std::size_t expected) {
        return std::logic_error(std::string(call) + ": rank " + std::to_string(source) + " sends " +
                                std::to_string(sent) + " doubles, rank " + std::to_string(target) + " expects " +
                                std::to_string(expected));
    }

    static void copy(const Buffer& from, Buffer& to, const char* call, int source, int target) {
        if (from.size() != to.size()) throw mismatch(call, source, from.size(), target, to.size());
        std::ranges::copy(from, to.begin());
    }

    void check_count(std::size_t buffers, const char* call) const {
        if (buffers != ranks_.size())
            throw std::logic_error(std::string(call) + ": " + std::to_string(buffers) + " buffers for " +
                                   std::to_string(ranks_.size()) + " ranks");
    }

    // The end at `peer` of the link that `rank` has with it.
    const Link& counterpart(const std::vector<Links>& links, int peer, int rank) const {
        if (peer >= 0 && peer < size()) {
            const auto found = std::ranges::lower_bound(links[peer], rank, {}, &Link::peer);
            if (found != links[peer].end() && found->peer == rank) return *found;
        }
        throw std::logic_error("exchange: rank " + std::to_string(rank) + " has a link to rank " +
                               std::to_string(peer) + ", which has none back");
    }

    void count(std::size_t doubles) {
        traffic_.messages += 1;
        traffic_.bytes += static_cast<double>(doubles * sizeof(double));
    }

    Team team_;
    std::vector<int> ranks_;
    std::vector<double> work_;
    Buffer gathered_;
    Traffic traffic_;
};

}  // namespace nscdd
