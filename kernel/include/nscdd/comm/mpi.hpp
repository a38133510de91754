// One rank per process over MPI. The only header that includes mpi.h; nothing else includes this one.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
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
// that the caller can only abort.
//
// Wait and transfer are told apart as in late-sender analysis (Scalasca): every message carries the time at which
// its sender entered the call; what lies between our entry and that of the latest partner is wait, the rest is
// transfer. The root of a gather waits for its senders; they wait for no one. A scatter is the reverse.
class Mpi final : public Communicator {
  public:
    // Works on a duplicate of `comm`. The caller initialises MPI before and finalises it after. Collective.
    explicit Mpi(MPI_Comm comm = MPI_COMM_WORLD) : comm_(comm) {
        check(MPI_Comm_rank(comm_.handle, &rank_), "MPI_Comm_rank");
        check(MPI_Comm_size(comm_.handle, &size_), "MPI_Comm_size");
        counts_.resize(static_cast<std::size_t>(size_));
        offsets_.resize(counts_.size());
        synchronise_clock();
    }

    int size() const override { return size_; }
    std::span<const int> ranks() const override { return {&rank_, 1}; }

    void exchange(std::vector<Links>& links) override {
        const double entry = now();
        check_count(links.size(), 1, "exchange");
        Links& mine = links[0];
        std::size_t sent = 0, received = 0;
        for (const Link& link : mine) {
            check_peer(link.peer);
            sent += link.send.size() + 1;
            received += link.recv.size() + 1;
        }
        send_.resize(sent);
        recv_.resize(received);
        requests_.resize(2 * mine.size());
        statuses_.resize(requests_.size());

        auto request = requests_.begin();
        double* from = recv_.data();
        for (const Link& link : mine) {
            const int n = narrow(link.recv.size() + 1);
            check(MPI_Irecv(from, n, MPI_DOUBLE, link.peer, tag, comm_.handle, &*request++), "exchange");
            from += n;
        }
        double* to = send_.data();
        for (const Link& link : mine) {
            const int n = narrow(link.send.size() + 1);
            pack(link.send, entry, to);
            check(MPI_Isend(to, n, MPI_DOUBLE, link.peer, tag, comm_.handle, &*request++), "exchange");
            to += n;
            if (link.peer != rank_) count(link.send.size());
        }
        // All of them even after an error, for those under way still use our buffers.
        int code = MPI_SUCCESS;
        for (std::size_t k = 0; k < requests_.size(); ++k) {
            const int failed = MPI_Wait(&requests_[k], &statuses_[k]);
            if (code == MPI_SUCCESS) code = failed;
        }
        check(code, "exchange");

        double latest = entry;
        from = recv_.data();
        for (std::size_t l = 0; l < mine.size(); ++l) {
            int n = 0;
            check(MPI_Get_count(&statuses_[l], MPI_DOUBLE, &n), "exchange");
            if (n != narrow(mine[l].recv.size() + 1)) throw shorter("exchange", mine[l].peer);
            latest = std::max(latest, unpack(from, mine[l].recv));
            from += n;
        }
        spent(entry, latest);
    }

    std::vector<Buffer> route(const std::vector<std::vector<Buffer>>& out) override {
        const double entry = now();
        check_count(out.size(), 1, "route");
        check_count(out[0].size(), counts_.size(), "route");

        // First the sizes, with the time of entry beside each.
        send_.resize(2 * counts_.size());
        recv_.resize(2 * counts_.size());
        for (int d = 0; d < size_; ++d) {
            send_[2 * d] = static_cast<double>(out[0][d].size());
            send_[2 * d + 1] = entry;
        }
        check(MPI_Alltoall(send_.data(), 2, MPI_DOUBLE, recv_.data(), 2, MPI_DOUBLE, comm_.handle), "route");
        std::vector<int> recv_counts(counts_.size()), recv_offsets(counts_.size());
        std::size_t received = 0;
        double latest = entry;
        for (int s = 0; s < size_; ++s) {
            const auto n = static_cast<std::size_t>(recv_[2 * s]);
            recv_counts[s] = narrow(n);
            recv_offsets[s] = narrow(received);
            received += n;
            latest = std::max(latest, recv_[2 * s + 1]);
        }

        send_.clear();
        for (int d = 0; d < size_; ++d) {
            const Buffer& message = out[0][d];
            counts_[d] = narrow(message.size());
            offsets_[d] = narrow(send_.size());
            send_.insert(send_.end(), message.begin(), message.end());
            if (d != rank_ && !message.empty()) count(message.size());
        }
        std::vector<Buffer> in(1, Buffer(received));
        check(MPI_Alltoallv(send_.data(), counts_.data(), offsets_.data(), MPI_DOUBLE, in[0].data(), recv_counts.data(),
                            recv_offsets.data(), MPI_DOUBLE, comm_.handle),
              "route");
        spent(entry, latest);
        return in;
    }

    void gather(const std::vector<Buffer>& mine, std::vector<Buffer>& all) override {
        const double entry = now();
        check_count(mine.size(), 1, "gather");
        const int n = narrow(mine[0].size() + 1);
        send_.resize(mine[0].size() + 1);
        pack(mine[0], entry, send_.data());
        if (rank_ == 0) {
            recv_.resize(lay_out(all, "gather"));
            std::ranges::fill(recv_, unset);
        } else {
            count(mine[0].size());
        }
        check(MPI_Gatherv(send_.data(), n, MPI_DOUBLE, recv_.data(), counts_.data(), offsets_.data(), MPI_DOUBLE, 0,
                          comm_.handle),
              "gather");
        double latest = entry;
        if (rank_ == 0)
            for (int r = 0; r < size_; ++r) {
                const double stamp = unpack(recv_.data() + offsets_[r], all[r]);
                if (std::isnan(stamp)) throw shorter("gather", r);
                latest = std::max(latest, stamp);
            }
        spent(entry, latest);
    }

    void scatter(const std::vector<Buffer>& all, std::vector<Buffer>& mine) override {
        const double entry = now();
        check_count(mine.size(), 1, "scatter");
        const int n = narrow(mine[0].size() + 1);
        recv_.assign(mine[0].size() + 1, unset);
        if (rank_ == 0) {
            send_.resize(lay_out(all, "scatter"));
            for (int r = 0; r < size_; ++r) {
                pack(all[r], entry, send_.data() + offsets_[r]);
                if (r != 0) count(all[r].size());
            }
        }
        check(MPI_Scatterv(send_.data(), counts_.data(), offsets_.data(), MPI_DOUBLE, recv_.data(), n, MPI_DOUBLE, 0,
                           comm_.handle),
              "scatter");
        const double stamp = unpack(recv_.data(), mine[0]);
        if (std::isnan(stamp)) throw shorter("scatter", 0);
        spent(entry, stamp);
    }

    std::span<const double> all_gather(const std::vector<Buffer>& mine) override {
        const double entry = now();
        check_count(mine.size(), 1, "all_gather");
        const std::size_t n = mine[0].size();
        send_.resize(n + 1);
        recv_.resize(counts_.size() * (n + 1));
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
        for (int r = 1; rank_ == 0 && r < size_; ++r) count(counts_.size() * n);  // and down again
        spent(entry, latest);
        return gathered_;
    }

    // The clock of rank 0 [s], as well as this process knows it.
    double now() const override { return MPI_Wtime() + offset_; }
    // Throws std::out_of_range unless rank, an index into ranks(), is 0.
    void charge(int rank, double cost) override {
        if (rank != 0) throw std::out_of_range("charge: no hosted rank " + std::to_string(rank));
        work_ += cost;
    }
    std::span<const double> work() const override { return {&work_, 1}; }
    Traffic traffic() const override { return traffic_; }
    CommSeconds seconds() const override { return seconds_; }

  private:
    static constexpr int tag = 0;
    static constexpr double unset = std::numeric_limits<double>::quiet_NaN();  // where a stamp should arrive

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

    std::logic_error shorter(const char* call, int source) const {
        return std::logic_error(std::string(call) + ": the message of rank " + std::to_string(source) + " to rank " +
                                std::to_string(rank_) + " is shorter than expected");
    }

    static void check_count(std::size_t buffers, std::size_t ranks, const char* call) {
        if (buffers != ranks)
            throw std::logic_error(std::string(call) + ": " + std::to_string(buffers) + " buffers for " +
                                   std::to_string(ranks) + " ranks");
    }

    void check_peer(int peer) const {
        if (peer < 0 || peer >= size_)
            throw std::logic_error("exchange: rank " + std::to_string(rank_) + " has a link to rank " +
                                   std::to_string(peer) + " of " + std::to_string(size_));
    }

    // MPI counts in int.
    static int narrow(std::size_t n) {
        if (!std::in_range<int>(n)) throw std::length_error("Mpi: " + std::to_string(n) + " doubles in one message");
        return static_cast<int>(n);
    }

    static void pack(const Buffer& payload, double stamp, double* to) { *std::ranges::copy(payload, to).out = stamp; }

    // Fills the payload and returns the stamp behind it.
    static double unpack(const double* from, Buffer& payload) {
        std::copy_n(from, payload.size(), payload.begin());
        return from[payload.size()];
    }

    // Counts and offsets of one stamped message per rank; returns the doubles in all.
    std::size_t lay_out(const std::vector<Buffer>& all, const char* call) {
        check_count(all.size(), counts_.size(), call);
        std::size_t total = 0;
        for (std::size_t r = 0; r < all.size(); ++r) {
            counts_[r] = narrow(all[r].size() + 1);
            offsets_[r] = narrow(total);
            total += all[r].size() + 1;
        }
        return total;
    }

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
    Buffer send_, recv_, gathered_;
    std::vector<int> counts_, offsets_;
    std::vector<MPI_Request> requests_;
    std::vector<MPI_Status> statuses_;

    double work_ = 0;
    Traffic traffic_;
    CommSeconds seconds_;
};

}  // namespace nscdd
