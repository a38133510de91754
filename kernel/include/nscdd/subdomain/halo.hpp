#pragma once

#include <vector>

#include "nscdd/comm/communicator.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Which copies of a grain, and of a driven wall, are active in a step: share its mass and are glued.
enum class Multiplicity {
    minimal,    ///< those with a contact in the step
    predicted,  ///< those with a candidate of the last broad phase, as in the paper
};

/// With whom a rank shares grains. Written by repartition() alone, at each broad phase.
struct Halo {
    int rank = 0;                          ///< of this subdomain
    std::vector<int> replica_begin{0};     ///< where those of each grain begin in replicas
    std::vector<int> replicas;             ///< ranks with a copy of each grain, ascending, this one included
    std::vector<int> neighbours;           ///< ranks that share a grain with this one, ascending
    std::vector<std::vector<int>> linked;  ///< per neighbour: the grains shared, by ascending id

    /// The replicas of a grain are replicas[s] for first_replica(grain) <= s < last_replica(grain).
    std::size_t first_replica(std::size_t grain) const { return static_cast<std::size_t>(replica_begin[grain]); }
    /// One beyond the last replica of a grain.
    std::size_t last_replica(std::size_t grain) const { return static_cast<std::size_t>(replica_begin[grain + 1]); }

    /// Whether this copy stands for its grain in sums over the scene.
    bool primary(std::size_t grain) const { return replicas[first_replica(grain)] == rank; }
};

/// Which copies are active in this step. Written by agree_on_multiplicities() alone, once contacts are known.
struct ActiveCopies {
    std::vector<char> active;    ///< per entry of Halo::replicas: 1 if that copy is active
    std::vector<int> interface;  ///< grains with this and another active copy, by ascending id
    /// Per wall, 1 for driven walls whose copy here is active. Empty where no wall is driven.
    std::vector<char> wall_active;
    std::vector<char> wall_touched;  ///< the same, where any copy is
    ///@{
    /// Contacts of interface grains, at the front of the problem's lists: they are swept first.
    std::size_t interface_contacts = 0, interface_wall_contacts = 0;
    ///@}
};

}}  // namespace nscdd::NSCDD_ABI
