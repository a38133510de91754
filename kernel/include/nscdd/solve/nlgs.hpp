// Nonlinear Gauss-Seidel, the sequential reference: matrix-free, contacts in the order given.
//
//   nscdd::SolveReport report = nscdd::nlgs(problem, {.tolerance = 1e-6});
#pragma once

#include "nscdd/core/validate.hpp"
#include "nscdd/solve/options.hpp"
#include "nscdd/solve/sweeper.hpp"

namespace nscdd::inline NSCDD_ABI {

// nlgs() of a problem that validate() has let pass, or that our own detection has filled.
template <class M>
SolveReport nlgs_of_valid(ContactProblem<M>& problem, const SolveOptions& options, Sweeper<M>& sweeper) {
    check_options(options);
    SolveReport report;
    ResidualParts residual;
    if (problem.contact_count() == 0) return report;
    prepare_contacts(problem, options.relaxation);
    sweeper.load(problem, options.relaxation);
    Anderson anderson(options.window);
    bool over = false;
    while (!over) {
        const bool accelerated = pays_to_accelerate(options, report, residual.contacts);
        if (accelerated) sweeper.accelerate(problem, options.window);
        const int count = until_test(options, report);
        for (int k = 0; k < count; ++k) {
            if (accelerated)
                anderson.update(sweeper.sweep(problem, anderson).data());
            else
                sweeper.sweep(problem);
            for (int s = 1; s < options.sweeps; ++s) sweeper.sweep(problem);
        }
        report.iterations += count;
        residual = sweeper.residual(problem);
        over = finished(residual, options, problem.least_radius, report);
        if (over && anderson.parted()) {
            sweeper.restore_velocities(problem);
            anderson.forget();
            residual = sweeper.residual(problem);
            over = finished(residual, options, problem.least_radius, report);
        }
    }
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
