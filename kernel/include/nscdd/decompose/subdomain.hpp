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
    std::vector<int> peers;                     // ranks that share a grain with this one, ascending
    std::vector<std::vector<int>> linked;       // per peer: the grains shared, by ascending id

    // Set by the fine detection of each step (fine.hpp, multiplicity.hpp).
    ContactProblem<M> problem;
    Sweeper<M> sweeper;                    // the problem's fast form, while it is being solved
    std::vector<int> source, wall_source;  // candidate of each contact
    std::vector<char> active;              // per entry of sharers: 1 if that copy has a contact in this step
    std::vector<int> interface;            // grains with this and another active copy, by ascending id
    // Per wall, 1 for driven walls that have a contact here in this step, and anywhere. Empty where no wall is driven.
    std::vector<char> wall_active, wall_touched;
    // Contacts of interface grains, at the front of the problem's lists: they are swept first.
    std::size_t interface_contacts = 0, interface_wall_contacts = 0;

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

// Links of the subdomains with their peers, for so many doubles a grain that they share.
template <class M>
std::vector<Links> links_between(const std::vector<Subdomain<M>>& parts, std::size_t doubles) {
    std::vector<Links> links(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t l = 0; l < parts[k].peers.size(); ++l) {
            const std::size_t size = parts[k].linked[l].size() * doubles;
            links[k].push_back({parts[k].peers[l], size, size});
        }
    return links;
}

}  // namespace nscdd
