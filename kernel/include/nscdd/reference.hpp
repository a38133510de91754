/// @file
/// The solvers that NLGS and NSCDD are compared with, and Newton's method where these get nowhere.
#pragma once

#include "nscdd/decompose/hand_over.hpp"
#include "nscdd/nscdd.hpp"
#include "nscdd/reference/assemble.hpp"
#include "nscdd/reference/block_nlgs.hpp"
#include "nscdd/reference/newton.hpp"
#include "nscdd/reference/projected_gradient.hpp"
#include "nscdd/step/by_gradient.hpp"
#include "nscdd/step/by_newton.hpp"
