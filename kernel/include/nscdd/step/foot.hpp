#pragma once

#include "nscdd/step/simulation.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// From the nearest point of a wall or facet to the centre of a grain.
template <class M>
struct Foot {
    double distance;         ///< [m]; from a wall negative on its other side
    typename M::Vec normal;  ///< unit
};

/// Of a contact with a wall or an obstacle of a subdomain, as they are now. part: its place among those of the process.
template <class M>
Foot<M> foot_of(const Simulation<M>& simulation, std::size_t part, const Contact<M>& contact) {
    const Subdomain<M>& own = simulation.parts()[part];
    const typename M::Vec& centre = own.grains[static_cast<std::size_t>(contact.i)].position;
    const auto j = static_cast<std::size_t>(contact.j);
    if (j < simulation.walls().size()) {
        const Wall<M>& wall = simulation.walls()[j];
        return {wall.distance(centre), wall.normal};
    }
    const Closest<M> closest =
        own.obstacles->closest(own.number_of(contact, simulation.walls().size()), own.obstacles->now(), centre);
    return {closest.distance, closest.normal};
}

}}}  // namespace nscdd::NSCDD_ABI::detail
