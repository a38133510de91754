/// @file
/// The scene on rank 0, for output: all of it, or one range of ids after the other where it would not fit. Collective.
#pragma once

#include <limits>

#include "nscdd/decompose/serialise.hpp"
#include "nscdd/step/foot.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A grain, and the data of it that subdomains have.
template <class M>
struct GatheredGrain {
    Grain<M> grain;                        ///< as it is now
    typename M::Vec broad_phase_position;  ///< of its centre, when the candidates were found [m]
    int subdomain;                         ///< rank that speaks for it
    int multiplicity;                      ///< active copies in the last step
};

namespace detail {

/// A range of grains, or of contacts by their grain i: from `begin` up to but without `end`.
struct Ids {
    int begin = 0;                                                  ///< the first id
    int end = (std::numeric_limits<int>::max)();                    ///< one after the last
    bool contain(int id) const { return begin <= id && id < end; }  ///< whether an id is in the range
};

}  // namespace detail

/// A contact of the last step. Vectors are in world axes.
template <class M>
struct GatheredContact {
    int i;                      ///< id
    int j;                      ///< id; j < 0: wall -1-j, or facet of an obstacle (PlacedObstacles)
    int subdomain;              ///< rank that has it
    double gap;                 ///< now [m]; negative where the two overlap
    double normal_impulse;      ///< r_n [N s]; without friction, that of the solver to the last bit
    typename M::Vec normal;     ///< unit, from j to i, when contacts were found
    typename M::Vec impulse;    ///< on i [N s]
    typename M::Couple couple;  ///< on i, where contacts have couples [N m s]
    typename M::Vec branch;     ///< now, to the centre of i from that of j, or from its foot on the wall [m]

    /// The impulse to hand to a simulation that goes on from here.
    PairImpulse<M> pair() const {
        if constexpr (M::friction)
            return {i, j, detail::with_couple<M>(impulse, couple)};
        else
            return {i, j, typename M::Impulse{normal_impulse}};
    }
};

/// Grains of these ids, by ascending id on the process that hosts rank 0, empty elsewhere.
template <class M>
std::vector<GatheredGrain<M>> gather_grains(const Simulation<M>& simulation, detail::Ids ids = {}) {
    const auto& parts = simulation.parts();
    std::vector<Communicator::Outbox> out(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t g = 0; g < parts[k].grains.size(); ++g) {
            if (!parts[k].primary(g) || !ids.contain(parts[k].grains[g].id)) continue;
            detail::Serialise<M>::put(parts[k].grains[g], out[k][0]);
            detail::Serialise<M>::put(parts[k].broad_phase_position[g], out[k][0]);
            const bool stepped = !parts[k].problem.multiplicity.empty();
            out[k][0].insert(out[k][0].end(),
                             {double(parts[k].rank), stepped ? double(parts[k].problem.multiplicity[g]) : 1.0});
        }
    const std::vector<Buffer> in = simulation.comm().route(out);
    std::vector<GatheredGrain<M>> grains;
    constexpr std::size_t x = detail::Serialise<M>::grain_size, size = x + M::dim + 2;
    if (parts[0].rank == 0)
        for (std::size_t p = 0; p < in[0].size(); p += size) {
            const double* record = in[0].data() + p;
            grains.push_back({detail::Serialise<M>::grain(record), Eigen::Map<const typename M::Vec>(record + x),
                              static_cast<int>(record[size - 2]), static_cast<int>(record[size - 1])});
        }
    std::sort(grains.begin(), grains.end(), [](const auto& a, const auto& b) { return a.grain.id < b.grain.id; });
    return grains;
}

namespace detail {

/// The last broad phase but for the positions. Not collective.
template <class M>
BroadPhaseState<M> last_broad_phase(const Simulation<M>& simulation) {
    const BroadPhase<M>& broad = simulation.broad_phase();
    return {.kind = simulation.settings().partition.kind,
            .partition = broad.partition().numbers(),
            .imbalance = broad.imbalance_when_made(),
            .skin = broad.skin(),
            .steps_since = broad.steps_since(),
            .positions = {},
            .offsets = broad.offsets(),
            .time = broad.time(),
            .cell = broad.cell(),
            .stretch = broad.stretch()};
}

}  // namespace detail

/// The last broad phase. Positions come by ascending id on the process that hosts rank 0, none elsewhere.
template <class M>
BroadPhaseState<M> gather_broad_phase(const Simulation<M>& simulation) {
    BroadPhaseState<M> broad_phase = detail::last_broad_phase(simulation);
    for (const auto& grain : gather_grains(simulation)) broad_phase.positions.push_back(grain.broad_phase_position);
    return broad_phase;
}

/// Contacts of the last step, by ascending ids on the process that hosts rank 0, empty elsewhere.
template <class M>
std::vector<GatheredContact<M>> gather_contacts(const Simulation<M>& simulation, detail::Ids ids = {}) {
    constexpr std::size_t size = 5 + 3 * M::dim + M::couples;
    const auto& parts = simulation.parts();
    std::vector<Communicator::Outbox> out(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const auto grain = [&](int g) -> const Grain<M>& { return parts[k].grains[static_cast<std::size_t>(g)]; };
        const auto put = [&](const Contact<M>& c, int j, double gap, const typename M::Vec& branch) {
            if (!ids.contain(grain(c.i).id)) return;
            double normal_impulse = c.r[0];
            if constexpr (M::friction) normal_impulse = detail::force_of<M>(c.r).dot(c.normal);
            out[k][0].insert(out[k][0].end(),
                             {double(grain(c.i).id), double(j), double(parts[k].rank), gap, normal_impulse});
            detail::Serialise<M>::put(c.normal, out[k][0]);
            detail::Serialise<M>::put(detail::impulse_vector<M>(c.r, c.normal), out[k][0]);
            detail::Serialise<M>::put(branch, out[k][0]);
            detail::Serialise<M>::put(detail::couple_of<M>(c.r), out[k][0]);
        };
        for (const auto& c : parts[k].problem.contacts) {
            const typename M::Vec branch = parts[k].cell.apart(grain(c.i).position, grain(c.j).position);
            put(c, grain(c.j).id, branch.norm() - grain(c.i).radius - grain(c.j).radius, branch);
        }
        for (const auto& c : parts[k].problem.wall_contacts) {
            const detail::Foot<M> foot = detail::foot_of(simulation, k, c);
            put(c, -1 - parts[k].number_of(c, simulation.walls().size()), foot.distance - grain(c.i).radius,
                foot.distance * foot.normal);
        }
    }
    const std::vector<Buffer> in = simulation.comm().route(out);
    std::vector<GatheredContact<M>> contacts;
    if (parts[0].rank == 0)
        for (std::size_t p = 0; p < in[0].size(); p += size) {
            const double* record = in[0].data() + p;
            contacts.push_back({static_cast<int>(record[0]), static_cast<int>(record[1]), static_cast<int>(record[2]),
                                record[3], record[4], Eigen::Map<const typename M::Vec>(record + 5),
                                Eigen::Map<const typename M::Vec>(record + 5 + M::dim),
                                Eigen::Map<const typename M::Couple>(record + 5 + 3 * M::dim),
                                Eigen::Map<const typename M::Vec>(record + 5 + 2 * M::dim)});
        }
    std::sort(contacts.begin(), contacts.end(),
              [](const auto& a, const auto& b) { return std::pair(a.i, a.j) < std::pair(b.i, b.j); });
    return contacts;
}

}}  // namespace nscdd::NSCDD_ABI
