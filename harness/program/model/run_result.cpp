#include "model/run_result.hpp"

#include <algorithm>

#include "files/over_ranks.hpp"

namespace nscdd {

int RunResult::unconverged_steps() const {
    return static_cast<int>(std::ranges::count_if(steps, [](const StepReport& s) { return !s.solve.converged; }));
}

double RunResult::iterations() const {
    double sum = 0;
    for (const StepReport& step : steps) sum += step.solve.iterations;
    return sum;
}

Rows RunResult::costs_of_processes() const {
    Rows processes{{}, costs.columns};
    for (auto row = costs.values.begin(); row != costs.values.end(); row += std::ptrdiff_t(costs.columns))
        if (row[cost_column::speaks] > 0)
            processes.values.insert(processes.values.end(), row, row + std::ptrdiff_t(costs.columns));
    return processes;
}

double RunResult::solver_cpu() const {
    const Rows processes = costs_of_processes();
    return processes.sum(cost_column::solver_cpu) / double(processes.count());
}

double RunResult::seconds() const {
    const Rows processes = costs_of_processes();
    return over_ranks(processes.values, processes.columns, cost_column::total)["largest"];
}

}  // namespace nscdd
