// Steps solved by the paper's method, NSCDD, and by the sequential NLGS that it is compared with.
#pragma once

#include <memory>

#include "nscdd/step/simulation.hpp"

namespace nscdd::inline NSCDD_ABI {

// The sequential reference: needs a communicator of one rank.
template <class M>
StepSolver<M> by_nlgs(const SolveOptions& options) {
    return [options](std::vector<Subdomain<M>>& parts, Communicator& comm, PhaseSeconds& seconds) {
        if (comm.size() != 1) throw std::logic_error("sequential NLGS runs on one rank");
        Stopwatch watch(comm);
        const SolveReport report = nlgs_of_valid(parts[0].problem, options, parts[0].sweeper);
        comm.charge(0, double(report.iterations) * options.sweeps * double(parts[0].problem.contact_count()));
        watch.lap(seconds.sweep);
        return report;
    };
}

// Alg. 1 with a scheme of its own, Ccs or Dcs.
template <class Scheme, class M = typename Scheme::Model>
StepSolver<M> by_nscdd(const SolveOptions& options) {
    return [scheme = std::make_shared<Scheme>(), options](std::vector<Subdomain<M>>& parts, Communicator& comm,
                                                          PhaseSeconds& seconds) {
        return nscdd_solve<M>(parts, comm, *scheme, options, seconds);
    };
}

}  // namespace nscdd
