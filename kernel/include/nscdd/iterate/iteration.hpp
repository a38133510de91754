/// @file
/// The outer loop that NLGS and NSCDD share: iterations, acceleration, and the test of convergence.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>

#include "nscdd/iterate/anderson.hpp"
#include "nscdd/iterate/stop.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// A system that is tested: the iterate of one problem (convergence_test.hpp), or of all subdomains.
///
/// - residual() returns that of the whole scene.
/// - distance(residual) returns the estimate of the whole scene.
/// - mark() makes the iterate the mark of distance().
/// - least_radius() is that of the scene [m]; 0: unknown.
template <class S>
concept Tested = requires(S& system, const ResidualParts& residual) {
    { system.residual() } -> std::same_as<ResidualParts>;
    { system.distance(residual) } -> std::same_as<DistanceEstimate>;
    system.mark();
    { system.least_radius() } -> std::convertible_to<double>;
};

/// A system that iterates. It sweeps the contacts of one problem (nlgs.hpp), or those of all subdomains and then glues
/// (nscdd_solve.hpp). The iterate that it is made with is the first mark.
///
/// - keep() keeps the iterate. distance() then looks along the line from it to a later one as well.
/// - iterate(a, tested) makes one iteration. `tested` says that a test follows it. Unless a is null, *a accelerates it,
///   and the products that *a asks for are returned, summed over all contacts.
/// - restore_velocities() sets V = V_free + M^-1 H r of the impulses held.
/// - hand_over(residual) leaves the components that are far from an answer to Newton's method. It returns what that has
///   solved.
template <class S>
concept Iterated = Tested<S> && requires(S& system, const Anderson* anderson, const ResidualParts& residual) {
    system.keep();
    { system.iterate(anderson, true) } -> std::convertible_to<const double*>;
    system.restore_velocities();
    { system.hand_over(residual) } -> std::same_as<HandedOver>;
};

/// The times when the iterate becomes the mark that later ones are compared with: after the tests at 10, 20, 40 ...
/// iterations. So the line from mark to iterate spans half of all iterations and more.
class Marks {
  public:
    /// True if the iterate after so many iterations is to be the mark from now on.
    bool due(int iterations) {
        if (iterations < 2 * last_) return false;
        last_ = iterations;
        return true;
    }

  private:
    int last_ = 0;
};

/// Tells where iterations get nowhere: twice as many have not halved the error. It is asked at each mark.
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

/// Foretells at which accelerated iteration a test may pass. The figures of a test fall as |f| does, the change by an
/// iteration, which acceleration has summed over all contacts.
class Foretold {
  public:
    /// An iteration with f.f = `square`.
    void changed(double square) {
        const bool first = !std::isfinite(change_);
        change_ = std::sqrt(square);
        if (first) rate();
    }
    /// A test: `figures` over their bounds. It was due() and failed, if it was due() and this is called.
    void tested(double figures) {
        wait_ = due(wait_ + 1) ? (std::min)(2 * wait_, 10) : 1;
        figures_ = figures;
        rate();
    }
    /// True if the figures may be below their bounds, `since` iterations after a test.
    bool due(int since) const { return since > wait_ && figures() <= 1; }
    /// The figures over their bounds, as foretold; infinite before a test and a change.
    double figures() const { return change_ > 0 ? figures_per_change_ * change_ : 0; }
    /// Iterations after which a test comes without being foretold, after so many of the step.
    static int longest(int iterations) { return (std::clamp)(iterations, 20, 50); }

  private:
    static constexpr double unknown = std::numeric_limits<double>::infinity();
    void rate() { figures_per_change_ = std::isfinite(change_) && change_ > 0 ? figures_ / change_ : unknown; }

    double change_ = unknown, figures_ = unknown, figures_per_change_ = unknown;
    int wait_ = 1;
};

/// Result of a test.
struct TestResult {
    bool over;        ///< the step has converged, or the cap is reached
    bool near;        ///< the residual is small enough, and the step may converge
    double residual;  ///< figures over their bounds, residual_over_bounds()
};

/// Tests the iterate. The estimate costs more than the residual, so it is asked where the residual is small enough, or
/// at the end. The step may converge before the last test only with may_pass. renew() is called before an estimate; it
/// returns whether it has made the velocities anew.
template <Tested System>
TestResult tested(System& system, const SolveOptions& options, bool may_pass, ResidualParts& residual,
                  SolveReport& report, auto&& renew) {
    const bool last = report.iterations >= options.max_iterations;
    const auto is_near = [&] {
        residual = system.residual();
        return report_residual(residual, options, system.least_radius(), report) && (may_pass || last);
    };
    bool near = is_near();
    if ((near || last) && renew()) near = is_near();
    const double over_bounds = residual_over_bounds(report, options, system.least_radius());
    if (near || last) report_distance(system.distance(residual), options, system.least_radius(), near, report);
    return {report.converged || last, near, over_bounds};
}

/// Iterates until the step has converged (SolveReport) or the cap is reached.
template <Iterated System>
SolveReport iterate(System& system, const SolveOptions& options) {
    SolveReport report;
    ResidualParts residual;
    Anderson anderson(options.window);
    Foretold foretold;
    Marks marks;
    Stall stall;
    const bool bounded = std::isfinite(options.bounds.max_distance);
    bool renewed = false;
    const auto renew = [&] {
        renewed = anderson.velocities_stale();
        if (renewed) system.restore_velocities();
        return renewed;
    };
    for (TestResult test{false, false, 0}; !test.over;) {
        const bool accelerated = pays_to_accelerate(options, report, residual.contacts);
        const bool foretells = accelerated && options.check_every == 0;
        const int most =
            until_test(options, report, foretells ? Foretold::longest(report.iterations) : options.interval());
        int count = 0;
        bool kept = false;
        for (bool last = false; !last;) {
            last = ++count == most || (foretells && foretold.due(count));
            // Keeping the last iterate but one costs a fifth of a sweep, and is left out where the next test will fail.
            kept = last && bounded && (foretells ? foretold.figures() : test.residual) <= 10;
            if (kept) system.keep();
            const double* products = system.iterate(accelerated ? &anderson : nullptr, last);
            if (!accelerated) continue;
            anderson.update(products);
            foretold.changed(products[0]);
        }
        report.iterations += count;
        renewed = false;
        test = tested(system, options, kept || !bounded, residual, report, renew);
        // Round-off that keeps the step from its end is not combined further.
        if (renewed && !test.near) anderson.forget();
        foretold.tested(test.near ? error_over_bounds(report, options, system.least_radius()) : test.residual);
        const bool last = report.iterations >= options.max_iterations;
        if (report.converged || !(marks.due(report.iterations) || last)) continue;
        const bool stalled = stall.seen(error_over_bounds(report, options, system.least_radius()), report.iterations);
        if (options.max_newton_contacts > 0 && options.tolerance > 0 &&
            (stalled || (last && report.iterations >= Stall::earliest))) {
            if (const HandedOver solved = system.hand_over(residual); solved.contacts > 0) {
                report.newton_contacts += solved.contacts;
                report.rebounds_given_up += solved.rebounds_given_up;
                anderson.forget();
                system.mark();  // no iteration has led here from the last one
                test = tested(system, options, true, residual, report, [] { return false; });
            }
        }
        if (!test.over) system.mark();
    }
    return report;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
