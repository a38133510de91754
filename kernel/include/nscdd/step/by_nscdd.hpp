// Steps solved by the paper's method, NSCDD, and by the sequential NLGS that it is compared with.
#pragma once

#include <algorithm>
#include <cmath>
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
        const double contacts = double(parts[0].problem.contact_count()), bytes = double(parts[0].sweeper.bytes()),
                     iterations = report.iterations, tests = std::ceil(iterations / options.check_every);
        // acceleration begins with the first test
        const double plain = options.window > 0 ? std::min(iterations, double(options.check_every)) : iterations;
        comm.charge(0, Work::sweep, (plain + iterations * (options.sweeps - 1)) * contacts, bytes);
        comm.charge(0, Work::accelerated, (iterations - plain) * contacts, bytes);
        comm.charge(0, Work::driven,
                    iterations * options.sweeps * double(parts[0].sweeper.driven_batches(Sweeper<M>::Pass::all)),
                    bytes);
        comm.charge(0, Work::residual, tests * contacts, bytes);
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
