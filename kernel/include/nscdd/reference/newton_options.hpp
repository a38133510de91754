#pragma once

#include <algorithm>

#include "nscdd/iterate/options.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Options of the Newton methods: when they stop.
struct NewtonOptions {
    double tolerance = 1e-10;       ///< on eta, or on the measure given
    SolveOptions::Bounds bounds{};  ///< as in SolveOptions; bodies only
    int max_iterations = 2000;      ///< Newton steps in all
    int max_interior = 100;         ///< of them by the interior-point method
    int warm_sweeps = 1000;  ///< sweeps of NLGS before, at most; bodies only. They cost as much as a factorisation
    int max_outer = 200;     ///< proximal iterations
};

namespace detail {

/// Throws std::invalid_argument for options that are no numbers, or negative.
inline void check_options(const NewtonOptions& options) {
    check_options(SolveOptions{.tolerance = options.tolerance, .bounds = options.bounds});
    if ((std::min)({options.max_iterations, options.max_interior, options.warm_sweeps, options.max_outer}) < 0)
        throw std::invalid_argument("the limits of the Newton methods must not be negative");
}

}  // namespace detail

/// End of newton_solve(). Its iterations are Newton steps, of both methods.
struct NewtonReport : SolveReport {
    int interior = 0;        ///< Newton steps by the interior-point method
    int outer = 0;           ///< proximal iterations
    int factorisations = 0;  ///< of sparse Jacobians, by both methods
};

}}  // namespace nscdd::NSCDD_ABI
