// What one rank holds: its copies of grains, its candidates for contact, and whom it shares grains with.
#pragma once

#include <limits>
#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/core/contact_problem.hpp"
#include "nscdd/core/grain.hpp"
#include "nscdd/solve/sweeper.hpp"

namespace nscdd::inline NSCDD_ABI {

// A pair of the rough detection, with the impulse that it carries from step to step.
template <class M>
struct Candidate {
    int i;  // local grain, the lower id of the two
    int j;  // local grain, or wall
    typename M::Impulse r = M::Impulse::Zero();
    static constexpr double held = std::numeric_limits<double>::infinity();
    double free_gap = held;  // its gap, unless it is a contact that the law keeps from closing within the step
    bool missed = false;     // left out, and then found to close within the step: next time it goes in
};

template <class M>
struct Subdomain {
    int rank = 0;

    // Set by the rough detection (repartition.hpp).
    std::vector<Grain<M>> grains;                 // in spatial order
    std::vector<typename M::Vec> rough_position;  // of the grains, when the candidates were found
    std::vector<Candidate<M>> pairs, wall_pairs;
    std::vector<int> sharer_begin{0}, sharers;  // ranks with a copy of each grain, ascending, this one included
    Links links;                                // to every rank that shares a grain
    std::vector<std::vector<int>> linked;       // per link: the grains shared, by ascending id

    // Set by the fine detection of each step (fine.hpp, multiplicity.hpp).
    ContactProblem<M> problem;
    Sweeper<M> sweeper;                    // the problem's fast form, while it is being solved
    std::vector<int> source, wall_source;  // candidate of each contact
    std::vector<char> active;              // per entry of sharers: has that copy a contact in this step?
    std::vector<int> interface;            // grains with this and another active copy, by ascending id
    std::vector<int> wall_active;  // per wall and rank (wall * size + rank) of driven walls; empty where none is

    std::size_t first_sharer(std::size_t grain) const { return static_cast<std::size_t>(sharer_begin[grain]); }
    std::size_t last_sharer(std::size_t grain) const { return static_cast<std::size_t>(sharer_begin[grain + 1]); }

    // The copy that speaks for its grain in sums over the scene.
    bool primary(std::size_t grain) const { return sharers[first_sharer(grain)] == rank; }

    // Number of active copies, at least 1.
    int multiplicity(std::size_t grain) const {
        int count = 0;
        for (std::size_t s = first_sharer(grain); s < last_sharer(grain); ++s) count += active[s];
        return count > 0 ? count : 1;
    }
};

}  // namespace nscdd
