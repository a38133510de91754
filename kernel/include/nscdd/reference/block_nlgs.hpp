/// @file
/// Nonlinear Gauss-Seidel on a problem in local form, with full blocks. It is for problems of other codes, and for
/// checks.
/// ```
/// std::vector<nscdd::DelassusProblem<3>::Vec> r(problem.contact_count(), Vec::Zero());   // or a warm start
/// nscdd::SolveReport report = nscdd::block_nlgs(problem, r, {.tolerance = 1e-8});
/// ```
#pragma once

#include "nscdd/core/validate.hpp"
#include "nscdd/iterate/stop.hpp"
#include "nscdd/law/error_measures.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Options of block_nlgs(): when it stops.
struct BlockOptions {
    double tolerance = 1e-8;      ///< on the largest of ErrorMeasures::natural_map, natural_map_velocity, unilateral
    int check_every = 10;         ///< sweeps between two tests; a test costs about one sweep
    int max_iterations = 200000;  ///< sweeps; the report says so when they end the solve
};

namespace detail {

/// Makes one pass over all contacts in the order given, each solved exactly with the latest impulses [Jean99].
template <int dim, bool rolls>
void block_sweep(const DelassusProblem<dim, rolls>& problem,
                 std::vector<typename DelassusProblem<dim, rolls>::Vec>& r) {
    for (std::size_t c = 0; c < problem.contact_count(); ++c) {
        const auto& w = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])];
        const typename DelassusProblem<dim, rolls>::Vec others = problem.velocity(c, r) - w * r[c];
        r[c] = answer_of_contact(problem, c, others);
    }
}

}  // namespace detail

/// Sweeps until both natural maps are small enough. The report's residual is the larger one. r is start and answer, one
/// impulse per contact. Throws std::invalid_argument for a faulty problem and for options without an end,
/// std::runtime_error when the impulses are no longer finite.
template <int dim, bool rolls>
SolveReport block_nlgs(const DelassusProblem<dim, rolls>& problem,
                       std::vector<typename DelassusProblem<dim, rolls>::Vec>& r, const BlockOptions& options = {}) {
    if (!(options.tolerance >= 0) || options.check_every < 1 || options.max_iterations < 0)
        throw std::invalid_argument("the tolerance must be a number and not negative, check_every at least 1");
    validate(problem, r);
    if (problem.contact_count() == 0) return {};
    return detail::iterate_until(
        options, [&] { detail::block_sweep(problem, r); }, [&] { return detail::stopping_error(problem, r); });
}

}}  // namespace nscdd::NSCDD_ABI
