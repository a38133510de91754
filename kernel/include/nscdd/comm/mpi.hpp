// One rank per process over MPI. The only header that includes mpi.h; nothing else includes this one.
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

#include "nscdd/comm/communicator.hpp"

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
class Mpi final : public Communicator {
  public:
    // Works on a duplicate of `comm`. The caller initialises MPI before and finalises it after. Collective. `charged`
    // is told of all that is charged, where somebody wants to know.
    explicit Mpi(MPI_Comm comm = MPI_COMM_WORLD, Charged charged = {}) : comm_(comm), charged_(std::move(charged)) {
        check(MPI_Comm_rank(comm_.handle, &rank_), "MPI_Comm_rank");
        check(MPI_Comm_size(comm_.handle, &size_), "MPI_Comm_size");
        synchronise_clock();
    }

    int size() const override { return size_; }
    std::span<const int> ranks() const override { return {&rank_, 1}; }

    // Throws std::logic_error for a peer that is no rank. finish() throws std::logic_error when a message is shorter
    // than expected, std::runtime_error when it is longer.
    std::unique_ptr<Channel> open(const std::vector<Links>& links) override {
        check_count(links.size(), 1, "open");
        for (const Link& link : links[0]) check_peer("open", link.peer);
        return std::make_unique<Messages>(*this, links[0]);
    }

    // Each message goes alone to its target, which learns of it by looking (NBX: Hoefler, Siebert, Lumsdaine, PPoPP
    // 2010): when all of a rank's messages have been taken it enters a barrier, and when that is over nobody has any
    // under way.
    std::vector<Buffer> route(const std::vector<Outbox>& out) override {
        const double entry = now();
        check_count(out.size(), 1, "route");
        std::vector<Buffer> staged;
        staged.reserve(out[0].size());
        std::map<int, Buffer> arrived;
        requests_.clear();
        routes_ = 1 - routes_;  // messages of the next route do not meet this one's
        for (const auto& [target, message] : out[0]) {
            check_peer("route", target);
            if (target == rank_) arrived[rank_] = message;
            if (target == rank_ || message.empty()) continue;
            Buffer& stamped = staged.emplace_back(message.size() + 1);
            pack(message, entry, stamped.data());
            count(message.size());
            check(MPI_Issend(stamped.data(), narrow(stamped.size()), MPI_DOUBLE, target, route_tag + routes_,
                             comm_.handle, &requests_.emplace_back()),
                  "route");
        }
        double latest = entry;
        MPI_Request barrier = MPI_REQUEST_NULL;
        for (bool inside = false, over = false; !over;) {
            int flag = 0;
            MPI_Status status;
            check(MPI_Iprobe(MPI_ANY_SOURCE, route_tag + routes_, comm_.handle, &flag, &status), "route");
            if (flag) {
                int n = 0;
                check(MPI_Get_count(&status, MPI_DOUBLE, &n), "route");
                Buffer& in = arrived[status.MPI_SOURCE];
                in.resize(static_cast<std::size_t>(n));
                check(MPI_Recv(in.data(), n, MPI_DOUBLE, status.MPI_SOURCE, route_tag + routes_, comm_.handle,
                               MPI_STATUS_IGNORE),
                      "route");
                latest = std::max(latest, in.back());
                in.pop_back();
                continue;
            }
            if (inside) {
                check(MPI_Test(&barrier, &flag, MPI_STATUS_IGNORE), "route");
                over = flag != 0;
            } else {
                check(MPI_Testall(narrow(requests_.size()), requests_.data(), &flag, MPI_STATUSES_IGNORE), "route");
                if (flag) check(MPI_Ibarrier(comm_.handle, &barrier), "route");
                inside = flag != 0;
            }
        }
        std::vector<Buffer> in(1);
        for (const auto& [source, message] : arrived) in[0].insert(in[0].end(), message.begin(), message.end());
        spent(entry, latest);
        return in;
    }

    std::span<const double> all_gather(const std::vector<Buffer>& mine) override {
        const double entry = now();
        check_count(mine.size(), 1, "all_gather");
        const std::size_t n = mine[0].size();
        send_.resize(n + 1);
        recv_.resize(static_cast<std::size_t>(size_) * (n + 1));
        pack(mine[0], entry, send_.data());
        check(MPI_Allgather(send_.data(), narrow(n + 1), MPI_DOUBLE, recv_.data(), narrow(n + 1), MPI_DOUBLE,
                            comm_.handle),
              "all_gather");
        double latest = entry;
        gathered_.clear();
        for (auto from = recv_.begin(); from != recv_.end(); from += static_cast<std::ptrdiff_t>(n + 1)) {
            const auto stamp = from + static_cast<std::ptrdiff_t>(n);
            gathered_.insert(gathered_.end(), from, stamp);
            latest = std::max(latest, *stamp);
        }
        if (rank_ != 0) count(n);  // up to rank 0; MPI may do otherwise, the count is that of the contract
        for (int r = 1; rank_ == 0 && r < size_; ++r) count(static_cast<std::size_t>(size_) * n);  // and down again
        spent(entry, latest);
        return gathered_;
    }

    // By recursive doubling, log2(size) messages one after the other: MPI_Allreduce may take any order.
    std::span<const double> reduce(const std::vector<Buffer>& mine, std::size_t added) override {
        const double entry = now();
        check_count(mine.size(), 1, "reduce");
        const std::size_t n = mine[0].size();
        if (added > n) throw std::logic_error("reduce: adds more numbers than there are");
        reduced_.resize(n + 1);
        recv_.resize(n + 1);
        pack(mine[0], entry, reduced_.data());  // of the stamps the largest arrives
        const int p = tree_size(size_), rest = size_ - p;
        if (rank_ >= p) {
            send(reduced_, rank_ - p), receive(reduced_, rank_ - p);
            count(n);
        } else {
            if (rank_ < rest) receive(recv_, rank_ + p), combine_in_tree(reduced_, recv_, added);
            for (int step = 1; step < p; step *= 2) {
                check(
                    MPI_Sendrecv(reduced_.data(), narrow(n + 1), MPI_DOUBLE, rank_ ^ step, reduce_tag, recv_.data(),
                                 narrow(n + 1), MPI_DOUBLE, rank_ ^ step, reduce_tag, comm_.handle, MPI_STATUS_IGNORE),
                    "reduce");
                combine_in_tree(reduced_, recv_, added);
                count(n);
            }
            if (rank_ < rest) send(reduced_, rank_ + p), count(n);
        }
        spent(entry, reduced_[n]);
        return std::span(reduced_).first(n);
    }

    // The clock of rank 0 [s], as well as this process knows it.
    double now() const override { return MPI_Wtime() + offset_; }
    // Throws std::out_of_range unless rank, an index into ranks(), is 0.
    void charge(int rank, Work kind, double count, double bytes) override {
        if (rank != 0) throw std::out_of_range("charge: no hosted rank " + std::to_string(rank));
        work_ += contacts_swept(kind, count);
        if (charged_) charged_(kind, count, bytes);
    }
    std::span<const double> work() const override { return {&work_, 1}; }
    Traffic traffic() const override { return traffic_; }
    CommSeconds seconds() const override { return seconds_; }

  private:
    static constexpr int tag = 0, route_tag = 1, reduce_tag = 3, first_channel_tag = 4;

    // Of persistent requests. Every message has a stamp behind it, the time at which its sender called start().
    class Messages final : public Channel {
      public:
        Messages(Mpi& comm, const Links& links) : comm_(comm) {
            std::size_t all = 0;
            for (const Link& link : links) all += link.send + link.recv + 2;
            memory_.resize(all);
            requests_.resize(2 * links.size(), MPI_REQUEST_NULL);
            statuses_.resize(requests_.size());
            send_.resize(1), recv_.resize(1);
            const int own_tag = comm.next_channel_tag();
            double* at = memory_.data();
            for (std::size_t l = 0; l < links.size(); ++l) {
                const auto& [peer, send, recv] = links[l];
                recv_[0].emplace_back(at, recv);
                check(MPI_Recv_init(at, narrow(recv + 1), MPI_DOUBLE, peer, own_tag, comm.comm_.handle, &requests_[l]),
                      "open");
                at += recv + 1;
                send_[0].emplace_back(at, send);
                check(MPI_Send_init(at, narrow(send + 1), MPI_DOUBLE, peer, own_tag, comm.comm_.handle,
                                    &requests_[links.size() + l]),
                      "open");
                at += send + 1;
                if (peer == comm.rank_) continue;
                messages_ += 1;
                doubles_ += send;
            }
        }
        ~Messages() override {
            int finalised = 0;
            MPI_Finalized(&finalised);
            for (MPI_Request& request : requests_)
                if (!finalised && request != MPI_REQUEST_NULL) MPI_Request_free(&request);
        }
        Messages(const Messages&) = delete;
        Messages& operator=(const Messages&) = delete;

        void start() override {
            const double entry = comm_.now();
            for (const auto& message : send_[0]) *(message.data() + message.size()) = entry;
            if (!requests_.empty()) check(MPI_Startall(narrow(requests_.size()), requests_.data()), "start");
            comm_.traffic_.messages += messages_;
            comm_.traffic_.bytes += static_cast<double>(doubles_ * sizeof(double));
            comm_.spent(entry, entry);
        }
        void finish() override {
            const double entry = comm_.now();
            // All of them even after an error, for those under way still use our memory.
            int code = MPI_SUCCESS;
            for (std::size_t k = 0; k < requests_.size(); ++k) {
                const int failed = MPI_Wait(&requests_[k], &statuses_[k]);
                if (code == MPI_SUCCESS) code = failed;
            }
            check(code, "finish");
            double latest = entry;
            for (std::size_t l = 0; l < recv_[0].size(); ++l) {
                int n = 0;
                check(MPI_Get_count(&statuses_[l], MPI_DOUBLE, &n), "finish");
                if (n != narrow(recv_[0][l].size() + 1))
                    throw std::logic_error("finish: the message of rank " + std::to_string(statuses_[l].MPI_SOURCE) +
                                           " to rank " + std::to_string(comm_.rank_) + " is shorter than expected");
                latest = std::max(latest, *(recv_[0][l].data() + recv_[0][l].size()));
            }
            comm_.spent(entry, latest);
        }

      private:
        Mpi& comm_;
        Buffer memory_;
        std::vector<MPI_Request> requests_;  // of receives, then of sends
        std::vector<MPI_Status> statuses_;
        double messages_ = 0;
        std::size_t doubles_ = 0;
    };

    // The same on every rank, for channels are opened by all together. MPI guarantees 32767 tags: 30,000 channels
    // opened one after the other may not be in use at once.
    int next_channel_tag() { return first_channel_tag + channels_++ % 30'000; }

    void send(const Buffer& buffer, int peer) {
        check(MPI_Send(buffer.data(), narrow(buffer.size()), MPI_DOUBLE, peer, reduce_tag, comm_.handle), "reduce");
    }
    void receive(Buffer& buffer, int peer) {
        check(MPI_Recv(buffer.data(), narrow(buffer.size()), MPI_DOUBLE, peer, reduce_tag, comm_.handle,
                       MPI_STATUS_IGNORE),
              "reduce");
    }

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

    static void check_count(std::size_t buffers, std::size_t ranks, const char* call) {
        if (buffers != ranks)
            throw std::logic_error(std::string(call) + ": " + std::to_string(buffers) + " buffers for " +
                                   std::to_string(ranks) + " ranks");
    }

    void check_peer(const char* call, int peer) const {
        if (peer < 0 || peer >= size_)
            throw std::logic_error(std::string(call) + ": rank " + std::to_string(rank_) + " has a message for rank " +
                                   std::to_string(peer) + " of " + std::to_string(size_));
    }

    // MPI counts in int.
    static int narrow(std::size_t n) {
        if (!std::in_range<int>(n)) throw std::length_error("Mpi: " + std::to_string(n) + " doubles in one message");
        return static_cast<int>(n);
    }

    static void pack(const Buffer& payload, double stamp, double* to) { *std::ranges::copy(payload, to).out = stamp; }

    void count(std::size_t doubles) {
        traffic_.messages += 1;
        traffic_.bytes += static_cast<double>(doubles * sizeof(double));
    }

    void spent(double entry, double latest) {
        const double elapsed = std::max(now() - entry, 0.0);
        const double wait = std::clamp(latest - entry, 0.0, elapsed);
        seconds_.wait += wait;
        seconds_.transfer += elapsed - wait;
    }

    // Clocks of different processes may differ by anything: each rank asks rank 0 for the time, and believes the
    // answer that came back soonest. Good to half a round trip; later drift is not followed.
    void synchronise_clock() {
        int *global = nullptr, found = 0;
        check(MPI_Comm_get_attr(MPI_COMM_WORLD, MPI_WTIME_IS_GLOBAL, static_cast<void*>(&global), &found), "clock");
        if (found && *global) return;
        constexpr int rounds = 20;
        for (int r = 1; rank_ == 0 && r < size_; ++r)
            for (int round = 0; round < rounds; ++round) {
                check(MPI_Recv(nullptr, 0, MPI_DOUBLE, r, tag, comm_.handle, MPI_STATUS_IGNORE), "clock");
                const double time = MPI_Wtime();
                check(MPI_Send(&time, 1, MPI_DOUBLE, r, tag, comm_.handle), "clock");
            }
        double shortest = std::numeric_limits<double>::infinity();
        for (int round = 0; rank_ != 0 && round < rounds; ++round) {
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
    int rank_ = 0, size_ = 1;
    double offset_ = 0;  // to the clock of rank 0 [s]

    // Staging, which only grows.
    Buffer send_, recv_, gathered_, reduced_;
    std::vector<MPI_Request> requests_;
    int routes_ = 0, channels_ = 0;

    double work_ = 0;
    Charged charged_;
    Traffic traffic_;
    CommSeconds seconds_;
};

}  // namespace nscdd
