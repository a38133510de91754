/// @file
/// Nonlinear Gauss-Seidel on a problem in local form, with full blocks. It is for problems of other codes, and for
/// checks.
/// ```
/// std::vector<nscdd::DelassusProblem<3>::Vec> r(problem.contact_count(), Vec::Zero());   // or a warm start
/// nscdd::SolveReport report = nscdd::block_nlgs(problem, r, {.tolerance = 1e-8});
/// ```
#pragma once

#include "nscdd/core/validate.hpp"
#include "nscdd/iterate/anderson.hpp"
#include "nscdd/iterate/stop.hpp"
#include "nscdd/law/error_measures.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Options of block_nlgs(): when it stops.
struct BlockOptions {
    double tolerance = 1e-8;      ///< on the largest of ErrorMeasures::natural_map, natural_map_velocity, unilateral
    int check_every = 10;         ///< sweeps between two tests; a test costs about one sweep
    int max_iterations = 200000;  ///< sweeps; the report says so when they end the solve
    int window = 0;               ///< earlier sweeps that acceleration combines, at most 8; 0: plain sweeps
    int interval() const { return check_every; }  ///< iterations between two tests
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

/// Sweeps over a problem, accelerated unless the window is 0 (anderson.hpp).
template <int dim, bool rolls>
class BlockSweeps {
  public:
    using Problem = DelassusProblem<dim, rolls>;
    using Impulses = std::vector<typename Problem::Vec>;

    BlockSweeps(const Problem& problem, int window)
        : problem_(problem),
          anderson_(window),
          iterates_(static_cast<std::size_t>(window), Impulses(problem.contact_count(), Problem::Vec::Zero())),
          changes_(iterates_) {}

    /// Makes one sweep. Its end is what the next one begins with.
    void operator()(Impulses& r) {
        if (anderson_.window() == 0) return block_sweep(problem_, r);
        const auto slots = static_cast<std::size_t>(anderson_.window());
        const auto last = static_cast<std::size_t>(anderson_.last()), now = static_cast<std::size_t>(anderson_.now());
        for (std::size_t c = 0; c < r.size(); ++c) {
            const typename Problem::Vec end = r[c];
            for (std::size_t j = 0; j < slots; ++j)
                r[c] += anderson_.coefficient(static_cast<int>(j)) * (iterates_[j][c] - end);
            iterates_[last][c] = end;
        }
        Impulses& change = start_ = r;
        block_sweep(problem_, r);
        Anderson::Products products{};
        for (std::size_t c = 0; c < r.size(); ++c) {
            change[c] = r[c] - change[c];
            const auto& w = problem_.blocks[static_cast<std::size_t>(problem_.diagonal[c])];
            typename Problem::Vec weighted = Anderson::tangential_weight * w.diagonal().cwiseProduct(change[c]);
            weighted[0] = w(0, 0) * change[c][0];
            products[0] += weighted.dot(change[c]);
            for (std::size_t j = 0; j < slots; ++j) products[j + 1] += weighted.dot(changes_[j][c]);
        }
        changes_[now].swap(change);
        anderson_.update(products.data());
    }

  private:
    const Problem& problem_;
    Anderson anderson_;
    std::vector<Impulses> iterates_, changes_;  // by slot
    Impulses start_;
};

}  // namespace detail

/// Sweeps until both natural maps are small enough. The report's residual is the larger one. r is start and answer, one
/// impulse per contact. Throws std::invalid_argument for a faulty problem and for options without an end,
/// std::runtime_error when the impulses are no longer finite.
template <int dim, bool rolls>
SolveReport block_nlgs(const DelassusProblem<dim, rolls>& problem,
                       std::vector<typename DelassusProblem<dim, rolls>::Vec>& r, const BlockOptions& options = {}) {
    if (!(options.tolerance >= 0) || options.check_every < 1 || options.max_iterations < 0)
        throw std::invalid_argument("the tolerance must be a number and not negative, check_every at least 1");
    if (options.window < 0 || options.window > detail::Anderson::largest_window)
        throw std::invalid_argument("the window must be 0 to " + std::to_string(detail::Anderson::largest_window));
    validate(problem, r);
    if (problem.contact_count() == 0) return {};
    detail::BlockSweeps<dim, rolls> sweep(problem, options.window);
    return detail::iterate_until(
        options, [&] { sweep(r); }, [&] { return detail::stopping_error(problem, r); });
}

}}  // namespace nscdd::NSCDD_ABI
