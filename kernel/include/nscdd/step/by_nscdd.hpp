/// @file
/// Steps solved by the paper's method, NSCDD, and by the sequential NLGS that it is compared with.
#pragma once

#include "nscdd/comm/in_process.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The sequential reference; the step throws std::logic_error on more than one rank.
template <class M>
AnyStepSolver<M> by_nlgs(const SolveOptions& options) {
    const auto charge = [options](Communicator& comm, const Subdomain<M>& part, const SolveReport& report) {
        const double contacts = double(part.problem.contact_count()), bytes = double(part.sweeper.bytes()),
                     driven = double(part.sweeper.driven_batches(SweepPass::all));
        // One iteration after the other, as NSCDD does: a machine that draws noise for each charge draws as often.
        for (int done = 1; done <= report.iterations; ++done) {
            // acceleration begins with the first test
            const bool accelerated = options.window > 0 && done > options.check_every;
            comm.charge(0, Work::sweep, (options.sweeps - (accelerated ? 1 : 0)) * contacts, bytes);
            comm.charge(0, Work::accelerated, accelerated ? contacts : 0, bytes);
            comm.charge(0, Work::driven, options.sweeps * driven, bytes);
            const bool tested = done % options.check_every == 0 || done == report.iterations;
            comm.charge(0, Work::residual, tested ? contacts : 0, bytes);
        }
    };
    return on_one_rank<M>(
        "sequential NLGS",
        [options](Subdomain<M>& part) {
            const auto by_newton = [&](ContactProblem<M>&, DistanceSums<M>& sums, const ResidualParts& residual) {
                if constexpr (SolvedOnCone<typename M::Law>) {
                    InProcess alone(1);
                    sums.add_up(part.problem, part.sweeper.kept(part.problem));
                    JoinedComponents<M> components({&part, 1}, alone, {&sums, 1});
                    return hand_over<M>({&part, 1}, alone, {&sums, 1}, components, residual, options);
                }
                return HandedOver{};
            };
            return nlgs_of_valid(part.problem, options, part.sweeper, by_newton);
        },
        charge);
}

/// Alg. 1 with Ccs, Dcs or another GluingScheme. Each solve makes its own, so that copies of the solver share nothing.
template <class Scheme, class M = typename detail::ModelOf<Scheme>::type>
AnyStepSolver<M> by_nscdd(const SolveOptions& options) {
    return [options](std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
        Scheme scheme;
        return nscdd_solve<M>(parts, comm, scheme, options, seconds);
    };
}

}}  // namespace nscdd::NSCDD_ABI
