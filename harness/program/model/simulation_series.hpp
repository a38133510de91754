// Rows of the time series of a simulation: reports/series.md says what is in them.
#pragma once

#include "files/series.hpp"
#include "model/simulation_state.hpp"
#include "nscdd/step/observables.hpp"

namespace nscdd {

// Makes the rows of one run; all ranks compute them. Sums over the run begin with the first row.
template <class M>
class SeriesRows {
  public:
    static constexpr int dim = M::dim;
    // On the column energy_error: works of a step are exact but for round-off.
    static constexpr double energy_tolerance = 1e-10;

    SeriesRows(const Simulation<M>& simulation, const Scene& scene, const State::SoFar& before)
        : start_(edges(simulation)), last_(start_), came_(before.came), left_(before.left) {
        for (const auto& wall : scene.walls) walls_.push_back(wall.name);
        for (const auto& obstacle : scene.obstacles) obstacles_.push_back(obstacle.name);
    }

    SeriesHead head(const Simulation<M>& simulation, const std::string& scene) const {
        return {scene, dim, simulation.settings().h, energy_tolerance, list(start_)};
    }

    // After each step, with its number and time. Collective.
    SeriesRow next(const Simulation<M>& simulation, const StepReport& report, std::int64_t step, double time,
                   const State::SoFar& so_far) {
        const Observables<M> seen = observe(simulation);
        const Measures<M>& m = seen.measures;
        const Vec box = edges(simulation);
        const double volume = box.prod(), h = simulation.settings().h;
        const Tensor stress = m.virial / volume;
        const Vec strain = (start_.array() / box.array()).log(), rate = (last_.array() / box.array()).log() / h;
        last_ = box;
        const std::string pressure = dim == 3 ? "Pa" : "N/m";

        SeriesRow row;
        add(row, "step", "1", "steps made since the start of the scene", static_cast<double>(step));
        add(row, "time", "s", "at the end of the step", time);
        add(row, "box", "m", "side of the cell along each axis, or distance of its two walls", box);
        add(row, "strain", "1", "ln(edge at the start of this run / edge now), positive in compression", strain);
        if (simulation.settings().cell.flows()) {
            sheared_ += h * simulation.settings().cell.gradient;
            add(row, "cell_gradient", "1/s", "of the flow of the cell; row: what moves, column: along what",
                Tensor(simulation.settings().cell.gradient));
            add(row, "cell_strain", "1", "the gradients of this run times the step, added up: shear off the diagonal",
                Tensor(sheared_));
        }
        add(row, "stress_contacts", pressure,
            "sum of force (x) branch vector over the contacts, over the volume of the box, positive in compression",
            stress);
        add(row, "stress_walls", pressure, "mean normal force on the two walls of each axis over their area",
            stress_walls(simulation, seen.wall_force, box));
        if (!walls_.empty())
            add(row, "wall_normal_force", "N", "of the grains on each wall, positive out of the sample",
                normal_forces(simulation, seen.wall_force));
        if (!walls_.empty())
            add(row, "wall_force", "of the grains on each wall, mean of the step", walls_, seen.wall_force);
        if (!obstacles_.empty())
            add(row, "obstacle_force", "of the grains on each obstacle, mean of the step", obstacles_,
                seen.obstacle_force);
        add(row, "solid_fraction", "1", "volume of the grains over that of the box", m.grains_volume / volume);
        add(row, "coordination", "1", "contacts that carry, per grain that has one",
            m.touched > 0 ? m.coordination() : NAN);
        add(row, "rattlers", "1", "share of grains without a contact that carries", seen.rattlers());
        add(row, "fabric", "1", "mean of normal (x) normal over contacts that carry", seen.fabric);
        add(row, "kinetic_energy", "J", "of the grains", m.kinetic_energy);
        add(row, "kinetic_energy_walls", "J",
            "of the walls that a force drives, and of the sides of the cell that a stress drives",
            energy_of_walls(simulation));
        add(row, "kinetic_energy_over_work", "1", "kinetic energy of the grains over mean stress times volume",
            m.kinetic_energy / m.pressure_work());
        add(row, "unbalanced_force", "1",
            "largest force left on a grain, mass times change of velocity over h, over the mean force of contacts that "
            "carry",
            detail::largest_net_force(simulation) / m.mean_force());
        const Cell<M>& cell = simulation.settings().cell;
        const double mean_stress = stress.trace() / dim,
                     fastest = std::max(rate.cwiseAbs().maxCoeff(), cell.gradient.cwiseAbs().maxCoeff());
        add(row, "inertial_number", "1",
            "largest strain rate, or entry of the cell's velocity gradient, times mean diameter times sqrt(density of "
            "the grains / mean stress)",
            mean_stress > 0 ? fastest * 2 * seen.mean_radius * std::sqrt(seen.density() / mean_stress) : NAN);
        if (!so_far.came.empty()) add_exchange(row, seen, so_far);
        add_energy(row, report.energy);
        add(row, "contacts", "1", "detected in the step, open ones included", report.contacts);
        add(row, "contacts_carrying", "1", "of them with a normal impulse", m.contacts);
        add(row, "iterations", "1", "of the solver", report.solve.iterations);
        add(row, "residual", "1", "eta at the end of the step", report.solve.residual);
        return row;
    }

  private:
    using Vec = typename M::Vec;
    using Tensor = typename Measures<M>::Tensor;

    static std::vector<double> list(const Vec& v) { return {v.data(), v.data() + dim}; }

    // NaN where nothing repeats and there are no two walls.
    static Vec edges(const Simulation<M>& simulation) {
        const Vec box = box_edges<M>(simulation.settings());
        return (box.array() > 0).select(box, NAN);
    }

    void add(SeriesRow& row, const std::string& name, const std::string& unit, const std::string& meaning,
             double value) const {
        row.push_back({name, unit, meaning, {}, {}, {value}});
    }
    void add(SeriesRow& row, const std::string& name, const std::string& unit, const std::string& meaning,
             const Vec& vector) const {
        row.push_back({name, unit, meaning, {dim}, {}, list(vector)});
        for (int i = 0; i < dim; ++i) row.back().labels.emplace_back(1, "xyz"[i]);
    }
    void add(SeriesRow& row, const std::string& name, const std::string& unit, const std::string& meaning,
             const Tensor& tensor) const {
        row.push_back({name, unit, meaning, {dim, dim}, {}, {}});
        for (int i = 0; i < dim; ++i)
            for (int j = 0; j < dim; ++j) {
                row.back().labels.push_back({"xyz"[i], "xyz"[j]});
                row.back().values.push_back(tensor(i, j));
            }
    }
    void add(SeriesRow& row, const std::string& name, const std::string& unit, const std::string& meaning,
             const std::vector<double>& of_walls) const {
        row.push_back({name, unit, meaning, {of_walls.size()}, walls_, of_walls});
    }

    static void add(SeriesRow& row, const std::string& name, const std::string& meaning,
                    const std::vector<std::string>& of, const std::vector<Vec>& force) {
        row.push_back({name, "N", meaning, {force.size(), dim}, {}, {}});
        for (std::size_t k = 0; k < force.size(); ++k)
            for (int d = 0; d < dim; ++d) {
                std::string& label = row.back().labels.emplace_back(of[k]);
                (label += '_') += "xyz"[d];
                row.back().values.push_back(force[k][d]);
            }
    }

    static double energy_of_walls(const Simulation<M>& simulation) {
        double energy = 0;
        for (const auto& wall : simulation.walls())
            if (wall.driven) energy += 0.5 * wall.mass * wall.speed * wall.speed;
        const Cell<M>& cell = simulation.settings().cell;
        for (int d = 0; d < dim; ++d)
            if (cell.driven[static_cast<std::size_t>(d)])
                energy += 0.5 * cell.mass * std::pow(cell.gradient(d, d) * cell.length, 2);
        return energy;
    }
    static std::vector<double> normal_forces(const Simulation<M>& simulation, const std::vector<Vec>& force) {
        std::vector<double> normal;
        for (std::size_t w = 0; w < force.size(); ++w) normal.push_back(-force[w].dot(simulation.walls()[w].normal));
        return normal;
    }
    static Vec stress_walls(const Simulation<M>& simulation, const std::vector<Vec>& force, const Vec& box) {
        const std::vector<double> normal = normal_forces(simulation, force);
        const auto pairs = opposite_walls<M>(simulation.walls());
        Vec stress = Vec::Constant(NAN);
        for (int d = 0; d < dim; ++d) {
            const OppositeWalls& pair = pairs[static_cast<std::size_t>(d)];
            if (!pair.both()) continue;
            double area = 1;
            for (int e = 0; e < dim; ++e)
                if (e != d) area *= box[e];
            stress[d] =
                0.5 * (normal[static_cast<std::size_t>(pair.low)] + normal[static_cast<std::size_t>(pair.high)]) / area;
        }
        return stress;
    }

    // Adds what entered and left the scene so far; what did so before the step changes the balance of this run.
    void add_exchange(SeriesRow& row, const Observables<M>& seen, const State::SoFar& so_far) {
        came_.resize(State::SoFar::amounts), left_.resize(State::SoFar::amounts);
        if (steps_ > 0) {
            const double in = so_far.came[2] - came_[2], out = so_far.left[2] - left_[2];
            initial_ += in - out;
            scale_ += in + out;
        }
        came_ = so_far.came, left_ = so_far.left;
        add(row, "grains", "1", "in the scene", seen.grains);
        add(row, "mass", "kg", "of the grains", seen.mass);
        const std::pair<const char*, const char*> names[] = {{"grains", "1"}, {"mass", "kg"}, {"energy", "J"}};
        for (const auto& [way, amounts] : {std::pair("inserted", &came_), std::pair("removed", &left_)})
            for (std::size_t n = 0; n < State::SoFar::amounts; ++n)
                add(row, std::string(names[n].first) + '_' + way, names[n].second,
                    std::string("of what was ") + way + " since the start of the scene" +
                        (n == 2 ? ": kinetic energy" : ""),
                    (*amounts)[n]);
    }

    // Adds the energy terms of the step and of the run so far. The balance begins with the kinetic energy before the
    // run.
    void add_energy(SeriesRow& row, const StepReport::Energy& e) {
        if (steps_++ == 0) initial_ = e.before;
        const std::pair<const char*, const char*> names[] = {
            {"work_external", "work of gravity and of the grains' loads"},
            {"work_walls", "work of the walls on grains, of the forces on driven walls, and of the flow of the cell"},
            {"dissipated_impact", "energy that the contacts take along their normals"},
            {"dissipated_friction", "energy that they take along their tangents"}};
        const double terms[] = {e.external, e.walls, -e.normal, -e.friction};
        for (std::size_t k = 0; k < 4; ++k) {
            total_[k] += terms[k];
            scale_ += std::abs(terms[k]);
            add(row, names[k].first, "J", names[k].second + std::string(", in the step"), terms[k]);
        }
        for (std::size_t k = 0; k < 4; ++k)
            add(row, names[k].first + std::string("_total"), "J", names[k].second + std::string(", in the run so far"),
                total_[k]);
        const double open = e.kinetic - initial_ - total_[0] - total_[1] + total_[2] + total_[3];
        const double scale = scale_ + initial_ + e.kinetic;
        add(row, "energy_error", "1",
            "|kinetic energy - that before the run - works + energies dissipated|, of the run so far, over the sum of "
            "the absolute values of all these terms, step by step",
            scale > 0 ? std::abs(open) / scale : 0);
    }

    typename M::Gradient sheared_ = M::Gradient::Zero();  // since the start of this run
    Vec start_, last_;                                    // edges of the box before the run and before the step [m]
    std::vector<std::string> walls_, obstacles_;
    std::vector<double> came_, left_;  // of the scene before the step
    double total_[4] = {0, 0, 0, 0};   // of the four terms of the balance [J]
    double initial_ = 0, scale_ = 0;   // [J]
    int steps_ = 0;
};

}  // namespace nscdd
