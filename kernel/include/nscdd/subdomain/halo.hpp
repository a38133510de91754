#pragma once

#include <vector>

#include "nscdd/comm/communicator.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Copies of a grain, or of a driven wall, that are active in a step. They share its mass and are glued.
enum class Multiplicity {
    minimal,    ///< copies with a contact in the step
    predicted,  ///< copies with a candidate of the last broad phase, as in the paper
};

namespace detail::bases {

/// Ranks that a rank shares grains with. repartition() writes it, at each broad phase; grains that come and go between
/// steps take their entries along (step/exchange.hpp).
struct Halo {
    int rank = 0;                          ///< rank of this subdomain
    std::vector<int> replica_begin{0};     ///< place in `replicas` where those of each grain begin
    std::vector<int> replicas;             ///< ranks with a copy of each grain, ascending, this one included
    std::vector<int> neighbours;           ///< ranks that share a grain with this one, ascending
    std::vector<std::vector<int>> linked;  ///< grains shared with each neighbour, by ascending id

    /// First replica of a grain. They are replicas[s] for first_replica(grain) <= s < last_replica(grain).
    std::size_t first_replica(std::size_t grain) const { return static_cast<std::size_t>(replica_begin[grain]); }
    /// One beyond the last replica of a grain.
    std::size_t last_replica(std::size_t grain) const { return static_cast<std::size_t>(replica_begin[grain + 1]); }

    /// True if this copy stands for its grain in sums over the scene.
    bool primary(std::size_t grain) const { return replicas[first_replica(grain)] == rank; }
};

/// Copies that are active in this step. agree_on_multiplicities() alone writes them, once contacts are known.
struct ActiveCopies {
    std::vector<char> active;    ///< per entry of Halo::replicas: 1 if that copy is active
    std::vector<int> interface;  ///< grains with this and another active copy, by ascending id
    /// For each wall, 1 where it is driven and its copy here is active. Empty where no wall is driven.
    std::vector<char> wall_active;
    std::vector<char> wall_touched;  ///< for each wall, 1 where it is driven and any copy is active
    ///@{
    /// Numbers of contacts of interface grains. They are at the front of the problem's lists, and swept first.
    std::size_t interface_contacts = 0, interface_wall_contacts = 0;
    ///@}
};

}  // namespace detail::bases

}}  // namespace nscdd::NSCDD_ABI
