// Ways to solve a contact problem in local form that `nscdd solve-fclib --solver` names, a line each.
#pragma once

#include <algorithm>
#include <limits>

#include "nscdd/reference/block_nlgs.hpp"
#include "nscdd/reference/newton.hpp"
#include "nscdd/reference/projected_gradient.hpp"
#include "registry/factors.hpp"
#include "registry/offered.hpp"

namespace nscdd {

struct LocalSolverInfo {
    const char* name;
    const char* help;        // of --solver
    const char* iterations;  // what a message calls them
    bool capped;             // takes --max-sweeps and --check-every
};

// What methods on Coulomb's cone solve.
template <class Problem>
concept WithoutCouples = !Problem::rolls;

template <class Problem>
struct LocalTask {
    const Problem& problem;
    std::vector<typename Problem::Vec>& r;  // in: where to start; out: the answer
    BlockOptions options;

    double measure(const std::vector<typename Problem::Vec>& impulses) const {
        return detail::stopping_error(problem, impulses);
    }
    SolveReport descend(Descent descent) const {
        return projected_gradient(problem, r,
                                  {.tolerance = options.tolerance,
                                   .check_every = options.check_every,
                                   .max_iterations = options.max_iterations},
                                  descent, [this](const auto& now) { return measure(now); });
    }
    NewtonReport newton(int cap = NewtonOptions().max_iterations) const
        requires WithoutCouples<Problem>
    {
        return newton_solve<NewtonFactors>(problem, r, {.tolerance = options.tolerance, .max_iterations = cap},
                                           [this](const auto& now) { return measure(now); });
    }
    // Accelerated sweeps, until two doublings of them have not halved the error. Then Newton's method from there, and
    // from no impulses where that does not help; then sweeps go on from the best answer. Its steps are counted with the
    // sweeps, and each time it may make more of them. A test follows each doubling: few sweeps do for an easy problem.
    SolveReport sweep_or_newton() const {
        constexpr int least = 1000;  // sweeps before Newton's method, of which a few steps cost as much
        SolveReport report;
        int stalled = 0, cap = 100;
        double last = std::numeric_limits<double>::infinity();
        BlockOptions some = options;
        some.window = 2;  // the fewest sweeps (reports/findings/other-codes.md)
        for (;; last = report.residual) {
            some.max_iterations = std::min(std::max(1, report.iterations), options.max_iterations - report.iterations);
            const int before = report.iterations;
            report = block_nlgs(problem, r, some);
            report.iterations += before;
            if (report.converged || report.iterations >= options.max_iterations) return report;
            if constexpr (WithoutCouples<Problem>) {
                stalled = report.residual <= 0.5 * last ? 0 : stalled + 1;
                if (report.iterations < least || stalled < 2) continue;
                const double before_newton = report.residual;
                auto best = r;
                for (const bool anew : {false, true}) {
                    if (anew && report.residual <= 0.1 * before_newton) break;
                    if (anew) std::ranges::fill(r, Problem::Vec::Zero());
                    const NewtonReport by_newton = newton(cap);
                    report.iterations += by_newton.iterations;
                    if (by_newton.residual < report.residual) {
                        report.residual = by_newton.residual, report.converged = by_newton.converged;
                        best = r;
                    }
                    if (report.converged || report.iterations >= options.max_iterations) break;
                }
                r = best;
                cap = std::min(4 * cap, NewtonOptions().max_iterations);
                if (report.converged || report.iterations >= options.max_iterations) return report;
            }
        }
    }
};

inline constexpr std::tuple local_solvers{
    Offered{LocalSolverInfo{"auto", "sweeps of nlgs, accelerated, then newton where they get nowhere",
                            "sweeps and Newton steps", true},
            []<class P>(const LocalTask<P>& task) { return task.sweep_or_newton(); }},
    Offered{LocalSolverInfo{"nlgs", "Gauss-Seidel in the file's order, from zero", "sweeps", true},
            []<class P>(const LocalTask<P>& task) { return block_nlgs(task.problem, task.r, task.options); }},
    Offered{LocalSolverInfo{"newton", "slow and accurate", "Newton steps", false},
            []<WithoutCouples P>(const LocalTask<P>& task) -> SolveReport { return task.newton(); }},
    Offered{LocalSolverInfo{"spg", "spectral projected gradient", "iterations", true},
            []<WithoutCouples P>(const LocalTask<P>& task) { return task.descend(Descent::spectral); }},
    Offered{LocalSolverInfo{"apgd", "accelerated projected gradient", "iterations", true},
            []<WithoutCouples P>(const LocalTask<P>& task) { return task.descend(Descent::nesterov); }},
    Offered{LocalSolverInfo{"none", "judge the file's own /solution", "iterations", false},
            []<class P>(const LocalTask<P>& task) {
                SolveReport report;
                report.residual = task.measure(task.r);
                report.converged = report.residual <= task.options.tolerance;
                return report;
            }},
};

}  // namespace nscdd
