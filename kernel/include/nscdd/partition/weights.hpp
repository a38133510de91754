// What a partition has to deal out evenly: the candidates of the last rough detection.
#pragma once

#include <algorithm>
#include <vector>

#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd::inline NSCDD_ABI {

// Calls visit(midpoint, a, b) for each candidate of this subdomain; a and b are the positions of its grains, of a
// contact with a wall twice the same. A contact belongs to the rank that owns its midpoint.
template <class M>
void visit_candidates(const Subdomain<M>& part, auto&& visit) {
    const auto position = [&](int g) -> const typename M::Vec& {
        return part.grains[static_cast<std::size_t>(g)].position;
    };
    for (const auto& c : part.pairs)
        visit(typename M::Vec(0.5 * (position(c.i) + position(c.j))), position(c.i), position(c.j));
    for (const auto& c : part.wall_pairs) visit(position(c.i), position(c.i), position(c.i));
}

// Candidates of this subdomain, those with walls included.
template <class M>
double candidate_count(const Subdomain<M>& part) {
    return static_cast<double>(part.pairs.size() + part.wall_pairs.size());
}

// Whether any process has a candidate. Collective.
template <class M>
bool any_candidates(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
    return reduce(comm, 0, [&parts](std::size_t k) { return Buffer{candidate_count(parts[k])}; })[0] > 0;
}

// Candidates of the busiest rank over their mean; 1 where there are none. Collective.
template <class M>
double measure_imbalance(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
    const auto count = [&parts](std::size_t k) { return Buffer(2, candidate_count(parts[k])); };
    const std::span<const double> all = reduce(comm, 1, count);
    return all[0] > 0 ? all[1] * comm.size() / all[0] : 1;
}

}  // namespace nscdd
