/// @file
/// Sequential NLGS: sweeps until the residual is small (METHOD.md, section 4). It is for readers; nlgs() of sweep/ is
/// the fast one.
#pragma once

#include "nscdd/iterate/report.hpp"
#include "nscdd/law/residual.hpp"
#include "nscdd/plain/sweep.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace plain {

/// Sweeps until eta is at most the tolerance, or after `most` iterations. In: V_free + M^-1 H r, and the r to start
/// from. Out: impulses and velocities.
template <class M>
SolveReport nlgs(ContactProblem<M>& problem, double tolerance, int most = 100'000) {
    SolveReport report;
    do {
        plain::sweep(problem);
        ++report.iterations;
        report.residual = residual_parts(problem).eta();
        report.converged = report.residual <= tolerance;
    } while (!report.converged && report.iterations < most);
    return report;
}

}}}  // namespace nscdd::NSCDD_ABI::plain
