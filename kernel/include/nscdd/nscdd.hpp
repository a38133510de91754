/// @file
/// The whole kernel but MPI and METIS (add "nscdd/comm/mpi.hpp", "nscdd/partition/metis.hpp" for these). See README.md
/// for a first program.
#pragma once

#include "nscdd/comm/in_process.hpp"
#include "nscdd/core/validate.hpp"
#include "nscdd/decompose/ccs.hpp"
#include "nscdd/decompose/dcs.hpp"
#include "nscdd/partition/bisection.hpp"
#include "nscdd/reference/assemble.hpp"
#include "nscdd/reference/block_nlgs.hpp"
#include "nscdd/reference/newton.hpp"
#include "nscdd/reference/projected_gradient.hpp"
#include "nscdd/step/by_gradient.hpp"
#include "nscdd/step/by_newton.hpp"
#include "nscdd/step/by_nscdd.hpp"
#include "nscdd/step/gather.hpp"
#include "nscdd/step/measures.hpp"
#include "nscdd/step/observables.hpp"
#include "nscdd/step/simulation.hpp"
#include "nscdd/sweep/nlgs.hpp"
