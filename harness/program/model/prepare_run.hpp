// From what a run is asked to do to what it starts from.
#pragma once

#include <vector>

#include "model/run_request.hpp"

namespace nscdd {

// Reads what the arguments name, of packing and state the share of this MPI rank. Throws InputError for what cannot be
// run, each rank what it finds.
RunRequest prepare_run(const RunArguments& arguments, const Provenance& provenance, Share share, bool over_mpi);

// The same of a scene in memory. It starts from the packing, of which this process has its share and which may have no
// box, or from the state that the arguments name.
RunRequest prepare_run(const RunArguments& arguments, Scene scene, Packing packing, Share share = {},
                       bool over_mpi = false);

// The files that a run reads.
std::vector<NamedFile> inputs_of(const RunArguments& arguments, const Scene& scene);

}  // namespace nscdd
