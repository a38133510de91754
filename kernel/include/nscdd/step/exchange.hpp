/// @file
/// Grains that enter and leave a simulation between two steps: Simulation::insert() and Simulation::remove().
#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "nscdd/decompose/directory.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Drops the grains with these ids, which ascend, from a subdomain; what is left has the ids that `numbering` says. The
/// problem of the last step is dropped as well, since its numbers are those of other grains.
template <class M>
void drop_grains(Subdomain<M>& part, const std::vector<int>& gone, typename Simulation<M>::Numbering numbering) {
    std::vector<int> renamed(part.grains.size(), -1);
    std::vector<Grain<M>> kept;
    std::vector<typename M::Vec> positions;
    std::vector<int> begin{0}, replicas;
    for (std::size_t g = 0; g < part.grains.size(); ++g) {
        const auto below = std::lower_bound(gone.begin(), gone.end(), part.grains[g].id);
        if (below != gone.end() && *below == part.grains[g].id) continue;
        renamed[g] = static_cast<int>(kept.size());
        kept.push_back(part.grains[g]);
        if (numbering == Simulation<M>::Numbering::closed_up) kept.back().id -= static_cast<int>(below - gone.begin());
        positions.push_back(part.broad_phase_position[g]);
        for (std::size_t s = part.first_replica(g); s < part.last_replica(g); ++s) replicas.push_back(part.replicas[s]);
        begin.push_back(static_cast<int>(replicas.size()));
    }
    part.grains.swap(kept);
    part.broad_phase_position.swap(positions);
    part.replica_begin.swap(begin);
    part.replicas.swap(replicas);
    const auto place = [&renamed](int g) { return renamed[static_cast<std::size_t>(g)]; };
    std::erase_if(part.pairs, [&](const auto& c) { return place(c.i) < 0 || place(c.j) < 0; });
    std::erase_if(part.wall_pairs, [&](const auto& c) { return place(c.i) < 0; });
    for (auto& c : part.pairs) c.i = place(c.i), c.j = place(c.j);
    for (auto& c : part.wall_pairs) c.i = place(c.i);
}

/// Adds a grain that no other subdomain has, until the next broad phase.
template <class M>
void add_grain(Subdomain<M>& part, const Grain<M>& grain) {
    part.grains.push_back(grain);
    part.broad_phase_position.push_back(grain.position);
    part.replicas.push_back(part.rank);
    part.replica_begin.push_back(static_cast<int>(part.replicas.size()));
}

}  // namespace detail

template <class M>
void Simulation<M>::take_stock() {
    for (auto& part : parts_) {
        ContactProblem<M>& problem = part.problem;
        problem.bodies.clear();
        problem.contacts.clear();
        problem.wall_contacts.clear();
        problem.multiplicity.clear();
        problem.centres.clear();
        problem.radii.clear();
        part.source.clear();
        part.wall_source.clear();
    }
    momentum_changes_.clear();
    Stopwatch watch(comm_);
    count_grains();
    renew_broad_phase(0);
    watch.lap(seconds_.detect);
}

template <class M>
void Simulation<M>::insert(std::span<const Grain<M>> grains) {
    const Turn::Hold hold(comm_.turn(), "Simulation::insert");
    check_there();
    detail::throw_collectively(comm_, [&](std::size_t k) {
        if (k > 0) return;
        detail::check_grains<M>(grains, settings_.materials.count());
        if (settings_.cell.any_driven() && !grains.empty())
            throw std::invalid_argument("Simulation::insert: sides of the cell are driven for the grains it has");
    });
    detail::check_ids<M>(parts_, comm_, grains);
    for (const Grain<M>& grain : grains) detail::add_grain(parts_[0], grain);
    take_stock();
}

template <class M>
std::vector<Grain<M>> Simulation<M>::remove(const std::function<bool(const Grain<M>&)>& which, Numbering numbering) {
    const Turn::Hold hold(comm_.turn(), "Simulation::remove");
    check_there();
    std::vector<Grain<M>> removed;
    std::vector<Communicator::Outbox> out(parts_.size());
    for (std::size_t k = 0; k < parts_.size(); ++k)
        for (std::size_t g = 0; g < parts_[k].grains.size(); ++g) {
            const Grain<M>& grain = parts_[k].grains[g];
            if (!parts_[k].primary(g) || !which(grain)) continue;
            removed.push_back(grain);
            for (int rank = 0; rank < comm_.size(); ++rank) out[k][rank].push_back(grain.id);
        }
    const std::vector<Buffer> told = comm_.route(out);
    std::vector<int> gone(told[0].begin(), told[0].end());
    if (gone.empty()) return removed;
    std::sort(gone.begin(), gone.end());
    for (auto& part : parts_) detail::drop_grains(part, gone, numbering);
    take_stock();
    return removed;
}

}}  // namespace nscdd::NSCDD_ABI
