/// @file
/// The time of a process, by phases of algorithm 1.
#pragma once

#include "nscdd/comm/communicator.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Time of one process by phases, added up over the steps.
struct PhaseSeconds {
    /// Time of a phase [s], outside the communicator, and inside it as in Communicator::Seconds.
    struct Phase {
        double own = 0;       ///< own work [s]
        double wait = 0;      ///< waiting for partners [s]
        double transfer = 0;  ///< sending and receiving [s]
    };

    Phase detect;     ///< contact detection, new decomposition of the domain, multiplicities
    Phase load;       ///< contacts into the layout of the sweep, and answers back
    Phase sweep;      ///< of the iteration, sweeps
    Phase test;       ///< of the iteration, tests of convergence, and other methods that they call
    Phase interface;  ///< the rest of the iteration
    Phase advance;    ///< initial velocities and impulses, motion of the grains
};

/// Adds the time since the last lap to a phase.
class Stopwatch {
  public:
    /// Starts the watch. `comm` must live as long, because its clock is read.
    explicit Stopwatch(const Communicator& comm) : comm_(comm), last_(reading()) {}
    /// Adds the time since the last lap(), skip() or the start to `phase`.
    void lap(PhaseSeconds::Phase& phase) {
        const PhaseSeconds::Phase now = reading();
        phase.own += now.own - last_.own;
        phase.wait += now.wait - last_.wait;
        phase.transfer += now.transfer - last_.transfer;
        last_ = now;
    }
    void skip() { last_ = reading(); }  ///< the time since the last lap belongs to no phase

  private:
    PhaseSeconds::Phase reading() const {
        const Communicator::Seconds inside = comm_.seconds();
        return {comm_.now() - inside.wait - inside.transfer, inside.wait, inside.transfer};
    }
    const Communicator& comm_;
    PhaseSeconds::Phase last_;
};

}}  // namespace nscdd::NSCDD_ABI
