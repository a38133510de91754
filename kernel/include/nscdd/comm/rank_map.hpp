#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "nscdd/comm/communicator.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Ranks dealt to processes in contiguous ranges, and one message from a process to another for all links between their
/// ranks.
class RankMap {
  public:
    /// `process`: number of this process, `processes`: how many there are. `size`: ranks in all; 0: one a process.
    /// Throws std::invalid_argument for fewer ranks than processes.
    RankMap(int process, int processes, int size)
        : process_(process), processes_(processes), size_(size == 0 ? processes : size) {
        if (size_ < processes_)
            throw std::invalid_argument(std::to_string(size_) + " ranks for " + std::to_string(processes_) +
                                        " processes, needs at least one for each");
        for (int rank = first(process_); rank < first(process_ + 1); ++rank) ranks_.push_back(rank);
    }

    int process() const { return process_; }                  ///< number of this process, from 0
    int processes() const { return processes_; }              ///< number of processes
    int size() const { return size_; }                        ///< number of ranks in all
    const std::vector<int>& ranks() const { return ranks_; }  ///< of this process, ascending, at least one
    std::size_t count() const { return ranks_.size(); }       ///< ranks of this process
    /// The most ranks that a process has.
    std::size_t most() const { return static_cast<std::size_t>((size_ + processes_ - 1) / processes_); }

    /// First rank of process p.
    int first(int p) const { return static_cast<int>(static_cast<long long>(p) * size_ / processes_); }
    /// The process that hosts this rank.
    int process_of(int rank) const { return static_cast<int>(((rank + 1LL) * processes_ - 1) / size_); }
    bool hosts(int rank) const { return process_of(rank) == process_; }  ///< whether this process does
    /// Place of a hosted rank in ranks().
    std::size_t index(int rank) const { return static_cast<std::size_t>(rank - ranks_[0]); }

  private:
    int process_, processes_, size_;
    std::vector<int> ranks_;
};

/// The places of a channel's messages in memory. A message between two processes has the doubles of all links between
/// their ranks, by source and target, so that both put them in the same order; and room for one more at its end.
class MessageLayout {
  public:
    struct Message {
        int process;
        std::span<double> doubles;
    };
    std::vector<Message> incoming, outgoing;  ///< by process

    /// links[k] of the k-th hosted rank. Sets what Channel::send(k, l) and recv(k, l) are.
    MessageLayout(const RankMap& hosted, const std::vector<Communicator::Links>& links,
                  std::vector<std::vector<std::span<double>>>& send,
                  std::vector<std::vector<std::span<double>>>& recv) {
        std::vector<End> sent, received;
        std::size_t all = 0;
        send.resize(links.size());
        recv.resize(links.size());
        for (std::size_t k = 0; k < links.size(); ++k) {
            send[k].resize(links[k].size());
            recv[k].resize(links[k].size());
            for (std::size_t l = 0; l < links[k].size(); ++l) {
                const Communicator::Link& link = links[k][l];
                const int process = hosted.process_of(link.peer), own = hosted.ranks()[k];
                sent.push_back({process, own, link.peer, &send[k][l], link.send});
                received.push_back({process, link.peer, own, &recv[k][l], link.recv});
                all += link.send + link.recv + 2;
            }
        }
        memory_.resize(all);
        lay(sent, outgoing, lay(received, incoming, memory_.data()));
    }
    MessageLayout(const MessageLayout&) = delete;
    MessageLayout& operator=(const MessageLayout&) = delete;

  private:
    /// Of one link.
    struct End {
        int process, source, target;
        std::span<double>* place;
        std::size_t doubles;
    };

    static double* lay(std::vector<End>& ends, std::vector<Message>& messages, double* at) {
        std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
            return std::tie(a.process, a.source, a.target) < std::tie(b.process, b.source, b.target);
        });
        for (std::size_t e = 0; e < ends.size();) {
            double* const begin = at;
            const int process = ends[e].process;
            for (; e < ends.size() && ends[e].process == process; ++e) {
                *ends[e].place = {at, ends[e].doubles};
                at += ends[e].doubles;
            }
            ++at;
            messages.push_back({process, {begin, at}});
        }
        return at;
    }

    Buffer memory_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
