// `nscdd run`: one scene, stepped by NLGS, Newton or NSCDD, with its results as JSON and HDF5.
#pragma once

#include <vector>

#include "model/run_request.hpp"

namespace nscdd {

// Reads what the arguments name, of packing and state the share of this MPI rank. Throws InputError for what cannot be
// run, each rank what it finds.
RunRequest prepare_run(const RunArguments& arguments, const Provenance& provenance, Share share, bool over_mpi);

// The files that a run reads.
std::vector<NamedFile> inputs_of(const RunArguments& arguments, const Scene& scene);

class Session;
// The subcommand: reads, runs, writes. Returns the exit code.
int run(const RunArguments& arguments, const Provenance& provenance, const Session& session);

}  // namespace nscdd
