/// @file
/// A step of a simulation on one rank, solved by Newton's methods.
#pragma once

#include "nscdd/decompose/step_solver.hpp"
#include "nscdd/reference/newton.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Solves steps by Newton's methods. The step throws std::logic_error on more than one rank, else the exceptions of
/// newton_solve().
template <class M, class Factorisation = detail::SparseLU>
AnyStepSolver<M> by_newton(const NewtonOptions& options) {
    return counted_as_sweeps<M>("Newton's method", [options](ContactProblem<M>& problem) {
        return newton_solve<Factorisation>(problem, options);
    });
}

}}  // namespace nscdd::NSCDD_ABI
