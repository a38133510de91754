/// @file
/// Steps solved by the paper's method, NSCDD, and by the sequential NLGS that it is compared with.
#pragma once

#include "nscdd/comm/in_process.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The sequential reference; the step throws std::logic_error on more than one rank.
template <class M>
AnyStepSolver<M> by_nlgs(const SolveOptions& options) {
    return on_one_rank<M>(
        "sequential NLGS",
        [options](Subdomain<M>& part, Meter& meter) {
            const auto by_newton = [&](ContactProblem<M>&, DistanceSums<M>& sums, const ResidualParts& residual) {
                if constexpr (SolvedOnCone<typename M::Law>) {
                    InProcess alone(1);
                    sums.add_up(part.problem, part.sweeper.kept(part.problem));
                    JoinedComponents<M> components({&part, 1}, alone, {&sums, 1});
                    return hand_over<M>({&part, 1}, alone, {&sums, 1}, components, residual, options);
                }
                return HandedOver{};
            };
            return nlgs_of_valid(part.problem, options, part.sweeper, by_newton, &meter);
        });
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
