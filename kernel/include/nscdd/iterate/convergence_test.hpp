#pragma once

#include "nscdd/iterate/iteration.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The test of convergence of a solver that works on one problem as it stands: Newton's, gradients, or one of your own.
/// ```
/// nscdd::ConvergenceTest test(problem, options);   // at the start: velocities consistent with impulses
/// do report.iterations += iterate(problem); while (!test(report));
/// ```
template <class M>
class ConvergenceTest {
  public:
    /// Called at the start, when velocities are consistent with impulses.
    ConvergenceTest(const ContactProblem<M>& problem, const SolveOptions& options)
        : problem_(problem), options_(options), free_(detail::free_velocities(problem)) {
        sums_.begin(problem, free_);
    }
    /// Writes the figures of the iterate into the report, whose iterations the caller counts. Returns true when it has
    /// converged or the cap of iterations is reached. The cost is about three sweeps.
    bool operator()(SolveReport& report) {
        const bool over = detail::tested(*this, options_, true, residual_, report, [] { return false; }).over;
        if (!over && marks_.due(report.iterations)) mark();
        return over;
    }
    /// Writes the estimate of the iterate that was tested last. A solver that ends without convergence calls it.
    void conclude(SolveReport& report) {
        detail::report_distance(distance(residual_), options_, problem_.least_radius, false, report);
    }

    const detail::FreeVelocities<M>& free() const { return free_; }  ///< V_free
    /// Gives the problem the velocities that its impulses make of V_free.
    void set_velocities(ContactProblem<M>& problem) const { sums_.set_velocities(problem); }
    /// Residual of the problem (Tested).
    ResidualParts residual() const { return residual_parts(problem_, free_); }
    /// Makes the iterate the mark (Tested).
    void mark() { sums_.mark(problem_); }
    /// Keeps the iterate, one iteration before a test. The test then sees slow modes that the mark hides. Calling it is
    /// no must.
    void keep() {
        kept_.emplace();
        kept_->take(problem_);
    }
    /// The estimate of the distance of the scene. `residual` is that of residual().
    detail::DistanceEstimate distance(const ResidualParts& residual) {
        return detail::estimate_distance(problem_, sums_, residual, kept_ ? &*kept_ : nullptr);
    }
    /// Least radius of the scene [m].
    double least_radius() const { return problem_.least_radius; }

  private:
    const ContactProblem<M>& problem_;
    SolveOptions options_;
    detail::FreeVelocities<M> free_;
    detail::DistanceSums<M> sums_;
    std::optional<detail::Iterate<M>> kept_;
    detail::Marks marks_;
    ResidualParts residual_;
};

}}  // namespace nscdd::NSCDD_ABI
