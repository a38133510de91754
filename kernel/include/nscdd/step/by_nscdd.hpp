/// @file
/// Steps solved by the paper's method, NSCDD, and by the sequential NLGS that it is compared with.
#pragma once

#include "nscdd/comm/in_process.hpp"
#include "nscdd/decompose/nscdd_solve.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// What is outside of a solve by NLGS (NothingElse): another method, and the clock of the step.
template <class M>
struct OutsideOfNlgs {
    Subdomain<M>& part;
    const SolveOptions& options;
    HandOver<M> hand_over;
    Stopwatch& watch;
    PhaseSeconds& seconds;

    HandedOver operator()(ContactProblem<M>&, DistanceSums<M>& sums, const ResidualParts& residual) const {
        if (!hand_over) return {};
        InProcess alone(1);
        sums.add_up(part.problem, part.sweeper.kept(part.problem));
        JoinedComponents<M> components({&part, 1}, alone, {&sums, 1});
        return hand_over({&part, 1}, alone, {&sums, 1}, components, residual, options);
    }
    void loaded() const { watch.lap(seconds.load); }
    void swept() const { watch.lap(seconds.sweep); }
    void tested() const { watch.lap(seconds.test); }
};

}  // namespace detail

/// Solves steps by the sequential reference. The step throws std::logic_error on more than one rank. `hand_over` solves
/// the components on which sweeps get nowhere: newton_where_stalled<M>() of hand_over.hpp.
template <class M>
AnyStepSolver<M> by_nlgs(const SolveOptions& options, detail::HandOver<M> hand_over = nullptr) {
    detail::check_hand_over<M>(options, hand_over);
    return on_one_rank<M>("sequential NLGS",
                          [=](Subdomain<M>& part, Meter& meter, Stopwatch& watch, PhaseSeconds& seconds) {
                              const detail::OutsideOfNlgs<M> outside{part, options, hand_over, watch, seconds};
                              return detail::nlgs_of_valid(part.problem, options, part.sweeper, outside, &meter);
                          });
}

/// Solves steps by Alg. 1 with Ccs, Dcs or another GluingScheme. Each solve makes its own, so copies of the solver
/// share nothing. `hand_over` is as in by_nlgs().
template <class Scheme, class M = typename detail::ModelOf<Scheme>::type>
AnyStepSolver<M> by_nscdd(const SolveOptions& options, detail::HandOver<M> hand_over = nullptr) {
    detail::check_hand_over<M>(options, hand_over);
    return [=](std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
        Scheme scheme;
        return nscdd_solve<M>(parts, comm, scheme, options, seconds, hand_over);
    };
}

}}  // namespace nscdd::NSCDD_ABI
