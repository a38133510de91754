// When a run writes checkpoints, and when it stops for one.
#pragma once

#include <cstdint>
#include <string>

#include "nscdd/comm/communicator.hpp"

namespace nscdd {

// Number of steps, counted from the start of the scene, or seconds between checkpoints; at least one of them is 0.
struct CheckpointEvery {
    std::int64_t steps = 0;
    double seconds = 0;
};

// Reads "50", which is steps, or "60s". Throws InputError.
CheckpointEvery read_checkpoint_every(const std::string& text);

// SIGUSR1 no longer ends the process, but is waited for by Checkpoints.
void listen_for_checkpoint_signal();

class Checkpoints {
  public:
    enum class Due { no, write, write_and_stop };

    Checkpoints(Communicator& comm, const CheckpointEvery& every) : comm_(comm), every_(every), last_(comm.now()) {}

    // To be called after each step with the number of steps made. Returns the same on all ranks, though a signal may
    // reach some of them alone and their clocks differ. Collective.
    Due after(std::int64_t steps);

  private:
    Communicator& comm_;
    CheckpointEvery every_;
    double last_;  // time of the last checkpoint [s]
};

}  // namespace nscdd
