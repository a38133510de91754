#include "model/solve_local.hpp"

#include "files/load.hpp"
#include "model/local_form.hpp"

namespace nscdd {

namespace {

template <int dim>
SolvedLocal solve(const LocalProblem& local, const std::string& solver, const BlockOptions& options,
                  const Eigen::VectorXd& start) {
    const DelassusProblem<dim> problem = to_blocks<dim>(local);
    LocalVectors<dim> r(problem.contact_count(), DelassusProblem<dim>::Vec::Zero());
    if (start.size() > 0) r = by_contact<dim>(start);
    const LocalTask<DelassusProblem<dim>> task{problem, r, options};
    SolvedLocal solved;
    const LoadMeter load;
    const double began = cpu_seconds();
    solved.report = make_offered<DelassusProblem<dim>, SolveReport>(local_solvers, solver, task);
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
    return problem.dim == 2 ? solve<2>(problem, solver, options, start) : solve<3>(problem, solver, options, start);
}

}  // namespace nscdd
