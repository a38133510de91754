// `nscdd run`: one scene, stepped by NLGS, Newton or NSCDD, with its results as JSON and HDF5.
#pragma once

#include "model/prepare_run.hpp"

namespace nscdd {

class Session;
// The subcommand: reads, runs, writes. Returns the exit code.
int run(const RunArguments& arguments, const Provenance& provenance, const Session& session);

}  // namespace nscdd
