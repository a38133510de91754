/// @file
/// The content of a time series for one step: sums over the scene, so that no rank needs all grains or contacts.
/// Collective.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "nscdd/step/measures.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Sums over the scene after a step; there are W walls. A contact carries when carries_impulse() says so: it pushes or
/// pulls.
template <class M>
struct Observables {
    Measures<M> measures;                         ///< `touched` is exact here
    typename Measures<M>::Tensor fabric;          ///< mean of n (x) n over contacts that carry [1]; NaN of none
    double grains = 0;                            ///< in the scene
    double mass = 0;                              ///< of the grains, but those that are fixed [kg]
    double moving_volume = 0;                     ///< of the same grains [m^3], area [m^2] in 2D
    double mean_radius = 0;                       ///< [m]
    std::vector<typename M::Vec> wall_force;      ///< (W) force of the grains on each wall, mean of the step [N]
    std::vector<typename M::Vec> obstacle_force;  ///< the same on each obstacle

    /// Share of grains without a contact that carries.
    double rattlers() const { return 1 - measures.touched / grains; }
    double density() const { return mass / moving_volume; }  ///< of the grains [kg/m^3], [kg/m^2] in 2D
};

namespace detail {

template <class M>
struct ObservedSums {
    typename Measures<M>::Tensor fabric = Measures<M>::Tensor::Zero();
    double touched = 0, mass = 0, moving_volume = 0, radii = 0;
    auto summed() { return std::tie(fabric, touched, mass, moving_volume, radii); }
    auto largest() { return std::tie(); }
};

/// Grains with a contact that carries, in any of their copies: the other subdomains tell the owner of a grain.
template <class M>
std::vector<double> carrying_grains(const Simulation<M>& simulation) {
    const auto& parts = simulation.parts();
    std::vector<std::vector<char>> carries(parts.size());
    std::vector<Communicator::Outbox> out(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const Subdomain<M>& part = parts[k];
        carries[k].resize(part.grains.size());
        const auto mark = [&](int g) { carries[k][static_cast<std::size_t>(g)] = 1; };
        for (const auto& c : part.problem.contacts)
            if (carries_impulse<M>(c)) mark(c.i), mark(c.j);
        for (const auto& c : part.problem.wall_contacts)
            if (carries_impulse<M>(c)) mark(c.i);
        for (std::size_t g = 0; g < part.grains.size(); ++g)
            if (carries[k][g] && !part.primary(g))
                out[k][part.replicas[part.first_replica(g)]].push_back(double(part.grains[g].id));
    }
    std::vector<Buffer> told = simulation.comm().route(out);
    std::vector<double> counts;
    for (std::size_t k = 0; k < parts.size(); ++k) {
        std::sort(told[k].begin(), told[k].end());
        double& count = counts.emplace_back(0.0);
        for (std::size_t g = 0; g < parts[k].grains.size(); ++g)
            if (parts[k].primary(g))
                count +=
                    carries[k][g] || std::binary_search(told[k].begin(), told[k].end(), double(parts[k].grains[g].id));
    }
    return counts;
}

}  // namespace detail

/// Observables of a simulation after a step. Collective.
template <class M>
Observables<M> observe(const Simulation<M>& simulation) {
    using Vec = typename M::Vec;
    const auto& parts = simulation.parts();
    const Turn::Hold hold(simulation.comm().turn(), "observe");
    Observables<M> total;
    total.measures = measure(simulation);
    const std::vector<double> touched = detail::carrying_grains(simulation);
    const auto sums = reduce<detail::ObservedSums<M>>(simulation.comm(), [&](std::size_t k) {
        detail::ObservedSums<M> sum;
        for (const auto* contacts : {&parts[k].problem.contacts, &parts[k].problem.wall_contacts})
            for (const Contact<M>& c : *contacts)
                if (detail::carries_impulse<M>(c)) sum.fabric += c.normal * c.normal.transpose();
        sum.touched = touched[k];
        for (std::size_t g = 0; g < parts[k].grains.size(); ++g) {
            if (!parts[k].primary(g)) continue;
            const Grain<M>& grain = parts[k].grains[g];
            sum.radii += grain.radius;
            if (grain.fixed()) continue;
            sum.mass += grain.mass;
            sum.moving_volume += make_grain<M>(0, grain.radius, 1.0, grain.position).mass;
        }
        return sum;
    });
    const std::size_t walls = simulation.walls().size();
    const std::size_t bodies = walls + simulation.settings().obstacles.size();
    const std::span<const double> forces = reduce(simulation.comm(), M::dim * bodies, [&](std::size_t k) {
        Buffer on_them(M::dim * bodies);
        for (const auto& c : parts[k].problem.wall_contacts) {
            auto body = static_cast<std::size_t>(c.j);
            if (body >= walls) body = walls + parts[k].obstacles->name(parts[k].number_of(c, walls)).obstacle;
            Eigen::Map<Vec>(&on_them[M::dim * body]) -=
                detail::impulse_vector<M>(c.r, c.normal) / simulation.settings().h;
        }
        return on_them;
    });
    for (std::size_t b = 0; b < bodies; ++b)
        (b < walls ? total.wall_force : total.obstacle_force).emplace_back(Eigen::Map<const Vec>(&forces[M::dim * b]));
    const double contacts = total.measures.contacts;
    total.fabric = sums.fabric / (contacts > 0 ? contacts : std::numeric_limits<double>::quiet_NaN());
    total.grains = static_cast<double>(simulation.grain_count());
    total.measures.touched = sums.touched;
    total.mass = sums.mass;
    total.moving_volume = sums.moving_volume;
    total.mean_radius = sums.radii / total.grains;
    return total;
}

}}  // namespace nscdd::NSCDD_ABI
