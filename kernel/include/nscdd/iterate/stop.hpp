/// @file
/// The decision whether an iteration may stop: its figures against their bounds.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nscdd/iterate/options.hpp"
#include "nscdd/law/distance.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Number of iterations to the next test of convergence: the last may come sooner, so that the cap is kept.
template <class Options>
int until_test(const Options& options, const SolveReport& report, int interval) {
    return (std::max)(1, (std::min)(interval, options.max_iterations - report.iterations));
}

/// Calls iterate() until measure() is at most the tolerance or the cap is reached, and tests it as the options say.
/// Throws std::runtime_error when the measure is not finite.
template <class Options>
SolveReport iterate_until(const Options& options, auto&& iterate, auto&& measure) {
    SolveReport report;
    do {
        const int count = until_test(options, report, options.interval());
        for (int k = 0; k < count; ++k) iterate();
        report.iterations += count;
        report.residual = measure();
        if (!std::isfinite(report.residual)) throw std::runtime_error("the residual is not finite: check W and q");
        report.converged = report.residual <= options.tolerance;
    } while (!report.converged && report.iterations < options.max_iterations);
    return report;
}

/// True from the first test at which iterations (counted as ten at least) times contacts is at least 360. Shorter steps
/// do not pay for the set-up, measured to cost about 360 solved contacts.
inline bool pays_to_accelerate(const SolveOptions& options, const SolveReport& report, double contacts) {
    return options.window > 0 && report.iterations > 0 && (std::max)(report.iterations, 10) * contacts >= 360;
}

/// Whether the step would close a contact farther than the options allow. Never without a least radius.
inline bool too_deep(const SolveReport& report, const SolveOptions& options, double least_radius) {
    return least_radius > 0 && report.penetration > options.bounds.max_penetration * least_radius;
}

/// A figure over its bound. Without a least radius the penetration counts as none.
inline double over_bound(const BoundOption& bound, const SolveReport& report, const SolveOptions& options,
                         double least_radius) {
    const double limit = options.bounds.*bound.limit, figure = report.*bound.figure;
    if (bound.limit != &SolveOptions::Bounds::max_penetration) return figure / limit;
    return least_radius > 0 ? figure / (limit * least_radius) : 0;
}

/// Whether the bounds of the residual are kept, or with `estimated` those of the estimate too.
inline bool keeps_bounds(const SolveReport& report, const SolveOptions& options, double least_radius, bool estimated) {
    return std::ranges::all_of(bound_options, [&](const BoundOption& bound) {
        if (bound.estimated && !estimated) return true;
        if (bound.limit == &SolveOptions::Bounds::max_penetration) return !too_deep(report, options, least_radius);
        return report.*bound.figure <= options.bounds.*bound.limit;
    });
}

/// The largest figure of the residual over its bound; 1 or less where all bounds of it are kept.
inline double residual_over_bounds(const SolveReport& report, const SolveOptions& options, double least_radius) {
    double worst = report.residual / options.tolerance;
    for (const BoundOption& bound : bound_options)
        if (!bound.estimated) worst = (std::max)(worst, over_bound(bound, report, options, least_radius));
    return worst;
}

/// How far the iterate is from being converged: as residual_over_bounds(), and of the estimate where it was asked for.
inline double error_over_bounds(const SolveReport& report, const SolveOptions& options, double least_radius) {
    double worst = residual_over_bounds(report, options, least_radius);
    if (worst > 1) return worst;
    for (const BoundOption& bound : bound_options)
        if (bound.estimated) worst = (std::max)(worst, over_bound(bound, report, options, least_radius));
    return worst;
}

/// Writes the residual into the report; true when its bounds are kept, and those of the estimate are left to ask
/// (report_distance()). least_radius: of the scene [m], 0 where it is not known. Throws std::runtime_error when eta is
/// not finite.
inline bool report_residual(const ResidualParts& parts, const SolveOptions& options, double least_radius,
                            SolveReport& report) {
    report.residual = parts.eta();
    report.velocity_error = parts.velocity_error();
    report.energy_gain = parts.energy_gain();
    report.velocity_change_norm = std::sqrt(parts.velocity_change.energy);
    report.penetration = parts.penetration;
    report.converged = false;
    if (!std::isfinite(report.residual))
        throw std::runtime_error("the residual is not finite: check masses and velocities");
    return options.tolerance > 0 && report.residual <= options.tolerance &&
           keeps_bounds(report, options, least_radius, false);
}

/// Writes the estimate into the report. near: report_residual() was true.
inline void report_distance(const DistanceEstimate& estimate, const SolveOptions& options, double least_radius,
                            bool near, SolveReport& report) {
    report.energy_gain = (std::max)(report.energy_gain, estimate.energy_gain);
    report.gap_error = estimate.gap_error;
    report.distance = estimate.worst;
    report.scene_distance = estimate.scene;
    report.converged = near && keeps_bounds(report, options, least_radius, true);
}

}}}  // namespace nscdd::NSCDD_ABI::detail
