// Steps solved by the paper's method, NSCDD, and by the sequential NLGS that it is compared with.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>

#include "nscdd/step/simulation.hpp"

namespace nscdd::inline NSCDD_ABI {

// The sequential reference; the step throws std::logic_error on more than one rank.
template <class M>
AnyStepSolver<M> by_nlgs(const SolveOptions& options) {
    const auto charge = [options](Communicator& comm, const Subdomain<M>& part, const SolveReport& report) {
        const double contacts = double(part.problem.contact_count()), bytes = double(part.sweeper.bytes()),
                     iterations = report.iterations, tests = std::ceil(iterations / options.check_every);
        // acceleration begins with the first test
        const double plain = options.window > 0 ? std::min(iterations, double(options.check_every)) : iterations;
        comm.charge(0, Work::sweep, (plain + iterations * (options.sweeps - 1)) * contacts, bytes);
        comm.charge(0, Work::accelerated, (iterations - plain) * contacts, bytes);
        comm.charge(0, Work::driven,
                    iterations * options.sweeps * double(part.sweeper.driven_batches(Sweeper<M>::Pass::all)), bytes);
        comm.charge(0, Work::residual, tests * contacts, bytes);
    };
    return on_one_rank<M>(
        "sequential NLGS", [options](Subdomain<M>& part) { return nlgs_of_valid(part.problem, options, part.sweeper); },
        charge);
}

// Alg. 1 with a scheme of its own: Ccs, Dcs or another GluingScheme.
template <class Scheme, class M = typename detail::ModelOf<Scheme>::type>
AnyStepSolver<M> by_nscdd(const SolveOptions& options) {
    return [scheme = std::make_shared<Scheme>(), options](std::span<Subdomain<M>> parts, Communicator& comm,
                                                          PhaseSeconds& seconds) {
        return nscdd_solve<M>(parts, comm, *scheme, options, seconds);
    };
}

}  // namespace nscdd
