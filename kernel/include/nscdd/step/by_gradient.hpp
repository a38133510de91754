// Steps solved by projected gradients, for comparison: sequential, as by_nlgs().
#pragma once

#include "nscdd/solve/projected_gradient.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd::inline NSCDD_ABI {

// Needs a communicator of one rank.
template <class M>
StepSolver<M> by_gradient(const SolveOptions& options, Descent descent) {
    return [options, descent](std::vector<Subdomain<M>>& parts, Communicator& comm, PhaseSeconds& seconds) {
        if (comm.size() != 1) throw std::logic_error("projected gradients run on one rank");
        Stopwatch watch(comm);
        const SolveReport report = projected_gradient(parts[0].problem, options, descent);
        comm.charge(0, Work::sweep, double(report.iterations) * double(parts[0].problem.contact_count()), 0);
        watch.lap(seconds.sweep);
        return report;
    };
}

}  // namespace nscdd
