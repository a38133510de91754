#pragma once

#include <vector>

#include "nscdd/core/contact_problem.hpp"
#include "nscdd/subdomain/candidates.hpp"
#include "nscdd/subdomain/halo.hpp"
#include "nscdd/subdomain/placed_obstacles.hpp"
#include "nscdd/sweep/sweeper.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// All that one rank holds: its candidates, the ranks it shares grains with, contacts and active copies of the step.
/// Each base class says who writes it.
template <class M>
struct Subdomain : detail::bases::Halo,
                   Candidates<M>,
                   detail::bases::ContactSources,
                   detail::bases::NearObstacles<M>,
                   detail::bases::ActiveCopies {
    ContactProblem<M> problem;  ///< of this step; the narrow phase fills it, the step solver solves it
    Sweeper<M> sweeper;         ///< the problem in the layout of the fast sweep, during a solve

    /// Number of active copies of a grain, at least 1.
    int multiplicity(std::size_t grain) const {
        int count = 0;
        for (std::size_t s = first_replica(grain); s < last_replica(grain); ++s) count += active[s];
        return count > 0 ? count : 1;
    }
};

namespace detail {

/// Links of the subdomains with their neighbours, for so many doubles a grain that they share.
inline std::vector<Communicator::Links> links_between(const auto& parts, std::size_t doubles) {
    std::vector<Communicator::Links> links(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t l = 0; l < parts[k].neighbours.size(); ++l) {
            const std::size_t size = parts[k].linked[l].size() * doubles;
            links[k].push_back({parts[k].neighbours[l], size, size});
        }
    return links;
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
