// Nonlinear Gauss-Seidel, the sequential reference: matrix-free, contacts in the order given.
//
//   nscdd::SolveReport report = nscdd::nlgs(problem, {.tolerance = 1e-6});
#pragma once

#include "nscdd/core/validate.hpp"
#include "nscdd/iterate/iteration.hpp"
#include "nscdd/sweep/sweeper.hpp"

namespace nscdd::inline NSCDD_ABI {

namespace detail {

template <class M>
struct SweptAlone {
    ContactProblem<M>& problem;
    const SolveOptions& options;
    Sweeper<M>& sweeper;
    Anderson::Products products{};

    const double* iterate(const Anderson* anderson, bool /*tested*/) {
        if (anderson) {
            sweeper.accelerate(problem, options.window);
            products = {};
            sweeper.sweep(problem, *anderson, products);
        } else {
            sweeper.sweep(problem);
        }
        for (int s = 1; s < options.sweeps; ++s) sweeper.sweep(problem);
        return products.data();
    }
    ResidualParts residual() const { return sweeper.residual(problem); }
    void restore_velocities() { sweeper.restore_velocities(problem); }
    double least_radius() const { return problem.least_radius; }
};

}  // namespace detail

// nlgs() of a problem that validate() has let pass, or that our own detection has filled.
template <class M>
SolveReport nlgs_of_valid(ContactProblem<M>& problem, const SolveOptions& options, Sweeper<M>& sweeper) {
    check_options(options);
    if (problem.contact_count() == 0) return {};
    sweeper.load(problem, options.relaxation);
    detail::SweptAlone<M> system{problem, options, sweeper};
    const SolveReport report = iterate(system, options);
    sweeper.store(problem);
    return report;
}

// Sweeps until the step has converged (SolveReport) or the cap is reached. In: velocities consistent with the impulses.
// `sweeper` only saves its memory for the next call. Throws std::invalid_argument for a problem that is none
// (validate.hpp) and for options with which it would not end, std::runtime_error when numbers grow beyond what is
// finite.
template <class M>
SolveReport nlgs(ContactProblem<M>& problem, const SolveOptions& options, Sweeper<M>& sweeper) {
    validate(problem);
    return nlgs_of_valid(problem, options, sweeper);
}

template <class M>
SolveReport nlgs(ContactProblem<M>& problem, const SolveOptions& options) {
    Sweeper<M> sweeper;
    return nlgs(problem, options, sweeper);
}

}  // namespace nscdd
