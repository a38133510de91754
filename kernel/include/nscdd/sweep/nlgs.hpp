/// @file
/// Nonlinear Gauss-Seidel, the sequential reference. It is matrix-free and takes contacts in the order given.
/// ```
/// nscdd::SolveReport report = nscdd::nlgs(problem, {.tolerance = 1e-6});
/// ```
#pragma once

#include "nscdd/core/validate.hpp"
#include "nscdd/iterate/iteration.hpp"
#include "nscdd/sweep/metered.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// What is outside of a solve: nothing. nlgs() knows no other method and no clock.
struct NothingElse {
    /// Returns the report of nothing handed over.
    HandedOver operator()(const auto&...) const { return {}; }
    void loaded() const {}  ///< called after loading and storing
    void swept() const {}   ///< called after sweeps
    void tested() const {}  ///< called after a test, and after what it has called
};

/// outside(problem, sums, residual) hands over, as Iterated says; its other members are those of NothingElse.
template <class M, class Outside>
class SweptAlone {
  public:
    SweptAlone(ContactProblem<M>& problem, const SolveOptions& options, Sweeper<M>& sweeper, Outside outside,
               Meter* meter)
        : problem_(problem),
          options_(options),
          sweeper_(sweeper),
          metered_(sweeper, problem, {}, meter),
          outside_(std::move(outside)) {
        sweeper_.load(problem_, options_.relaxation);
        sums_.begin(problem_, sweeper_.free_velocities(problem_));
        outside_.loaded();
    }

    void keep() { sweeper_.keep(problem_); }
    const double* iterate(const Anderson* anderson, bool /*tested*/) {
        if (anderson) sweeper_.accelerate(problem_, options_.window);
        products_ = {};
        metered_.sweep(anderson, products_);
        for (int s = 1; s < options_.sweeps; ++s) metered_.sweep(nullptr, products_);
        return products_.data();
    }
    ResidualParts residual() {
        outside_.swept();
        const ResidualParts parts = metered_.residual();
        outside_.tested();
        return parts;
    }
    detail::DistanceEstimate distance(const ResidualParts& residual) {
        metered_.count_test();
        sweeper_.store(problem_);
        const auto estimate = detail::estimate_distance(problem_, sums_, residual, sweeper_.kept(problem_));
        outside_.tested();
        return estimate;
    }
    void mark() {
        sweeper_.store(problem_);
        sums_.mark(problem_);
        outside_.tested();
    }
    void restore_velocities() {
        sweeper_.restore_velocities(problem_);
        outside_.tested();
    }
    HandedOver hand_over(const ResidualParts& residual) {
        sweeper_.store(problem_);
        const HandedOver solved = outside_(problem_, sums_, residual);
        outside_.tested();
        if (solved.contacts > 0) {
            sums_.set_velocities(problem_);
            sweeper_.load(problem_, options_.relaxation);
            outside_.loaded();
        }
        return solved;
    }
    void store() {
        sweeper_.store(problem_);
        outside_.loaded();
    }
    double least_radius() const { return problem_.least_radius; }

  private:
    ContactProblem<M>& problem_;
    const SolveOptions& options_;
    Sweeper<M>& sweeper_;
    MeteredSweeper<M> metered_;
    Outside outside_;
    detail::DistanceSums<M> sums_;
    Anderson::Products products_{};
};

/// Does nlgs() for a problem that validate() has let pass, or that our own detection has filled. `meter` counts the
/// work, as that of its first rank, unless it is null.
template <class M, class Outside = NothingElse>
SolveReport nlgs_of_valid(ContactProblem<M>& problem, const SolveOptions& options, Sweeper<M>& sweeper,
                          Outside outside = {}, Meter* meter = nullptr) {
    check_options(options);
    if (problem.contact_count() == 0) return {};
    SweptAlone<M, Outside> system(problem, options, sweeper, std::move(outside), meter);
    const SolveReport report = iterate(system, options);
    system.store();
    return report;
}

}  // namespace detail

///@{
/// Sweeps until the step has converged (SolveReport) or the cap is reached. In: velocities consistent with the
/// impulses. `sweeper` only saves its memory for the next call.
///
/// Throws std::invalid_argument for a faulty problem (validate.hpp) and for options with which it would not end,
/// std::runtime_error when numbers are no longer finite.
template <class M>
SolveReport nlgs(ContactProblem<M>& problem, const SolveOptions& options, Sweeper<M>& sweeper) {
    validate(problem);
    return detail::nlgs_of_valid(problem, options, sweeper);
}

template <class M>
SolveReport nlgs(ContactProblem<M>& problem, const SolveOptions& options) {
    Sweeper<M> sweeper;
    return nlgs(problem, options, sweeper);
}
///@}

}}  // namespace nscdd::NSCDD_ABI
