/// @file
/// Solvers to compare NLGS and NSCDD with. Newton's method also goes on where sweeps get nowhere.
#pragma once

#include "nscdd/decompose/hand_over.hpp"
#include "nscdd/nscdd.hpp"
#include "nscdd/reference/assemble.hpp"
#include "nscdd/reference/block_nlgs.hpp"
#include "nscdd/reference/newton.hpp"
#include "nscdd/reference/projected_gradient.hpp"
#include "nscdd/step/by_gradient.hpp"
#include "nscdd/step/by_newton.hpp"
