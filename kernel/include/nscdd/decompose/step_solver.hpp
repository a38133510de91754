/// @file
/// Solvers of the contact problem of a step: by_nlgs(), by_nscdd(), or your own (kernel/examples/own_solver.cpp).
#pragma once

#include <concepts>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>

#include "nscdd/decompose/phases.hpp"
#include "nscdd/iterate/options.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// `SolveReport solve(std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds)`
///
/// Collective; parts[k] is the subdomain of rank comm.ranks()[k]. A solver is called when the scene has a contact,
/// perhaps several times a step.
///
/// In, for each subdomain's `problem`: contacts, and bodies and driven walls with split masses (whole mass over
/// multiplicity). They have V_free + M_E^-1 H_E r [m/s], r the impulses of the warm start [N s].
///
/// Out: impulses of the contacts, and velocities that satisfy V = V_free + M^-1 H r. Velocities are the same in all
/// active copies of a body and of a driven wall on all ranks. Contacts, bodies and walls are those of before, in their
/// order.
///
/// The report is the same on every rank. Time goes to `seconds`, and work to comm.meter() where simulated machines are
/// to know of it.
template <class S, class M>
concept StepSolver = std::copy_constructible<S> &&
                     requires(S& solve, std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
                         { solve(std::move(parts), comm, seconds) } -> std::convertible_to<SolveReport>;
                     };

/// Holds any StepSolver.
template <class M>
using AnyStepSolver = std::function<SolveReport(std::span<Subdomain<M>>, Communicator&, PhaseSeconds&)>;

/// Makes a StepSolver of a solver of one problem, for scenes on one rank. solve(part, meter, watch, seconds) returns a
/// SolveReport. Time that it does not lap is that of sweeps.
template <class M>
AnyStepSolver<M> on_one_rank(const char* name, auto solve) {
    return [=](std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
        if (comm.size() != 1) throw std::logic_error(std::string(name) + " runs on one rank");
        Stopwatch watch(comm);
        const SolveReport report = solve(parts[0], comm.meter(), watch, seconds);
        watch.lap(seconds.sweep);
        return report;
    };
}

/// Makes a StepSolver of a solver whose iterations are counted as sweeps. solve(problem) returns a SolveReport.
template <class M>
AnyStepSolver<M> counted_as_sweeps(const char* name, auto solve) {
    return on_one_rank<M>(name, [=](Subdomain<M>& part, Meter& meter, const auto&...) -> SolveReport {
        const SolveReport report = solve(part.problem);
        meter.charge(0, Work::sweep, double(report.iterations) * double(part.problem.contact_count()), 0);
        return report;
    });
}

}}  // namespace nscdd::NSCDD_ABI
