/// @file
/// Weights that a partition deals out evenly: the candidates of the last broad phase.
#pragma once

#include <vector>

#include "nscdd/comm/reduce.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Calls visit(midpoint, a, b) for each candidate of this subdomain; a and b are the positions of its grains, of a
/// contact with a wall twice the same. A contact belongs to the rank that owns its midpoint.
template <class M>
void visit_candidates(const Subdomain<M>& part, auto&& visit) {
    const auto position = [&](int g) -> const typename M::Vec& {
        return part.grains[static_cast<std::size_t>(g)].position;
    };
    for (const auto& c : part.pairs)
        visit(part.cell.middle(position(c.i), position(c.j)), position(c.i), position(c.j));
    for (const auto& c : part.wall_pairs) visit(position(c.i), position(c.i), position(c.i));
}

/// Numbers of candidates, those with walls included.
struct CandidateCount {
    double all = 0;                            ///< of all ranks
    double most = 0;                           ///< of the busiest one
    auto summed() { return std::tie(all); }    ///< what reduce() adds up
    auto largest() { return std::tie(most); }  ///< of what reduce() takes the largest
};

/// Collective.
template <class M>
CandidateCount count_candidates(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
    return reduce<CandidateCount>(comm, [&parts](std::size_t k) {
        const double own = double(parts[k].pairs.size() + parts[k].wall_pairs.size());
        return CandidateCount{own, own};
    });
}

/// Whether any process has a candidate. Collective.
template <class M>
bool any_candidates(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
    return count_candidates(parts, comm).all > 0;
}

/// Candidates of the busiest rank over their mean; 1 where there are none. Collective.
template <class M>
double measure_imbalance(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
    const CandidateCount count = count_candidates(parts, comm);
    return count.all > 0 ? count.most * comm.size() / count.all : 1;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
