/// @file
/// The outer loop that NLGS and NSCDD share: iterations, acceleration, and the test of convergence.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>

#include "nscdd/iterate/anderson.hpp"
#include "nscdd/iterate/stop.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// What is tested: the iterate of one problem (convergence_test.hpp), or of all subdomains.
///   residual()             of the whole scene
///   distance(residual)     the estimate of the whole scene, of its residual
///   mark()                 the iterate becomes the mark of distance()
///   least_radius()         of the scene [m], 0: unknown
template <class S>
concept Tested = requires(S& system, const ResidualParts& residual) {
    { system.residual() } -> std::same_as<ResidualParts>;
    { system.distance(residual) } -> std::same_as<detail::DistanceEstimate>;
    system.mark();
    { system.least_radius() } -> std::convertible_to<double>;
};

/// What iterates: sweeps over the contacts of one problem (nlgs.hpp), or over those of all subdomains and then gluing
/// (nscdd_solve.hpp). The iterate that it is made with is the first mark.
///   keep()                 the iterate is kept, and distance() looks along the line from it to a later one as well
///   iterate(a, tested)     one iteration; tested: a test follows it. Accelerated by *a unless that is null, and then
///                          returns the products that *a asks for, summed over all contacts
///   restore_velocities()   V = V_free + M^-1 H r of the impulses held
///   hand_over(residual)    Newton's method for the components that are far from an answer; what it has solved
template <class S>
concept Iterated = Tested<S> && requires(S& system, const Anderson* anderson, const ResidualParts& residual) {
    system.keep();
    { system.iterate(anderson, true) } -> std::convertible_to<const double*>;
    system.restore_velocities();
    { system.hand_over(residual) } -> std::same_as<HandedOver>;
};

/// When the iterate becomes the mark that later ones are held against: after the tests at 10, 20, 40 ... iterations,
/// so that the line from mark to iterate spans half of all iterations and more.
class Marks {
  public:
    /// Whether the iterate after so many iterations is to be the mark from now on.
    bool due(int iterations) {
        if (iterations < 2 * last_) return false;
        last_ = iterations;
        return true;
    }

  private:
    int last_ = 0;
};

/// Whether iterations get nowhere: twice as many have not halved the error. Asked at each mark.
class Stall {
  public:
    static constexpr int earliest = 1000;  ///< iterations; before them Newton's method would cost more than it saves
    /// True if the error over its bounds has not halved since the last call.
    bool seen(double error, int iterations) {
        const bool stalled = !(error <= 0.5 * last_) && iterations >= earliest;
        last_ = error;
        return stalled;
    }

  private:
    double last_ = std::numeric_limits<double>::infinity();
};

/// What a test has found.
struct TestResult {
    bool over;        ///< the step has converged, or the cap is reached
    double residual;  ///< over its bounds: residual_over_bounds()
};

/// Tests the iterate. The estimate costs more than the residual, and is asked where that is small enough, or at the
/// end. may_pass: whether the step may have converged before the last test.
template <Tested System>
TestResult tested(System& system, const SolveOptions& options, bool may_pass, ResidualParts& residual,
                  SolveReport& report) {
    residual = system.residual();
    const bool last = report.iterations >= options.max_iterations;
    const bool near = detail::report_residual(residual, options, system.least_radius(), report) && (may_pass || last);
    const double over_bounds = detail::residual_over_bounds(report, options, system.least_radius());
    if (near || last) detail::report_distance(system.distance(residual), options, system.least_radius(), near, report);
    return {report.converged || last, over_bounds};
}

/// Iterates until the step has converged (SolveReport) or the cap is reached.
template <Iterated System>
SolveReport iterate(System& system, const SolveOptions& options) {
    SolveReport report;
    ResidualParts residual;
    Anderson anderson(options.window);
    Marks marks;
    Stall stall;
    const bool bounded = std::isfinite(options.bounds.max_distance);
    for (TestResult test{false, 0}; !test.over;) {
        const bool accelerated = detail::pays_to_accelerate(options, report, residual.contacts);
        const int count = detail::until_test(options, report);
        // Keeping the last iterate but one costs a fifth of a sweep, and is left out where the next test will fail.
        const bool kept = bounded && test.residual <= 10;
        for (int k = 0; k < count; ++k) {
            if (kept && k + 1 == count) system.keep();
            const double* products = system.iterate(accelerated ? &anderson : nullptr, k + 1 == count);
            if (accelerated) anderson.update(products);
        }
        report.iterations += count;
        test = tested(system, options, kept || !bounded, residual, report);
        if (test.over && anderson.velocities_stale()) {
            system.restore_velocities();
            anderson.forget();
            test = tested(system, options, kept || !bounded, residual, report);
        }
        const bool last = report.iterations >= options.max_iterations;
        if (report.converged || !(marks.due(report.iterations) || last)) continue;
        const bool stalled =
            stall.seen(detail::error_over_bounds(report, options, system.least_radius()), report.iterations);
        if (options.max_newton_contacts > 0 && options.tolerance > 0 &&
            (stalled || (last && report.iterations >= Stall::earliest))) {
            if (const HandedOver solved = system.hand_over(residual); solved.contacts > 0) {
                report.newton_contacts += solved.contacts;
                report.rebounds_given_up += solved.rebounds_given_up;
                anderson.forget();
                system.mark();  // no iteration has led here from the last one
                test = tested(system, options, true, residual, report);
            }
        }
        if (!test.over) system.mark();
    }
    return report;
}

}}  // namespace nscdd::NSCDD_ABI
