// The outer loop that NLGS and NSCDD share: iterations, acceleration, and the test of convergence.
#pragma once

#include <concepts>

#include "nscdd/iterate/anderson.hpp"
#include "nscdd/iterate/options.hpp"

namespace nscdd::inline NSCDD_ABI {

// What iterates: sweeps over the contacts of one problem (nlgs.hpp), or over those of all subdomains and then gluing
// (nscdd_solve.hpp).
//   iterate(a, tested)     one iteration; tested: a test follows it. Accelerated by *a unless that is null, and then
//                          returns the products that *a asks for, summed over all contacts
//   residual()             of the whole scene
//   restore_velocities()   V = V_free + M^-1 H r of the impulses held
//   least_radius()         of the scene [m], 0: unknown
template <class S>
concept Iterated = requires(S& system, const Anderson* anderson) {
    { system.iterate(anderson, true) } -> std::convertible_to<const double*>;
    { system.residual() } -> std::same_as<ResidualParts>;
    system.restore_velocities();
    { system.least_radius() } -> std::convertible_to<double>;
};

// Iterates until the step has converged (SolveReport) or the cap is reached.
template <Iterated System>
SolveReport iterate(System& system, const SolveOptions& options) {
    SolveReport report;
    ResidualParts residual;
    Anderson anderson(options.window);
    for (bool over = false; !over;) {
        const bool accelerated = pays_to_accelerate(options, report, residual.contacts);
        const int count = until_test(options, report);
        for (int k = 0; k < count; ++k) {
            const double* products = system.iterate(accelerated ? &anderson : nullptr, k + 1 == count);
            if (accelerated) anderson.update(products);
        }
        report.iterations += count;
        residual = system.residual();
        over = report_residual(residual, options, system.least_radius(), report);
        if (!over || !anderson.velocities_stale()) continue;
        system.restore_velocities();
        anderson.forget();
        residual = system.residual();
        over = report_residual(residual, options, system.least_radius(), report);
    }
    return report;
}

}  // namespace nscdd
