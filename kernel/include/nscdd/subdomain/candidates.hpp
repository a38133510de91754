#pragma once

#include <limits>
#include <vector>

#include "nscdd/core/grain.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A pair that the broad phase has found, with the impulse that it carries from step to step.
template <class M>
struct Candidate {
    int i;  ///< place in Candidates::grains; the grain with the lower id of the two
    int j;  ///< place of the other grain, or number of the wall
    typename M::Impulse r = M::Impulse::Zero();  ///< on i [N s], 0 where it is no contact
    /// `free_gap` of a contact that the law holds.
    static constexpr double held = std::numeric_limits<double>::infinity();
    double free_gap = held;  ///< its gap [m], unless it is a contact that the law keeps from closing within the step
    bool closes = false;     ///< left out, and the last attempt would close it
    bool missed = false;     ///< has closed: a contact in the next attempt
    bool passes = false;     ///< a contact of grains that pass each other: none in the next attempt, unless missed
};

/// The grains of one rank, and the pairs among them that may touch. Written by repartition(), at each broad phase.
/// Between steps the grains have their motion here, and pairs their impulses; within a step the contact problem has
/// them.
template <class M>
struct Candidates {
    std::vector<Grain<M>> grains;                       ///< those with a copy on this rank, in spatial order
    std::vector<typename M::Vec> broad_phase_position;  ///< of the grains, when the candidates were found [m]
    std::vector<Candidate<M>> pairs;                    ///< between grains, by ascending lower place
    std::vector<Candidate<M>> wall_pairs;               ///< with walls, by grain
};

/// Where the contacts of a step come from. Written by the narrow phase, detect_contacts(), and put in the order of the
/// contacts by agree_on_multiplicities().
struct ContactSources {
    std::vector<int> source;       ///< candidate of each contact
    std::vector<int> wall_source;  ///< candidate of each contact with a wall
};

}}  // namespace nscdd::NSCDD_ABI
