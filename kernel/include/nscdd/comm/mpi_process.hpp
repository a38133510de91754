#pragma once

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "nscdd/comm/mpi_node.hpp"
#include "nscdd/comm/rank_map.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// MPI counts in int. Throws std::length_error for more.
inline int mpi_count(std::size_t n) {
    if (!std::in_range<int>(n)) throw std::length_error("Mpi: " + std::to_string(n) + " doubles in one message");
    return static_cast<int>(n);
}

/// What the parts of Mpi share: the communicator of MPI, the ranks of this process, the clock, and what is counted.
/// Includes mpi.h, as mpi.hpp does.
class MpiProcess {
  public:
    static constexpr int clock_tag = 0, route_tag = 1, reduce_tag = 3, barrier_tag = 4, first_channel_tag = 5;

    /// Arguments and errors: Mpi. Collective.
    MpiProcess(MPI_Comm comm, Meter::Charged charged, int size, WithinNode within)
        : comm_(comm),
          hosted_(comm_.place(&MPI_Comm_rank), comm_.place(&MPI_Comm_size), size),
          node_(comm_.handle, within),
          meter_(hosted_.count(), std::move(charged)) {
        synchronise_clock();
    }

    MPI_Comm comm() const { return comm_.handle; }
    const detail::RankMap& hosted() const { return hosted_; }
    NodeMemory& node() { return node_; }
    /// The same on every rank, for channels are opened by all together. MPI guarantees 32767 tags: 30,000 channels
    /// opened one after the other may not be in use at once.
    int next_channel_tag() { return first_channel_tag + channels_++ % 30'000; }

    /// Communicator::now(), as well as this process knows the clock of rank 0.
    double now() const { return MPI_Wtime() + offset_; }

    void count(Communicator::Operation operation, std::size_t messages, std::size_t doubles) {  // in traffic()
        traffic_.add(operation, messages, doubles);
    }
    Meter& meter() { return meter_; }
    /// What sending or receiving takes for a message, on a simulated machine, which lets messages pass without it.
    void charge_call(std::size_t doubles, bool shared) const {
        meter_.charge_message(double(doubles * sizeof(double)), shared);
    }
    /// A call of an operation that began at `entry` ends now; the latest of its partners began at `latest`.
    void spent(Communicator::Operation operation, double entry, double latest) {
        const double elapsed = (std::max)(now() - entry, 0.0);
        const double wait = std::clamp(latest - entry, 0.0, elapsed);
        seconds_.add(operation, wait, elapsed - wait);
    }
    Communicator::Traffic traffic() const { return traffic_; }
    Communicator::Seconds seconds() const { return seconds_; }

  private:
    /// A duplicate of the caller's communicator, so that our messages never meet the caller's.
    struct Duplicate {
        MPI_Comm handle = MPI_COMM_NULL;

        explicit Duplicate(MPI_Comm comm) {
            int initialised = 0;
            MPI_Initialized(&initialised);
            if (!initialised) throw std::logic_error("Mpi: MPI is not initialised");
            check_mpi(MPI_Comm_dup(comm, &handle), "MPI_Comm_dup");
            check_mpi(MPI_Comm_set_errhandler(handle, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
        }
        /// The number that MPI_Comm_rank or MPI_Comm_size gives.
        int place(int (*ask)(MPI_Comm, int*)) const {
            int number = 0;
            check_mpi(ask(handle, &number), "MPI_Comm_rank or MPI_Comm_size");
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

    /// Clocks of different processes may differ by anything: each process asks the first one for the time several
    /// times, and takes the answer that came back soonest. Good to half a round trip; later drift is not followed.
    void synchronise_clock() {
        int *global = nullptr, found = 0;
        check_mpi(MPI_Comm_get_attr(MPI_COMM_WORLD, MPI_WTIME_IS_GLOBAL, static_cast<void*>(&global), &found), "clock");
        if (found && *global) return;
        constexpr int rounds = 20;
        for (int r = 1; hosted_.process() == 0 && r < hosted_.processes(); ++r)
            for (int round = 0; round < rounds; ++round) {
                check_mpi(MPI_Recv(nullptr, 0, MPI_DOUBLE, r, clock_tag, comm_.handle, MPI_STATUS_IGNORE), "clock");
                const double time = MPI_Wtime();
                check_mpi(MPI_Send(&time, 1, MPI_DOUBLE, r, clock_tag, comm_.handle), "clock");
            }
        double shortest = std::numeric_limits<double>::infinity();
        for (int round = 0; hosted_.process() != 0 && round < rounds; ++round) {
            double time = 0;
            const double asked = MPI_Wtime();
            check_mpi(MPI_Send(nullptr, 0, MPI_DOUBLE, 0, clock_tag, comm_.handle), "clock");
            check_mpi(MPI_Recv(&time, 1, MPI_DOUBLE, 0, clock_tag, comm_.handle, MPI_STATUS_IGNORE), "clock");
            const double answered = MPI_Wtime();
            if (answered - asked >= shortest) continue;
            shortest = answered - asked;
            offset_ = time - (asked + answered) / 2;
        }
    }

    Duplicate comm_;
    detail::RankMap hosted_;
    NodeMemory node_;
    double offset_ = 0;  ///< to the clock of rank 0 [s]
    int channels_ = 0;
    Meter meter_;
    Communicator::Traffic traffic_;
    Communicator::Seconds seconds_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
