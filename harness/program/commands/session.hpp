// How a command that may run over MPI starts and ends it, and how its ranks are stopped together when one has an error.
#pragma once

#include <fmt/format.h>
#include <mpi.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <new>
#include <string>
#include <thread>

#include "files/error.hpp"
#include "files/say.hpp"
#include "nscdd/comm/mpi_node.hpp"
#include "registry/choices.hpp"

namespace nscdd {

// Compiled for SimGrid's SMPI: ranks and clock are simulated.
#ifdef NSCDD_SIMULATED
inline constexpr bool simulated = true;
#else
inline constexpr bool simulated = false;
#endif

// What --within-node asks for: memory that processes share is modelled on simulated machines.
inline WithinNode within_node(NodeTransport asked) {
    if (asked == NodeTransport::messages) return WithinNode::messages;
    return simulated ? WithinNode::modelled : WithinNode::memory;
}

// MPI for the time of one command, unless the process was started alone and did not ask for it: starting it takes more
// time than many a scene, and jobs of Open MPI side by side on one machine now and then fail to start (its issue 8510).
// Ranks that fail alone would leave the others waiting: every risky part goes through together(), after which all go on
// or all stop.
class Session {
  public:
    explicit Session(bool with_mpi) : with_mpi_(with_mpi) {
        if (!with_mpi_) return;
        int provided = 0;
        MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
        MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
        MPI_Comm_size(MPI_COMM_WORLD, &size_);
    }
    ~Session() {
        if (with_mpi_) MPI_Finalize();
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    int rank() const { return rank_; }
    int size() const { return size_; }

    // False when any rank threw; the lowest of these ranks says why, in one line.
    bool together(auto&& part) const {
        std::string problem;
        try {
            part();
        } catch (const std::bad_alloc&) {  // of this rank alone, amid calls that the others are waiting in
            say(stderr, "nscdd: rank {} is out of memory\n", rank_);
            if (with_mpi_) MPI_Abort(MPI_COMM_WORLD, 1);
            return false;
        } catch (const std::exception& error) {
            problem = error.what();
        }
        const int first = first_with(problem);
        if (first == rank_) say(stderr, "nscdd: {}\n", one_line(problem));
        return first == size_;
    }

    // Throws, on all ranks, unless they all have the same text: ranks of different runs would wait for each other.
    void require_same(const std::string& what, const std::string& mine) const {
        if (!with_mpi_) return;
        const std::uint64_t hash = std::hash<std::string>{}(mine);
        std::uint64_t least = hash, largest = hash;
        MPI_Allreduce(&hash, &least, 1, MPI_UINT64_T, MPI_MIN, MPI_COMM_WORLD);
        MPI_Allreduce(&hash, &largest, 1, MPI_UINT64_T, MPI_MAX, MPI_COMM_WORLD);
        if (least != largest) throw InputError(fmt::format("ranks were started with different {}", what));
    }

  private:
    // Lowest rank with a problem; size() if there is none. Other ranks may wait, in a call of the part, for a rank that
    // has left it: after ten seconds that rank stops them.
    int first_with(const std::string& problem) const {
        const int mine = problem.empty() ? size_ : rank_;
        int first = mine;
        if (!with_mpi_) return first;
        if (simulated) {  // a simulated clock advances inside MPI alone
            MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
            return first;
        }
        MPI_Request all = MPI_REQUEST_NULL;
        MPI_Iallreduce(&mine, &first, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD, &all);
        const double began = MPI_Wtime();
        for (int done = 0;;) {
            MPI_Test(&all, &done, MPI_STATUS_IGNORE);
            if (done) return first;
            if (!problem.empty() && MPI_Wtime() - began > 10) {
                say(stderr, "nscdd: rank {} alone: {}\n", rank_, one_line(problem));
                MPI_Abort(MPI_COMM_WORLD, 1);
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }

    bool with_mpi_;
    int rank_ = 0, size_ = 1;
};

}  // namespace nscdd
