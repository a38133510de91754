/// @file
/// Sums over the whole scene of a simulation: how many grains there are, how fast and far they move. Other sums say how
/// they would move without contacts.
#pragma once

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "nscdd/comm/reduce.hpp"
#include "nscdd/step/settings.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Of the grains.
struct Radii {
    double least = 0;    ///< over the whole scene [m]
    double largest = 0;  ///< over the whole scene [m]
};

/// Of the whole scene.
struct GrainCount {
    double grains = 0, mass = 0;  ///< number of grains, mass of all [kg]
    double minus_least = -std::numeric_limits<double>::infinity(), most = minus_least;  ///< radii [m]
    auto summed() { return std::tie(grains, mass); }
    auto largest() { return std::tie(minus_least, most); }
    Radii radii() const { return grains > 0 ? Radii{-minus_least, most} : Radii{1, 1}; }
};

/// Collective.
template <class M>
GrainCount count_grains(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
    return reduce<GrainCount>(comm, [&parts](std::size_t k) {
        GrainCount mine;
        for (std::size_t n = 0; n < parts[k].grains.size(); ++n) {
            if (!parts[k].primary(n)) continue;
            const Grain<M>& g = parts[k].grains[n];
            ++mine.grains;
            mine.minus_least = (std::max)(mine.minus_least, -g.radius);
            mine.most = (std::max)(mine.most, g.radius);
            if (!g.fixed()) mine.mass += g.mass;
        }
        return mine;
    });
}

/// Before the step, or of its problem.
enum class Velocities { known, solved };

/// Largest values over grains and walls; NaN where one is NaN.
struct Motion {
    double moved = 0;  ///< from where the candidates were found [m]
    double speed = 0;  ///< [m/s]
    auto summed() { return std::tie(); }
    auto largest() { return std::tie(moved, speed); }

    void note(double m, double s) {
        const auto larger = [](double a, double b) { return std::isnan(a) || a >= b ? a : b; };  // unlike std::max
        moved = larger(moved, m);
        speed = larger(speed, s);
    }
};

/// Where all is after `lookahead` [s] at these velocities. offsets: of the walls, when the candidates were found [m].
/// stretch: by the flow of the cell since then, which moves grains without taking them nearer. Collective.
template <class M>
Motion find_motion(const std::vector<Subdomain<M>>& parts, Communicator& comm, const std::vector<Wall<M>>& walls,
                   const std::vector<double>& offsets, const typename M::Gradient& stretch, Velocities which,
                   double lookahead) {
    Motion all = reduce<Motion>(comm, [&](std::size_t k) {
        const Subdomain<M>& part = parts[k];
        Motion mine;
        const bool flows = part.cell.flows();
        for (std::size_t g = 0; g < part.grains.size(); ++g) {
            typename M::Vec v = part.grains[g].velocity.template head<M::dim>();
            if (which == Velocities::solved) v = part.problem.bodies[g].linear();
            if (flows) {
                const typename M::Vec now = part.grains[g].position - part.cell.low;
                const typename M::Vec then = flow_over<M>(stretch, part.broad_phase_position[g] - part.cell.low);
                mine.note((now - then + lookahead * part.cell.with_flow(v, now - then)).norm(), v.norm());
                continue;
            }
            mine.note((part.grains[g].position + lookahead * v - part.broad_phase_position[g]).norm(), v.norm());
        }
        return mine;
    });
    for (std::size_t w = 0; w < walls.size(); ++w) {
        const double own = which == Velocities::solved ? parts[0].problem.walls[w].speed : walls[w].speed;
        const double speed = walls[w].velocity.dot(walls[w].normal) + own;
        all.note(std::abs(walls[w].offset + lookahead * speed - offsets[w]), std::abs(speed));
    }
    return all;
}

struct FreeState {
    double interface_grains = 0;  ///< grains with contacts in several subdomains
    double energy = 0;            ///< V_free^T M V_free [J]
    auto summed() { return std::tie(interface_grains, energy); }
    auto largest() { return std::tie(); }
};

/// Of problems that hold V_free. Collective.
template <class M>
FreeState find_free_state(const std::vector<Subdomain<M>>& parts, Communicator& comm,
                          const std::vector<Wall<M>>& walls) {
    FreeState all = reduce<FreeState>(comm, [&parts](std::size_t k) {
        const Subdomain<M>& part = parts[k];
        FreeState mine;
        for (std::size_t g = 0; g < part.grains.size(); ++g) {
            const Grain<M>& grain = part.grains[g];
            if (!part.primary(g) || grain.fixed()) continue;
            const Body<M>& body = part.problem.bodies[g];
            mine.interface_grains += part.problem.multiplicity[g] > 1;
            mine.energy += grain.mass * body.linear().squaredNorm() + grain.inertia * body.spin().squaredNorm();
        }
        return mine;
    });
    for (std::size_t w = 0; w < walls.size(); ++w)
        all.energy += walls[w].mass * std::pow(parts[0].problem.walls[w].speed, 2);
    for (std::size_t side = walls.size(); side < walls.size() + parts[0].cell.sides(); ++side)
        all.energy += parts[0].cell.mass * std::pow(parts[0].problem.walls[side].speed, 2);
    return all;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
