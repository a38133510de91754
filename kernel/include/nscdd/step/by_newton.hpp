// Steps solved to high accuracy, for reference answers: sequential, as by_nlgs().
#pragma once

#include "nscdd/solve/newton.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd::inline NSCDD_ABI {

// Needs a communicator of one rank. The report's iterations are Newton steps.
template <class M, class Factorisation = SparseLU>
StepSolver<M> by_newton(const NewtonOptions& options) {
    return [options](std::vector<Subdomain<M>>& parts, Communicator& comm, PhaseSeconds& seconds) -> SolveReport {
        if (comm.size() != 1) throw std::logic_error("the Newton methods run on one rank");
        Stopwatch watch(comm);
        const NewtonReport report = newton_solve<Factorisation>(parts[0].problem, options);
        comm.charge(0, Work::sweep, double(report.iterations) * double(parts[0].problem.contact_count()), 0);
        watch.lap(seconds.sweep);
        return report;
    };
}

}  // namespace nscdd
