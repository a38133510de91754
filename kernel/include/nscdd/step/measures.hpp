#pragma once

#include <cmath>

#include "nscdd/step/foot.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Sums over the scene that describe a state, for checks and reports. Collective.
template <class M>
struct Measures {
    using Tensor = Eigen::Matrix<double, M::dim, M::dim, Eigen::DontAlign>;  ///< in world axes
    static constexpr int rotations = M::dim == 3 ? 3 : 1;                    ///< number of axes to turn about

    double kinetic_energy = 0;                  ///< of the grains [J]
    typename M::Vec momentum = M::Vec::Zero();  ///< of the grains [kg m/s]
    /// A vector with a component for each axis to turn about.
    using Rotation = Eigen::Matrix<double, rotations, 1, Eigen::DontAlign>;
    Rotation angular_momentum = Rotation::Zero();  ///< of the grains about the origin, spins included [kg m^2/s]
    /// Sum of f (x) branch vector [N m]. Over the volume it is the stress, positive in pressure.
    Tensor virial = Tensor::Zero();
    double contacts = 0;         ///< number of contacts that carry (carries_impulse())
    double wall_contacts = 0;    ///< of them with walls
    double grains_volume = 0;    ///< of the grains [m^3], area [m^2] in 2D
    double touched = 0;          ///< grains with a contact that carries; observe() counts exactly, measure() nearly
    double forces = 0;           ///< of the contacts that carry, their lengths added up [N]
    double largest_overlap = 0;  ///< [m], of grains near each other, and of the last step's contacts with walls, now

    /// Members that reduce() adds up over subdomains.
    auto summed() {
        return std::tie(kinetic_energy, momentum, angular_momentum, virial, contacts, wall_contacts, grains_volume,
                        touched, forces);
    }
    auto largest() { return std::tie(largest_overlap); }  ///< members of which reduce() takes the largest

    /// Contacts per grain that carries, walls counted on the grain's side alone; 0 when none does.
    double coordination() const { return touched > 0 ? (2 * contacts - wall_contacts) / touched : 0; }
    /// |trace of the virial| / dim: the mean stress of the contacts times the volume, whatever that is [J].
    double pressure_work() const { return std::abs(virial.trace()) / M::dim; }
    double mean_force() const { return contacts > 0 ? forces / contacts : 0; }  ///< of contacts that carry [N]
};

namespace detail {

/// True if the normal impulse of a contact is not zero: it pushes or, by a law that lets it, pulls. The laws on
/// Coulomb's cone can only push; what round-off leaves below zero does not count.
template <class M>
bool carries_impulse(const Contact<M>& c) {
    double normal = c.r[0];
    if constexpr (M::friction) normal = force_of<M>(c.r).dot(c.normal);
    return SolvedOnCone<typename M::Law> ? normal > 0 : normal != 0;
}

/// Whether it has a part in the stress. By a law that pulls a contact may have a tangential impulse and no normal one.
template <class M>
bool acts_on_grains(const Contact<M>& c) {
    return SolvedOnCone<typename M::Law> ? carries_impulse<M>(c) : (c.r.array() != 0).any();
}

}  // namespace detail

/// Measures of a simulation after a step. Collective.
template <class M>
Measures<M> measure(const Simulation<M>& simulation) {
    constexpr int dim = M::dim;
    const double h = simulation.settings().h;
    return reduce<Measures<M>>(simulation.comm(), [&](std::size_t part_index) {
        const Subdomain<M>& part = simulation.parts()[part_index];
        Measures<M> m;
        std::vector<int> carried(part.grains.size(), 0);
        const auto grain = [&](int k) -> const Grain<M>& { return part.grains[static_cast<std::size_t>(k)]; };
        for (const auto& c : part.problem.contacts) {
            const typename M::Vec branch = part.cell.apart(grain(c.i).position, grain(c.j).position);
            if (detail::carries_impulse<M>(c))
                m.forces += c.r.norm() / h, ++m.contacts, ++carried[static_cast<std::size_t>(c.i)],
                    ++carried[static_cast<std::size_t>(c.j)];
            if (!detail::acts_on_grains<M>(c)) continue;
            m.virial += detail::impulse_vector<M>(c.r, c.normal) / h * branch.transpose();
        }
        // Rebounds may close pairs that were no contacts.
        for (const auto& pair : part.pairs)
            m.largest_overlap = (std::max)(m.largest_overlap,
                                           grain(pair.i).radius + grain(pair.j).radius -
                                               part.cell.apart(grain(pair.i).position, grain(pair.j).position).norm());
        for (const auto& c : part.problem.wall_contacts) {
            const auto [distance, normal] = detail::foot_of(simulation, part_index, c);
            m.largest_overlap = (std::max)(m.largest_overlap, grain(c.i).radius - distance);
            if (detail::carries_impulse<M>(c))
                m.forces += c.r.norm() / h, ++m.contacts, ++m.wall_contacts, ++carried[static_cast<std::size_t>(c.i)];
            if (!detail::acts_on_grains<M>(c)) continue;
            m.virial += detail::impulse_vector<M>(c.r, c.normal) / h * (distance * normal).transpose();
        }
        for (std::size_t g = 0; g < part.grains.size(); ++g) {
            if (!part.primary(g)) continue;
            const Grain<M>& body = part.grains[g];
            m.grains_volume += make_grain<M>(0, body.radius, 1.0, body.position).mass;
            if (body.fixed()) continue;
            const typename M::Vec p = body.mass * body.velocity.template head<dim>();
            m.kinetic_energy += body.kinetic_energy();
            m.momentum += p;
            const typename M::Vec& x = body.position;
            if constexpr (dim == 3)
                m.angular_momentum +=
                    typename M::Vec{x[1] * p[2] - x[2] * p[1], x[2] * p[0] - x[0] * p[2], x[0] * p[1] - x[1] * p[0]};
            else
                m.angular_momentum[0] += x[0] * p[1] - x[1] * p[0];
            if constexpr (M::friction) m.angular_momentum += body.inertia * body.velocity.template tail<M::spins>();
        }
        // Each copy that carries counts 1/multiplicity: exact but for interface grains with a copy that carries
        // nothing, of which only a part is counted.
        for (std::size_t g = 0; g < part.grains.size(); ++g)
            m.touched += carried[g] > 0 ? 1.0 / part.problem.multiplicity[g] : 0.0;
        return m;
    });
}

namespace detail {

struct LargestOf {
    double value = 0;
    auto summed() { return std::tie(); }
    auto largest() { return std::tie(value); }
};

/// The largest force that was left on a grain in the last step: mass times change of velocity over h [N]. It is 0 in
/// equilibrium, and before the first step. Over Measures::mean_force() it is the unbalanced force ratio. Collective.
template <class M>
double largest_net_force(const Simulation<M>& simulation) {
    return reduce<LargestOf>(simulation.comm(),
                             [&](std::size_t k) {
                                 return LargestOf{simulation.largest_momentum_change(k) / simulation.settings().h};
                             })
        .value;
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
