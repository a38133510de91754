// Over MPI, each process hosting one rank or several. The only header that includes mpi.h; nothing else includes this
// one.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nscdd/comm/reduction_rounds.hpp"

namespace nscdd::inline NSCDD_ABI {

// Meanings and shapes of the calls: communicator.hpp. All are collective.
//
// Throws std::runtime_error when MPI fails (a message longer than expected is such a failure) and std::logic_error
// when a shape is wrong or a message shorter than expected. The other processes may then wait for this one, so
// that the caller can only abort. Channels must be gone before their communicator.
//
// Wait and transfer are told apart as in late-sender analysis (Scalasca): every message carries the time at which
// its sender entered the call; what lies between our entry and that of the latest partner is wait, the rest is
// transfer.
//
// Ranks are dealt to processes in contiguous ranges. What the ranks of one process send to those of another is one
// message.
class Mpi final : public Communicator {
  public:
    // Works on a duplicate of `comm`. The caller initialises MPI before and finalises it after. Collective. `charged`,
    // if given, is called at every charge(), and for the messages of channels and reductions. `size`: ranks in all, the
    // same on every process; 0: one a process. Throws std::invalid_argument for fewer ranks than processes.
    explicit Mpi(MPI_Comm comm = MPI_COMM_WORLD, Charged charged = {}, int size = 0)
        : comm_(comm),
          hosted_(comm_.place(&MPI_Comm_rank), comm_.place(&MPI_Comm_size), size),
          charged_(std::move(charged)) {
        synchronise_clock();
    }

    int size() const override { return hosted_.size(); }
    std::span<const int> ranks() const override { return hosted_.ranks(); }

    // Throws std::logic_error for a peer that is no rank. finish() throws std::logic_error when a message is shorter
    // than expected, std::runtime_error when it is longer.
    std::unique_ptr<Channel> open(const std::vector<Links>& links) override {
        check_count(links.size(), "open");
        for (std::size_t k = 0; k < links.size(); ++k)
            for (const Link& link : links[k]) check_peer("open", k, link.peer);
        return std::make_unique<Messages>(*this, links);
    }

    // Each message goes alone to its target, which learns of it by probing and answers with an empty one. A rank that
    // has all its answers enters a barrier; when the barrier is over, no message is under way (as NBX, Hoefler,
    // Siebert, Lumsdaine, PPoPP 2010, does by synchronous sends). The barrier is a reduction of nothing: SimGrid 3.32
    // lets ranks through MPI_Ibarrier when rank 0 has come to it, whoever else has not.
    std::vector<Buffer> route(const std::vector<Outbox>& out) override {
        const double entry = now();
        check_count(out.size(), "route");
        std::map<int, Buffer> staged, arrived;  // by process: target, source, length, message, of each; then a stamp
        for (std::size_t k = 0; k < out.size(); ++k)
            for (const auto& [target, message] : out[k]) {
                check_peer("route", k, target);
                if (message.empty()) continue;
                Buffer& to = (hosted_.hosts(target) ? arrived : staged)[hosted_.process_of(target)];
                to.insert(to.end(), {double(target), double(hosted_.ranks()[k]), double(message.size())});
                to.insert(to.end(), message.begin(), message.end());
                if (target != hosted_.ranks()[k]) count(message.size());
            }
        requests_.clear();
        routes_ = 1 - routes_;  // messages of the next route do not meet this one's
        const auto send = [&](int process, const Buffer& message) {
            check(MPI_Isend(message.data(), narrow(message.size()), MPI_DOUBLE, process, route_tag + routes_,
                            comm_.handle, &requests_.emplace_back()),
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
                barrier_.start(std::vector<Buffer>(hosted_.count()), 0, entry);
            }
            int there = 0, n = 0;
            MPI_Status status;
            check(MPI_Iprobe(MPI_ANY_SOURCE, route_tag + routes_, comm_.handle, &there, &status), "route");
            if (!there) {
                if (!inside) continue;
                barrier_.go_on(false);
                over = !barrier_.under_way();
                continue;
            }
            check(MPI_Get_count(&status, MPI_DOUBLE, &n), "route");
            Buffer message(static_cast<std::size_t>(n));
            check(MPI_Recv(message.data(), n, MPI_DOUBLE, status.MPI_SOURCE, route_tag + routes_, comm_.handle,
                           MPI_STATUS_IGNORE),
                  "route");
            if (message.empty()) {
                --unanswered;
                continue;
            }
            latest = std::max(latest, message.back());
            message.pop_back();
            arrived[status.MPI_SOURCE] = std::move(message);
            send(status.MPI_SOURCE, answer);
        }
        check(MPI_Waitall(narrow(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE), "route");
        std::vector<Buffer> in(hosted_.count());
        for (const auto& [process, messages] : arrived)
            for (auto at = messages.begin(); at != messages.end();) {
                Buffer& to = in[hosted_.index(static_cast<int>(at[0]))];
                const auto begin = at + 3, end = begin + static_cast<std::ptrdiff_t>(at[2]);
                to.insert(to.end(), begin, end);
                at = end;
            }
        spent(entry, latest);
        return in;
    }

    // Every process sends as many doubles, also one with fewer ranks than others.
    std::span<const double> all_gather(const std::vector<Buffer>& mine) override {
        const double entry = now();
        check_count(mine.size(), "all_gather");
        const std::size_t n = mine[0].size(), most = hosted_.most() * n + 1,
                          size = static_cast<std::size_t>(hosted_.size());
        send_.assign(most, entry);  // the last is the stamp
        recv_.resize(static_cast<std::size_t>(hosted_.processes()) * most);
        for (std::size_t k = 0; k < mine.size(); ++k) std::ranges::copy(mine[k], send_.data() + k * n);
        check(
            MPI_Allgather(send_.data(), narrow(most), MPI_DOUBLE, recv_.data(), narrow(most), MPI_DOUBLE, comm_.handle),
            "all_gather");
        double latest = entry;
        gathered_.clear();
        for (int p = 0; p < hosted_.processes(); ++p) {
            const double* const from = recv_.data() + static_cast<std::size_t>(p) * most;
            const auto rows = static_cast<std::size_t>(hosted_.first(p + 1) - hosted_.first(p));
            gathered_.insert(gathered_.end(), from, from + rows * n);
            latest = std::max(latest, from[most - 1]);
        }
        for (const int rank : hosted_.ranks())
            if (rank != 0)
                count(n);  // up to rank 0; MPI may do otherwise, the count is that of the contract
            else
                for (std::size_t r = 1; r < size; ++r) count(size * n);  // and down again
        spent(entry, latest);
        return gathered_;
    }

    // MPI_Allreduce may add in any order, so the kernel sends messages of its own.
    void start_reduce(const std::vector<Buffer>& mine, std::size_t added) override {
        const double entry = now();
        check_count(mine.size(), "reduce");
        reduction_.start(mine, added, entry);
        spent(entry, entry);
    }
    std::span<const double> finish_reduce() override {
        const double entry = now();
        reduction_.go_on(true);
        spent(entry, reduction_.rows().stamp());
        return reduction_.rows().row(0);
    }
    void advance() override {
        const double entry = now();
        reduction_.go_on(false);
        spent(entry, entry);
    }

    // The clock of rank 0 [s], as well as this process knows it.
    double now() const override { return MPI_Wtime() + offset_; }
    // Throws std::out_of_range for a rank that is not hosted.
    void charge(int rank, Work kind, double count, double bytes) override {
        work_.at(static_cast<std::size_t>(rank)) += contacts_swept(kind, count);
        if (charged_) charged_(kind, count, bytes);
    }
    std::span<const double> work() const override { return work_; }
    Traffic traffic() const override { return traffic_; }
    CommSeconds seconds() const override { return seconds_; }

  private:
    static constexpr int tag = 0, route_tag = 1, reduce_tag = 3, barrier_tag = 4, first_channel_tag = 5;
    // One message to each process that this one sends to, and one from each that it receives from. Every message ends
    // with a stamp, the time at which its sender called start(). Requests are not persistent: with Open MPI 4.1.4 calls
    // for a message of up to 256 bytes then take half the time, for others the same (reports/findings/two-cores.md).
    class Messages final : public Channel {
      public:
        Messages(Mpi& comm, const std::vector<Links>& links)
            : comm_(comm), layout_(comm.hosted_, links, send_, recv_), tag_(comm.next_channel_tag()) {
            for (std::size_t k = 0; k < links.size(); ++k)
                for (const Link& link : links[k])
                    if (link.peer != comm.hosted_.ranks()[k]) messages_ += 1, doubles_ += link.send;
            requests_.assign(layout_.incoming.size() + layout_.outgoing.size(), MPI_REQUEST_NULL);
            statuses_.resize(requests_.size());
        }

        void start() override {
            const double entry = comm_.now();
            for (const auto& message : layout_.outgoing) comm_.charge_call(message.doubles.size());
            for (const auto& message : layout_.outgoing) message.doubles.back() = entry;
            MPI_Request* request = requests_.data();
            for (const auto& [process, message] : layout_.incoming)
                check(MPI_Irecv(message.data(), narrow(message.size()), MPI_DOUBLE, process, tag_, comm_.comm_.handle,
                                request++),
                      "start");
            for (const auto& [process, message] : layout_.outgoing)
                check(MPI_Isend(message.data(), narrow(message.size()), MPI_DOUBLE, process, tag_, comm_.comm_.handle,
                                request++),
                      "start");
            comm_.traffic_.messages += messages_;
            comm_.traffic_.bytes += static_cast<double>(doubles_ * sizeof(double));
            comm_.spent(entry, entry);
        }
        void finish() override {
            const double entry = comm_.now();
            // Waits for all requests even after an error: those under way still use our memory.
            int code = MPI_SUCCESS;
            for (std::size_t k = 0; k < requests_.size(); ++k) {
                const int failed = MPI_Wait(&requests_[k], &statuses_[k]);
                if (code == MPI_SUCCESS) code = failed;
            }
            check(code, "finish");
            double latest = entry;
            for (std::size_t m = 0; m < layout_.incoming.size(); ++m) {
                const auto& [process, message] = layout_.incoming[m];
                int n = 0;
                check(MPI_Get_count(&statuses_[m], MPI_DOUBLE, &n), "finish");
                if (n != narrow(message.size()))
                    throw std::logic_error("finish: the message of process " + std::to_string(process) +
                                           " to process " + std::to_string(comm_.hosted_.process()) +
                                           " is shorter than expected");
                latest = std::max(latest, message.back());
            }
            for (const auto& message : layout_.incoming) comm_.charge_call(message.doubles.size());
            comm_.spent(entry, latest);
        }

      private:
        Mpi& comm_;
        detail::MessageLayout layout_;
        int tag_;
        std::vector<MPI_Request> requests_;  // of incoming messages, then of outgoing ones
        std::vector<MPI_Status> statuses_;
        double messages_ = 0;
        std::size_t doubles_ = 0;
    };

    // The same on every rank, for channels are opened by all together. MPI guarantees 32767 tags: 30,000 channels
    // opened one after the other may not be in use at once.
    int next_channel_tag() { return first_channel_tag + channels_++ % 30'000; }

    // A reduction in rounds of messages (ReductionRounds). `counted`: whether traffic() counts its messages.
    class Reduction {
      public:
        Reduction(Mpi& comm, int own_tag, bool counted)
            : comm_(comm), rows_(comm.hosted_), own_tag_(own_tag), counted_(counted) {}

        bool under_way() const { return rows_.under_way(); }
        const ReducedRows& rows() const { return rows_; }

        void start(const std::vector<Buffer>& mine, std::size_t added, double stamp) {
            rows_.start(mine, added, stamp);
            start_round();
        }
        // Continues the reduction: to its end if `wait`, else as far as possible without waiting. One row is asked for
        // at a time, so that a call costs little: the first row that is not there ends it.
        void go_on(bool wait) {
            for (; under_way(); finish_round())
                for (; received_ < receiving_.size(); ++received_) {
                    MPI_Request& request = receiving_[received_];
                    int there = 1;
                    check(wait ? MPI_Wait(&request, MPI_STATUS_IGNORE) : MPI_Test(&request, &there, MPI_STATUS_IGNORE),
                          "reduce");
                    if (!there) return;
                }
        }

      private:
        void start_round() {
            receiving_.clear();
            sending_.clear();
            received_ = 0;
            if (!under_way()) return;
            const auto trade = [this](std::vector<MPI_Request>& requests, int process, Buffer& row, auto* call) {
                check(call(row.data(), narrow(row.size()), MPI_DOUBLE, process, own_tag_, comm_.comm_.handle,
                           &requests.emplace_back()),
                      "reduce");
            };
            rows_.trade([&](int process, Buffer& row) { trade(receiving_, process, row, &MPI_Irecv); },
                        [&](int process, Buffer& row) { trade(sending_, process, row, &MPI_Isend); },
                        [this](std::span<const double> row) {
                            if (counted_) comm_.count(row.size());
                        });
            if (counted_) rows_.visit_outgoing([this](std::size_t doubles) { comm_.charge_call(doubles); });
        }
        // Rows are short, so that MPI sends them at once: nobody waits here for a receiver that computes.
        void finish_round() {
            check(MPI_Waitall(narrow(sending_.size()), sending_.data(), MPI_STATUSES_IGNORE), "reduce");
            if (counted_) rows_.visit_incoming([this](std::size_t doubles) { comm_.charge_call(doubles); });
            rows_.finish_round();
            start_round();
        }

        Mpi& comm_;
        ReducedRows rows_;
        std::vector<MPI_Request> receiving_, sending_;  // of the round under way
        std::size_t received_ = 0;
        int own_tag_;
        bool counted_;
    };

    // A duplicate of the caller's communicator, so that our messages never meet the caller's.
    struct Duplicate {
        MPI_Comm handle = MPI_COMM_NULL;

        explicit Duplicate(MPI_Comm comm) {
            int initialised = 0;
            MPI_Initialized(&initialised);
            if (!initialised) throw std::logic_error("Mpi: MPI is not initialised");
            check(MPI_Comm_dup(comm, &handle), "MPI_Comm_dup");
            check(MPI_Comm_set_errhandler(handle, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
        }
        // The number that MPI_Comm_rank or MPI_Comm_size gives.
        int place(int (*ask)(MPI_Comm, int*)) const {
            int number = 0;
            check(ask(handle, &number), "MPI_Comm_rank or MPI_Comm_size");
            return number;
        }
        Duplicate(const Duplicate&) = delete;
        Duplicate& operator=(const Duplicate&) = delete;
        ~Duplicate() {
            int finalised = 0;
            MPI_Finalized(&finalised);
            if (!finalised) MPI_Comm_free(&handle);
        }
    };

    static void check(int code, const char* call) {
        if (code == MPI_SUCCESS) return;
        char text[MPI_MAX_ERROR_STRING];
        int length = 0;
        MPI_Error_string(code, text, &length);
        throw std::runtime_error(std::string(call) + ": " + std::string(text, static_cast<std::size_t>(length)));
    }

    void check_count(std::size_t buffers, const char* call) const {
        if (buffers != hosted_.count())
            throw std::logic_error(std::string(call) + ": " + std::to_string(buffers) + " buffers for " +
                                   std::to_string(hosted_.count()) + " ranks");
    }

    void check_peer(const char* call, std::size_t k, int peer) const {
        if (peer < 0 || peer >= size())
            throw std::logic_error(std::string(call) + ": rank " + std::to_string(hosted_.ranks()[k]) +
                                   " has a message for rank " + std::to_string(peer) + " of " + std::to_string(size()));
    }

    // MPI counts in int.
    static int narrow(std::size_t n) {
        if (!std::in_range<int>(n)) throw std::length_error("Mpi: " + std::to_string(n) + " doubles in one message");
        return static_cast<int>(n);
    }

    void count(std::size_t doubles) {
        traffic_.messages += 1;
        traffic_.bytes += static_cast<double>(doubles * sizeof(double));
    }

    // What calls take for a message, on a simulated machine, which lets messages pass without them.
    void charge_call(std::size_t doubles) const {
        if (charged_) charged_(Work::message, 1, double(doubles * sizeof(double)));
    }

    void spent(double entry, double latest) {
        const double elapsed = std::max(now() - entry, 0.0);
        const double wait = std::clamp(latest - entry, 0.0, elapsed);
        seconds_.wait += wait;
        seconds_.transfer += elapsed - wait;
    }

    // Clocks of different processes may differ by anything: each process asks the first one for the time several times,
    // and takes the answer that came back soonest. Good to half a round trip; later drift is not followed.
    void synchronise_clock() {
        int *global = nullptr, found = 0;
        check(MPI_Comm_get_attr(MPI_COMM_WORLD, MPI_WTIME_IS_GLOBAL, static_cast<void*>(&global), &found), "clock");
        if (found && *global) return;
        constexpr int rounds = 20;
        for (int r = 1; hosted_.process() == 0 && r < hosted_.processes(); ++r)
            for (int round = 0; round < rounds; ++round) {
                check(MPI_Recv(nullptr, 0, MPI_DOUBLE, r, tag, comm_.handle, MPI_STATUS_IGNORE), "clock");
                const double time = MPI_Wtime();
                check(MPI_Send(&time, 1, MPI_DOUBLE, r, tag, comm_.handle), "clock");
            }
        double shortest = std::numeric_limits<double>::infinity();
        for (int round = 0; hosted_.process() != 0 && round < rounds; ++round) {
            double time = 0;
            const double asked = MPI_Wtime();
            check(MPI_Send(nullptr, 0, MPI_DOUBLE, 0, tag, comm_.handle), "clock");
            check(MPI_Recv(&time, 1, MPI_DOUBLE, 0, tag, comm_.handle, MPI_STATUS_IGNORE), "clock");
            const double answered = MPI_Wtime();
            if (answered - asked >= shortest) continue;
            shortest = answered - asked;
            offset_ = time - (asked + answered) / 2;
        }
    }

    Duplicate comm_;
    HostedRanks hosted_;
    double offset_ = 0;  // to the clock of rank 0 [s]

    // Staging, which only grows.
    Buffer send_, recv_, gathered_;
    Reduction reduction_{*this, reduce_tag, true}, barrier_{*this, barrier_tag, false};
    std::vector<MPI_Request> requests_;
    int routes_ = 0, channels_ = 0;

    std::vector<double> work_ = std::vector<double>(hosted_.count());
    Charged charged_;
    Traffic traffic_;
    CommSeconds seconds_;
};

}  // namespace nscdd
