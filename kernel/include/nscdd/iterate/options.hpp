// When an iteration stops, and how it ended.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "nscdd/iterate/anderson.hpp"
#include "nscdd/law/residual.hpp"

namespace nscdd::inline NSCDD_ABI {

// When NLGS or NSCDD stops, and how it iterates. The four bounds: METHOD.md, section 5.4.
struct SolveOptions {
    double tolerance = 1e-4;  // on eta, ResidualParts::eta()
    // On ResidualParts::velocity_error(): eta does not see wrong velocities where masses differ or columns are long.
    double velocity_error = 0.1;
    double energy_made = 1e-3;   // on ResidualParts::energy_made()
    double penetration = 1e-3;   // on the penetration of the step over the least radius, where the problem has one
    int check_every = 10;        // iterations between two tests
    int max_iterations = 20000;  // cap; one is made at least. A solve that it ends is reported as not converged
    int sweeps = 1;              // n_GS of Alg. 1: sweeps between two gluings
    double relaxation = 1;       // omega: a contact goes by 1/W times it; 0 to 2
    int window = 0;              // of Anderson acceleration: earlier iterates to combine; 0 is the paper's own method

    // These options with the window that was found to need the fewest iterations (METHOD.md, section 8).
    SolveOptions accelerated() const {
        SolveOptions options = *this;
        options.window = 2;
        return options;
    }
};

// Converged: eta, the velocity error and the energy made are small enough, and no contact closes too far in the step.
// Without a least radius the penetration is not tested but only reported, for the caller to judge.
struct SolveReport {
    int iterations = 0;               // made, each of SolveOptions::sweeps sweeps
    double residual = 0;              // eta
    double velocity_error = 0;        // ResidualParts::velocity_error()
    double energy_made = 0;           // ResidualParts::energy_made()
    double velocity_change_norm = 0;  // |V - V_free|_M, what the contacts changed [J^1/2]
    double penetration = 0;           // deepest that the step would close a contact [m]
    bool converged = true;            // all tests are passed
};

// Throws std::invalid_argument for options with which no solver ends.
inline void check_options(const SolveOptions& options) {
    const double omega = options.relaxation;
    if (!(options.tolerance >= 0) || !(options.velocity_error >= 0) || !(options.energy_made >= 0) ||
        !(options.penetration >= 0))
        throw std::invalid_argument(
            "tolerance, velocity_error, energy_made and penetration must be numbers and not negative");
    if (options.max_iterations < 0) throw std::invalid_argument("max_iterations must not be negative");
    if (options.check_every < 1 || options.sweeps < 1)
        throw std::invalid_argument("check_every and sweeps must be at least 1");
    if (!(omega > 0 && omega < 2)) throw std::invalid_argument("the relaxation must be between 0 and 2");
    if (options.window < 0 || options.window > Anderson::largest_window)
        throw std::invalid_argument("the window must be within 0 and " + std::to_string(Anderson::largest_window));
}

// Number of iterations to the next test of convergence: the last may come sooner, so that the cap is kept.
template <class Options>
int until_test(const Options& options, const SolveReport& report) {
    return std::max(1, std::min(options.check_every, options.max_iterations - report.iterations));
}

// Calls iterate() until measure() is at most the tolerance or the cap is reached, and tests it as the options say.
// Throws std::runtime_error when the measure is not finite.
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

// True from the first test at which iterations (counted as ten at least) times contacts is at least 360. Shorter steps
// do not pay for the set-up, measured to cost about 360 solved contacts.
inline bool pays_to_accelerate(const SolveOptions& options, const SolveReport& report, double contacts) {
    return options.window > 0 && report.iterations > 0 && std::max(report.iterations, 10) * contacts >= 360;
}

// Whether the step would close a contact farther than the options allow. Never without a least radius.
inline bool too_deep(const SolveReport& report, const SolveOptions& options, double least_radius) {
    return least_radius > 0 && report.penetration > options.penetration * least_radius;
}

// Writes the residual into the report; true when the iteration is over. least_radius: of the scene [m], 0 where it is
// not known. Throws std::runtime_error when eta is not finite.
inline bool report_residual(const ResidualParts& parts, const SolveOptions& options, double least_radius,
                            SolveReport& report) {
    report.residual = parts.eta();
    report.velocity_error = parts.velocity_error();
    report.energy_made = parts.energy_made();
    report.velocity_change_norm = std::sqrt(parts.velocity_change.energy);
    report.penetration = parts.penetration;
    if (!std::isfinite(report.residual))
        throw std::runtime_error("the residual is not finite: check masses and velocities");
    report.converged = report.residual <= options.tolerance && report.velocity_error <= options.velocity_error &&
                       report.energy_made <= options.energy_made && !too_deep(report, options, least_radius);
    return report.converged || report.iterations >= options.max_iterations;
}

}  // namespace nscdd
