#include "model/solve_local.hpp"

#include "files/load.hpp"
#include "model/local_form.hpp"

namespace nscdd {

namespace {

template <int dim, bool rolls>
SolvedLocal solve(const LocalProblem& local, const std::string& solver, const BlockOptions& options,
                  const Eigen::VectorXd& start) {
    using Problem = DelassusProblem<dim, rolls>;
    const Problem problem = to_blocks<dim, rolls>(local);
    LocalVectors<dim, rolls> r(problem.contact_count(), Problem::Vec::Zero());
    if (start.size() > 0) r = by_contact<typename Problem::Vec>(start);
    const LocalTask<Problem> task{problem, r, options};
    SolvedLocal solved;
    const LoadMeter load;
    const double began = cpu_seconds();
    solved.report = make_offered<Problem, SolveReport>(local_solvers, solver, task);
    solved.cpu = cpu_seconds() - began;
    solved.load = load.row();
    solved.measures = error_measures(problem, r);
    solved.solution = to_solution(problem, r, solved.measures, solver);
    solved.blocks = problem.blocks.size();
    return solved;
}

}  // namespace

std::span<const LocalSolverInfo> offered_local_solvers() {
    static const std::vector<LocalSolverInfo> infos = infos_of<LocalSolverInfo>(local_solvers);
    return infos;
}

SolvedLocal solve_local(const LocalProblem& problem, const std::string& solver, const BlockOptions& options,
                        const Eigen::VectorXd& start) {
    if (problem.rolls())
        return problem.dim == 2 ? solve<2, true>(problem, solver, options, start)
                                : solve<3, true>(problem, solver, options, start);
    return problem.dim == 2 ? solve<2, false>(problem, solver, options, start)
                            : solve<3, false>(problem, solver, options, start);
}

}  // namespace nscdd
