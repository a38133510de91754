// How processes that mpirun or srun has started begin together, also for a command that makes no use of MPI.
#pragma once

#include <functional>
#include <span>
#include <string>

namespace nscdd {

class Session;

// Started by mpirun or srun, as opposed to alone: there one rank is an MPI run as well. A simulated rank is always one
// of a run of smpirun.
bool launched();

// The MPI that the program is linked with, and its version.
std::string mpi_library();

// Starts MPI where the processes were launched or `with_mpi` asks for it, calls check(ranks) and then part(session,
// rank), and ends MPI; alone the process is rank 0 of 1. Collective. Returns what the part does. 1, without the part,
// when the check of any rank threw or the words of the command line differ between ranks: all would wait for each
// other.
int begin_together(std::span<char*> words, bool with_mpi, const std::function<void(int)>& check,
                   const std::function<int(const Session&, int)>& part);

// Makes a standard stream that is closed /dev/null, lest a file gets its number and with it what is printed. A stream
// that nobody reads, and a file that may not grow, are errors of writing from here on, not the end of the process.
void survive_streams_and_limits();

}  // namespace nscdd
