/// @file
/// A step of a simulation on one rank, solved by Newton's methods.
#pragma once

#include "nscdd/decompose/step_solver.hpp"
#include "nscdd/reference/newton.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The step throws std::logic_error on more than one rank, else what newton_solve() throws.
template <class M, class Factorisation = SparseLU>
AnyStepSolver<M> by_newton(const NewtonOptions& options) {
    return counted_as_sweeps<M>("Newton's method", [options](ContactProblem<M>& problem) {
        return newton_solve<Factorisation>(problem, options);
    });
}

}}  // namespace nscdd::NSCDD_ABI
