/// @file
/// The start of a simulation: whose grains are whose, and where one that was stored goes on.
#pragma once

#include <stdexcept>
#include <vector>

#include "nscdd/decompose/directory.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

template <class M>
Simulation<M>::Simulation(Communicator& comm, SimulationSettings<M> settings, std::span<const Grain<M>> grains,
                          std::span<const PairImpulse<M>> impulses, const BroadPhaseState<M>* last)
    : comm_(comm), settings_(std::move(settings)) {
    const Turn::Hold hold(comm_.turn(), "Simulation");
    detail::check_settings(settings_);
    detail::throw_collectively(comm_, [&](std::size_t k) {
        if (k > 0) return;
        detail::check_grains<M>(grains, settings_.materials.count());
        detail::check_impulses<M>(impulses);
        if (last) detail::check_broad_phase(*last, grains.size(), settings_.walls.size());
    });
    for (int rank : comm_.ranks()) {
        Subdomain<M>& part = parts_.emplace_back();
        part.rank = rank;
    }
    for (const auto& grain : grains) {
        parts_[0].grains.push_back(grain);
        parts_[0].replicas.push_back(parts_[0].rank);
        parts_[0].replica_begin.push_back(static_cast<int>(parts_[0].replicas.size()));
    }
    detail::check_ids<M>(parts_, comm_);
    count_grains();
    if (grains_ == 0 && !settings_.may_be_empty) throw std::invalid_argument("the scene has no grains");
    settings_.cell.length = 2 * radii_.largest;
    follow_paths();
    detail::check_cell<M>(settings_.cell, settings_.walls, radii_.largest, mass_);
    for (auto& part : parts_) part.cell = settings_.cell;
    Stopwatch watch(comm_);
    if (last) place_obstacles(last->time);
    if (last) broad_.repeat(parts_, comm_, settings_, radii_, *last);
    place_obstacles(time(0));
    if (!last) renew_broad_phase(0);
    std::vector<std::vector<PairImpulse<M>>> handed(parts_.size());
    handed[0].assign(impulses.begin(), impulses.end());
    detail::hand_out_impulses(parts_, comm_, handed);
    watch.lap(seconds_.detect);
}

template <class M>
void Simulation<M>::count_grains() {
    const detail::GrainCount all = detail::count_grains(parts_, comm_);
    grains_ = static_cast<std::size_t>(all.grains);
    radii_ = all.radii();
    mass_ = all.mass;
    for (auto& part : parts_) {
        part.problem.h = settings_.h;
        part.problem.least_radius = radii_.least;
    }
}

}}  // namespace nscdd::NSCDD_ABI
