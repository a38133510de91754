// Whether a step ends the run, by [stop] of the scene. All ranks come to the same answer.
#pragma once

#include "model/build_scene.hpp"
#include "nscdd/step/observables.hpp"

namespace nscdd {

template <class M>
class StopTest {
  public:
    // so_far: of the scene, kept up to date here where a strain is asked for.
    StopTest(const Simulation<M>& simulation, const Scene& scene, State::SoFar& so_far)
        : settings_(scene.stop), exchange_(scene.exchange), so_far_(so_far) {
        const StopSettings& settings = settings_;
        if (settings.nothing_left) fixed_ = count_fixed(simulation);
        if (!settings.strain || !so_far.edges.empty()) return;
        const typename M::Vec edges = box_edges<M>(simulation.settings());
        so_far.edges.assign(edges.begin(), edges.end());
        so_far.flowed.assign(M::dim * M::dim, 0.0);
    }

    // After each step, with the time of the scene. Collective.
    std::optional<Stopped> after(const Simulation<M>& simulation, double time) {
        const bool some_left = !so_far_.left.empty() && so_far_.left[0] > 0;
        if (settings_.nothing_left && some_left && simulation.grain_count() == fixed_ &&
            exchange_.all_inserted(so_far_.inserted))
            return Stopped{"nothing_left", 0, 0, ""};
        if (settings_.time && time >= *settings_.time) return Stopped{"time", time, *settings_.time, "s"};
        if (settings_.strain)
            if (const double strain = largest_strain(simulation); strain >= *settings_.strain)
                return Stopped{"strain", strain, *settings_.strain, ""};
        if (!settings_.of_rest() || time < settings_.after || simulation.grain_count() == 0) return {};
        const Measures<M> m = measure(simulation);
        const double work = m.pressure_work();
        if (const auto& most = settings_.kinetic_energy_over_work; most && m.kinetic_energy <= *most * work)
            if (work > 0) return Stopped{"kinetic_energy_over_work", m.kinetic_energy / work, *most, ""};
        if (const auto& most = settings_.largest_unbalanced_force; most && m.contacts > 0) {
            const double ratio = detail::largest_net_force(simulation) / m.mean_force();
            if (ratio <= *most) return Stopped{"largest_unbalanced_force", ratio, *most, ""};
        }
        return {};
    }

  private:
    static std::size_t count_fixed(const Simulation<M>& simulation) {
        return static_cast<std::size_t>(reduce(simulation.comm(), 1, [&simulation](std::size_t k) {
            const Subdomain<M>& part = simulation.parts()[k];
            double count = 0;
            for (std::size_t g = 0; g < part.grains.size(); ++g) count += part.primary(g) && part.grains[g].fixed();
            return Buffer{count};
        })[0]);
    }

    // |ln(edge at the start / edge now)| of the axis where it is largest. Of a cell that flows also the gradients times
    // the step, added up, of which the entries off the diagonal are shear. Called once a step.
    double largest_strain(const Simulation<M>& simulation) {
        const SimulationSettings<M>& settings = simulation.settings();
        const typename M::Vec now = box_edges<M>(settings);
        double most = 0;
        for (int d = 0; d < M::dim; ++d)
            if (const double start = so_far_.edges[static_cast<std::size_t>(d)]; start > 0)
                most = std::max(most, std::abs(std::log(start / now[d])));
        for (std::size_t k = 0; k < so_far_.flowed.size(); ++k) {
            so_far_.flowed[k] += settings.h * settings.cell.gradient.data()[k];
            most = std::max(most, std::abs(so_far_.flowed[k]));
        }
        return most;
    }

    const StopSettings& settings_;
    const SceneExchange& exchange_;
    State::SoFar& so_far_;
    std::size_t fixed_ = 0;  // grains, which stay
};

}  // namespace nscdd
