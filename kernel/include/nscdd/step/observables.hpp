// What a time series holds of one step: sums over the scene, so that no rank needs all grains or contacts. Collective.
#pragma once

#include <algorithm>
#include <vector>

#include "nscdd/step/measures.hpp"

namespace nscdd::inline NSCDD_ABI {

// W walls. A contact carries when carries_impulse() says so: it pushes or pulls.
template <class M>
struct Observables {
    Measures<M> measures;                     // `touched` is exact here
    typename Measures<M>::Tensor fabric;      // mean of n (x) n over contacts that carry [1]; NaN of none
    double grains = 0;                        // in the scene
    double mass = 0;                          // of the grains [kg]
    double mean_radius = 0;                   // [m]
    std::vector<typename M::Vec> wall_force;  // (W) of the grains on each wall, mean of the step [N]

    double rattlers() const { return 1 - measures.touched / grains; }  // share of grains without a contact that carries
    double density() const { return mass / measures.grains_volume; }   // of the grains [kg/m^3], [kg/m^2] in 2D
};

namespace detail {

// Grains with a contact that carries, in whichever of their copies: the owner of a grain is told by the others.
template <class M>
std::vector<double> carrying_grains(const Simulation<M>& simulation) {
    const auto& parts = simulation.parts();
    std::vector<std::vector<char>> carries(parts.size());
    std::vector<Outbox> out(parts.size());
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
                out[k][part.sharers[part.first_sharer(g)]].push_back(double(part.grains[g].id));
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

// Observables of a simulation after a step. Collective.
template <class M>
Observables<M> observe(const Simulation<M>& simulation) {
    constexpr int dim = M::dim;
    constexpr std::size_t tensor = dim * dim;
    const std::size_t walls = simulation.walls().size();
    const double h = simulation.settings().h;
    Observables<M> total;
    total.measures = measure(simulation);
    const std::vector<double> touched = detail::carrying_grains(simulation);
    const std::size_t size = tensor + dim * walls + 3;
    const std::span<const double> all = reduce(simulation.comm(), size, [&](std::size_t k) {
        const Subdomain<M>& part = simulation.parts()[k];
        typename Measures<M>::Tensor fabric = Measures<M>::Tensor::Zero();
        std::vector<typename M::Vec> force(walls, M::Vec::Zero());
        for (const auto& c : part.problem.contacts)
            if (carries_impulse<M>(c)) fabric += c.normal * c.normal.transpose();
        for (const auto& c : part.problem.wall_contacts) {
            if (carries_impulse<M>(c)) fabric += c.normal * c.normal.transpose();
            force[static_cast<std::size_t>(c.j)] -= impulse_vector<M>(c.r, c.normal) / h;
        }
        Buffer out(fabric.data(), fabric.data() + tensor);
        for (const auto& f : force) out.insert(out.end(), f.data(), f.data() + dim);
        double mass = 0, radii = 0;
        for (std::size_t g = 0; g < part.grains.size(); ++g)
            if (part.primary(g)) mass += part.grains[g].mass, radii += part.grains[g].radius;
        out.insert(out.end(), {touched[k], mass, radii});
        return out;
    });
    const double* in = all.data();
    const double contacts = total.measures.contacts;
    total.fabric = Eigen::Map<const Eigen::Matrix<double, dim, dim>>(in) / (contacts > 0 ? contacts : NAN);
    in += tensor;
    for (std::size_t w = 0; w < walls; ++w, in += dim)
        total.wall_force.emplace_back(Eigen::Map<const typename M::Vec>(in));
    total.grains = static_cast<double>(simulation.grain_count());
    total.measures.touched = in[0];
    total.mass = in[1];
    total.mean_radius = in[2] / total.grains;
    return total;
}

}  // namespace nscdd
