// A contact problem of any code, solved by the name of a solver.
#pragma once

#include <span>
#include <string>

#include "files/fclib.hpp"
#include "nscdd/law/error_measures.hpp"
#include "nscdd/reference/block_nlgs.hpp"
#include "registry/local_solvers.hpp"

namespace nscdd {

struct SolvedLocal {
    FclibSolution solution;  // without velocities of bodies
    SolveReport report;      // its residual is the larger of both natural maps
    ErrorMeasures measures;
    std::size_t blocks = 0;    // of W that are stored
    double cpu = 0;            // of the solver [s]
    std::vector<double> load;  // LoadMeter::row() of the solver's time
};

// In the order of local_solvers.
std::span<const LocalSolverInfo> offered_local_solvers();

// u = W r + q from the impulses `start` (n size), empty for none, by a solver of local_solvers. Throws
// std::runtime_error for a contact that cannot move along its normal, and what the solver throws; InputError where the
// solver does not know rolling resistance.
SolvedLocal solve_local(const LocalProblem& problem, const std::string& solver, const BlockOptions& options,
                        const Eigen::VectorXd& start = {});

}  // namespace nscdd
