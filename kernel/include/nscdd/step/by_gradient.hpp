/// @file
/// A step of a simulation on one rank, solved by projected gradients.
#pragma once

#include "nscdd/decompose/step_solver.hpp"
#include "nscdd/reference/projected_gradient.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Solves steps by projected gradients. The step throws std::logic_error on more than one rank, else the exceptions of
/// projected_gradient().
template <class M>
AnyStepSolver<M> by_gradient(const SolveOptions& options, Descent descent) {
    return counted_as_sweeps<M>("a projected gradient", [options, descent](ContactProblem<M>& problem) {
        return projected_gradient(problem, options, descent);
    });
}

}}  // namespace nscdd::NSCDD_ABI
