#pragma once

#include <limits>
#include <vector>

#include "nscdd/core/cell.hpp"
#include "nscdd/core/grain.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The grains of one rank, and the pairs among them that may touch. repartition() writes them, at each broad phase, and
/// step/exchange.hpp where grains come and go.
///
/// A step begins with the motion of the grains and the impulses of the pairs that are here, and writes them when it is
/// accepted. In between the contact problem has them. After the step that problem is read alone, by measures and files.
template <class M>
struct Candidates {
    /// A pair that the broad phase has found, with the impulse that it carries from step to step.
    struct Candidate {
        int i;  ///< place in Candidates::grains; the grain with the lower id of the two
        int j;  ///< place of the other grain, or number of the wall or facet (PlacedObstacles)
        typename M::Impulse r = M::Impulse::Zero();  ///< on i [N s], 0 where it is no contact
        /// Value of `free_gap` for a contact that the law holds.
        static constexpr double held = std::numeric_limits<double>::infinity();
        /// Gap [m], unless the law keeps this contact from closing within the step. The narrow phase writes it.
        double free_gap = held;
        ///@{
        /// Written after each attempt at a step by detect/tunnelling.hpp, and read by the next.
        bool closes = false;  ///< left out, but the last attempt would close it
        bool missed = false;  ///< has closed, so it is a contact in the next attempt
        bool passes = false;  ///< grains that pass each other: no contact in the next attempt, unless missed
        ///@}
    };

    Cell<M> cell{};                                     ///< of the scene, the same on every rank
    std::vector<Grain<M>> grains;                       ///< those with a copy on this rank, in spatial order
    std::vector<typename M::Vec> broad_phase_position;  ///< of the grains, when the candidates were found [m]
    std::vector<Candidate> pairs;                       ///< between grains, by ascending lower place
    std::vector<Candidate> wall_pairs;                  ///< with walls, then with facets of obstacles, by grain
};

namespace detail::bases {

/// Candidates from which the contacts of a step come. The narrow phase, detect_contacts(), writes them.
/// agree_on_multiplicities() puts them in the order of the contacts.
struct ContactSources {
    std::vector<int> source;       ///< candidate of each contact
    std::vector<int> wall_source;  ///< candidate of each contact with a wall
};

}  // namespace detail::bases

}}  // namespace nscdd::NSCDD_ABI
