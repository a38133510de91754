// How processes that mpirun or srun has started say one thing together, also for a command that makes no use of MPI.
#pragma once

#include <functional>

namespace nscdd {

// Started by mpirun or srun, as opposed to alone: there one rank is an MPI run as well. A simulated rank is always one
// of a run of smpirun.
bool launched();

// part(rank, ranks) of a process that ends, or that goes on without MPI; alone it is rank 0 of 1. Collective. False
// when any rank threw: the lowest of these says why, in one line, before any process ends.
bool at_start(const std::function<void(int, int)>& part);

}  // namespace nscdd
