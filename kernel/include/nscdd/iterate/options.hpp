/// @file
/// When an iteration stops, and how it ended.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "nscdd/iterate/anderson.hpp"
#include "nscdd/law/distance.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// When NLGS or NSCDD stops, and how it iterates. The bounds: METHOD.md, section 5.6.
struct SolveOptions {
    double tolerance = 1e-4;  ///< on eta, ResidualParts::eta(); 0: all iterations are made, also where eta is 0
    /// On ResidualParts::velocity_error(): eta does not see wrong velocities where masses differ or columns are long.
    double velocity_error = 0.1;
    double energy_made = 1e-3;   ///< on ResidualParts::energy_made()
    double penetration = 1e-3;   ///< on the penetration of the step over the least radius, where the problem has one
    double gap_error = 1e-3;     ///< on DistanceEstimate::gap_error, where the problem has radii
    double distance = 0.3;       ///< on DistanceEstimate::worst
    int check_every = 10;        ///< iterations between two tests
    int max_iterations = 20000;  ///< cap; one is made at least. A solve that it ends is reported as not converged
    int sweeps = 1;              ///< n_GS of Alg. 1: sweeps between two gluings
    double relaxation = 1;       ///< omega: a contact goes by 1/W times it; 0 to 2
    /// Largest component [contacts] that Newton's method solves where sweeps get nowhere, by_nlgs() and by_nscdd(); 0:
    /// none
    int newton_contacts = 0;
    int window = 0;  ///< of Anderson acceleration: earlier iterates to combine; 0 is the paper's own method

    /// These options with the window that was found to need the fewest iterations (METHOD.md, section 8).
    SolveOptions accelerated() const {
        SolveOptions options = *this;
        options.window = 2;
        return options;
    }
};

/// Converged: every bound of the options is kept. Without a least radius the penetration is not tested but only
/// reported, for the caller to judge; without radii there is no gap error.
struct SolveReport {
    int iterations = 0;               ///< made, each of SolveOptions::sweeps sweeps
    double residual = 0;              ///< eta
    double velocity_error = 0;        ///< ResidualParts::velocity_error()
    double energy_made = 0;           ///< of the scene, or of the component where it is larger
    double velocity_change_norm = 0;  ///< |V - V_free|_M, what the contacts changed [J^1/2]
    double penetration = 0;           ///< deepest that the step would close a contact [m]
    double gap_error = 0;             ///< DistanceEstimate::gap_error
    double distance = 0;              ///< DistanceEstimate::worst, of the worst component
    double scene_distance = 0;        ///< DistanceEstimate::scene, of all components together
    double newton_contacts = 0;       ///< contacts in components that Newton's method solved, as sweeps got nowhere
    double rebounds_given_up = 0;     ///< of them those without a rebound, as none was found with it
    bool converged = true;            ///< all tests are passed
};

/// What an iteration has handed over to Newton's method.
struct HandedOver {
    double contacts = 0;           ///< in components that it has solved
    double rebounds_given_up = 0;  ///< of them those without a rebound, as no answer was found with it
    auto summed() { return std::tie(contacts, rebounds_given_up); }  ///< what reduce() adds up
    auto largest() { return std::tie(); }                            ///< reduce() takes the largest of no member
};

/// Throws std::invalid_argument unless the bounds of SolveOptions, or of NewtonOptions, are numbers and not negative.
inline void check_bounds(const auto& options) {
    for (const double bound : {options.tolerance, options.velocity_error, options.energy_made, options.penetration,
                               options.gap_error, options.distance})
        if (!(bound >= 0))
            throw std::invalid_argument(
                "tolerance, velocity_error, energy_made, penetration, gap_error and distance must be numbers and not "
                "negative");
}

/// Throws std::invalid_argument for options with which no solver ends.
inline void check_options(const SolveOptions& options) {
    const double omega = options.relaxation;
    check_bounds(options);
    if (options.newton_contacts < 0) throw std::invalid_argument("newton_contacts must not be negative");
    if (options.max_iterations < 0) throw std::invalid_argument("max_iterations must not be negative");
    if (options.check_every < 1 || options.sweeps < 1)
        throw std::invalid_argument("check_every and sweeps must be at least 1");
    if (!(omega > 0 && omega < 2)) throw std::invalid_argument("the relaxation must be between 0 and 2");
    if (options.window < 0 || options.window > Anderson::largest_window)
        throw std::invalid_argument("the window must be within 0 and " + std::to_string(Anderson::largest_window));
}

/// Number of iterations to the next test of convergence: the last may come sooner, so that the cap is kept.
template <class Options>
int until_test(const Options& options, const SolveReport& report) {
    return (std::max)(1, (std::min)(options.check_every, options.max_iterations - report.iterations));
}

/// Calls iterate() until measure() is at most the tolerance or the cap is reached, and tests it as the options say.
/// Throws std::runtime_error when the measure is not finite.
template <class Options>
SolveReport iterate_until(const Options& options, auto&& iterate, auto&& measure) {
    SolveReport report;
    do {
        const int count = until_test(options, report);
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
    return least_radius > 0 && report.penetration > options.penetration * least_radius;
}

/// The largest figure of the residual over its bound; 1 or less where all bounds of it are kept.
inline double residual_over_bounds(const SolveReport& report, const SolveOptions& options, double least_radius) {
    double worst = (std::max)({report.residual / options.tolerance, report.velocity_error / options.velocity_error,
                               report.energy_made / options.energy_made});
    if (least_radius > 0) worst = (std::max)(worst, report.penetration / (options.penetration * least_radius));
    return worst;
}

/// How far the iterate is from being converged: as residual_over_bounds(), and of the estimate where it was asked for.
inline double error_over_bounds(const SolveReport& report, const SolveOptions& options, double least_radius) {
    const double worst = residual_over_bounds(report, options, least_radius);
    return worst > 1 ? worst
                     : (std::max)({worst, report.gap_error / options.gap_error, report.distance / options.distance});
}

/// Writes the residual into the report; true when its bounds are kept, and those of the estimate are left to ask
/// (report_distance()). least_radius: of the scene [m], 0 where it is not known. Throws std::runtime_error when eta is
/// not finite.
inline bool report_residual(const ResidualParts& parts, const SolveOptions& options, double least_radius,
                            SolveReport& report) {
    report.residual = parts.eta();
    report.velocity_error = parts.velocity_error();
    report.energy_made = parts.energy_made();
    report.velocity_change_norm = std::sqrt(parts.velocity_change.energy);
    report.penetration = parts.penetration;
    report.converged = false;
    if (!std::isfinite(report.residual))
        throw std::runtime_error("the residual is not finite: check masses and velocities");
    return options.tolerance > 0 && report.residual <= options.tolerance &&
           report.velocity_error <= options.velocity_error && report.energy_made <= options.energy_made &&
           !too_deep(report, options, least_radius);
}

/// Writes the estimate into the report. near: report_residual() was true.
inline void report_distance(const DistanceEstimate& estimate, const SolveOptions& options, bool near,
                            SolveReport& report) {
    report.energy_made = (std::max)(report.energy_made, estimate.energy_made);
    report.gap_error = estimate.gap_error;
    report.distance = estimate.worst;
    report.scene_distance = estimate.scene;
    report.converged = near && report.energy_made <= options.energy_made && report.gap_error <= options.gap_error &&
                       report.distance <= options.distance;
}

}}  // namespace nscdd::NSCDD_ABI
