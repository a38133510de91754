/// @file
/// NLGS and NSCDD, and the steps of a scene. Three headers stand beside it: "nscdd/reference.hpp" for Newton's method
/// and projected gradients, "nscdd/comm/mpi.hpp" for MPI, "nscdd/partition/metis.hpp" for METIS. README.md has a first
/// program.
#pragma once

#include "nscdd/comm/in_process.hpp"
#include "nscdd/core/cohesive.hpp"
#include "nscdd/core/rolling.hpp"
#include "nscdd/core/validate.hpp"
#include "nscdd/decompose/ccs.hpp"
#include "nscdd/decompose/dcs.hpp"
#include "nscdd/partition/bisection.hpp"
#include "nscdd/step/by_nscdd.hpp"
#include "nscdd/step/gather.hpp"
#include "nscdd/step/measures.hpp"
#include "nscdd/step/observables.hpp"
#include "nscdd/step/simulation.hpp"
#include "nscdd/sweep/nlgs.hpp"
