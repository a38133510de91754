#pragma once

#include <vector>

#include "nscdd/core/contact_problem.hpp"
#include "nscdd/subdomain/candidates.hpp"
#include "nscdd/subdomain/topology.hpp"
#include "nscdd/sweep/sweeper.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// What one rank holds: whom it shares grains with, its grains and candidates, its contact problem, and the solver's
/// memory.
template <class M>
struct Subdomain : Topology, Candidates<M> {
    ContactProblem<M> problem;  ///< of this step
    Sweeper<M> sweeper;         ///< the problem in the layout of the fast sweep, while it is being solved
};

/// Links of the subdomains with their neighbours, for so many doubles a grain that they share.
inline std::vector<Links> links_between(const auto& parts, std::size_t doubles) {
    std::vector<Links> links(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t l = 0; l < parts[k].neighbours.size(); ++l) {
            const std::size_t size = parts[k].linked[l].size() * doubles;
            links[k].push_back({parts[k].neighbours[l], size, size});
        }
    return links;
}

}}  // namespace nscdd::NSCDD_ABI
