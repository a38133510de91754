// Ways to solve a contact problem in local form that `nscdd solve-fclib --solver` names, a line each.
#pragma once

#include "nscdd/reference/block_nlgs.hpp"
#include "nscdd/reference/newton.hpp"
#include "nscdd/reference/projected_gradient.hpp"
#include "registry/offered.hpp"
#include "registry/suitesparse.hpp"

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
        return natural_map_error(problem, impulses);
    }
    SolveReport descend(Descent descent) const {
        return projected_gradient(problem, r,
                                  {.tolerance = options.tolerance,
                                   .check_every = options.check_every,
                                   .max_iterations = options.max_iterations},
                                  descent, [this](const auto& now) { return measure(now); });
    }
};

inline constexpr std::tuple local_solvers{
    Offered{LocalSolverInfo{"nlgs", "Gauss-Seidel in the file's order, from zero", "sweeps", true},
            []<class P>(const LocalTask<P>& task) { return block_nlgs(task.problem, task.r, task.options); }},
    Offered{LocalSolverInfo{"newton", "slow and accurate", "Newton steps", false},
            []<WithoutCouples P>(const LocalTask<P>& task) -> SolveReport {
                return newton_solve<UmfPack>(task.problem, task.r, {.tolerance = task.options.tolerance},
                                             [&task](const auto& now) { return task.measure(now); });
            }},
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
