/// @file
/// Multiplicity of each grain in this step, and the masses split by it (paper, section 3).
///
/// By Multiplicity::minimal a copy counts only where the narrow phase found a contact of it: the "future optimization"
/// of section 3.2. Other copies take no part in the iteration, and get the answer when it is over. By
/// Multiplicity::predicted, the paper's own, every copy counts that the broad phase foresaw.
#pragma once

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "nscdd/core/wall.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Marks the active copies of a subdomain, and writes the marks into the messages of channel link l
/// of the k-th hosted rank.
template <class M>
void mark_own_activity(Subdomain<M>& part, Communicator::Channel& channel, std::size_t k, Multiplicity which) {
    // Broad phase left here the grains with a candidate, and those that nobody else has.
    std::vector<char> touched(part.grains.size(), which == Multiplicity::predicted);
    for (const auto& c : part.problem.contacts)
        touched[static_cast<std::size_t>(c.i)] = touched[static_cast<std::size_t>(c.j)] = 1;
    for (const auto& c : part.problem.wall_contacts) touched[static_cast<std::size_t>(c.i)] = 1;
    for (std::size_t g = 0; g < part.grains.size(); ++g)  // copies of a fixed grain always agree
        if (part.grains[g].fixed()) touched[g] = 0;
    part.active.assign(part.replicas.size(), 0);
    for (std::size_t g = 0; g < part.grains.size(); ++g)
        for (std::size_t s = part.first_replica(g); s < part.last_replica(g); ++s)
            if (part.replicas[s] == part.rank) part.active[s] = touched[g];
    for (std::size_t l = 0; l < part.neighbours.size(); ++l)
        std::transform(part.linked[l].begin(), part.linked[l].end(), channel.send(k, l).begin(),
                       [&](int g) { return double(touched[static_cast<std::size_t>(g)]); });
}

/// Moves contacts of interface grains to the front of the lists, where a sweep begins: the velocities of these grains
/// are then exchanged while the other contacts, which do not touch them, are swept.
template <class M>
void sweep_interface_first(Subdomain<M>& part) {
    std::vector<char> shared(part.grains.size(), 0);
    for (int g : part.interface) shared[static_cast<std::size_t>(g)] = 1;
    // From the last on, the others move up behind those taken out: where nothing is early, nothing moves.
    const auto reorder = [](std::vector<Contact<M>>& contacts, std::vector<int>& source, auto&& early) {
        std::vector<std::pair<Contact<M>, int>> taken;
        std::size_t to = contacts.size();
        for (std::size_t c = contacts.size(); c-- > 0;) {
            if (early(contacts[c])) {
                taken.emplace_back(contacts[c], source[c]);
            } else if (--to != c) {
                contacts[to] = contacts[c];
                source[to] = source[c];
            }
        }
        for (std::size_t k = 0; k < to; ++k) std::tie(contacts[k], source[k]) = taken[to - 1 - k];
        return to;
    };
    const auto interface = [&](int g) { return shared[static_cast<std::size_t>(g)] != 0; };
    part.interface_contacts = reorder(part.problem.contacts, part.source,
                                      [&](const Contact<M>& c) { return interface(c.i) || interface(c.j); });
    part.interface_wall_contacts =
        reorder(part.problem.wall_contacts, part.wall_source, [&](const Contact<M>& c) { return interface(c.i); });
}

template <class M>
void read_activity(Subdomain<M>& part, const Communicator::Channel& channel, std::size_t rank) {
    for (std::size_t l = 0; l < part.neighbours.size(); ++l)
        for (std::size_t k = 0; k < part.linked[l].size(); ++k) {
            const auto g = static_cast<std::size_t>(part.linked[l][k]);
            for (std::size_t s = part.first_replica(g); s < part.last_replica(g); ++s)
                if (part.replicas[s] == part.neighbours[l]) part.active[s] = channel.recv(rank, l)[k] != 0;
        }
    part.interface.clear();
    for (std::size_t g = 0; g < part.grains.size(); ++g) {
        bool here = false;
        for (std::size_t s = part.first_replica(g); s < part.last_replica(g); ++s)
            here |= part.replicas[s] == part.rank && part.active[s];
        if (here && part.multiplicity(g) > 1) part.interface.push_back(static_cast<int>(g));
    }
    std::sort(part.interface.begin(), part.interface.end(), [&](int a, int b) {
        return part.grains[static_cast<std::size_t>(a)].id < part.grains[static_cast<std::size_t>(b)].id;
    });
}

template <class M>
int first_active(const Subdomain<M>& part, std::size_t grain) {
    for (std::size_t s = part.first_replica(grain); s < part.last_replica(grain); ++s)
        if (part.active[s]) return part.replicas[s];
    return part.rank;  // no copy has a contact: all have V_free
}

/// Every holder of a grain or driven wall learns which copies are active; puts the contacts into the order of the
/// sweep.
template <class M>
void agree_on_multiplicities(std::vector<Subdomain<M>>& parts, Communicator& comm, std::span<const Wall<M>> walls,
                             Multiplicity which) {
    const auto channel = comm.open(links_between(parts, 1));
    comm.each_rank([&](std::size_t k) { mark_own_activity(parts[k], *channel, k, which); });
    channel->start();
    channel->finish();
    comm.each_rank([&](std::size_t k) {
        read_activity(parts[k], *channel, k);
        sweep_interface_first(parts[k]);
    });
    const std::size_t bodies = walls.size() + parts[0].cell.sides();
    const bool driven = bodies > walls.size() ||
                        std::any_of(walls.begin(), walls.end(), [](const Wall<M>& wall) { return wall.driven; });
    for (auto& part : parts) {
        part.wall_active.assign(driven ? bodies : 0, 0);
        part.wall_touched = part.wall_active;
        part.problem.wall_multiplicity.assign(bodies + part.touches.size(), 1);
        const auto mark = [&](const auto& touching) {
            for (const auto& c : touching)
                if (const auto w = static_cast<std::size_t>(c.j); w < walls.size() && walls[w].driven)
                    part.wall_active[w] = 1;
        };
        which == Multiplicity::predicted ? mark(part.wall_pairs) : mark(part.problem.wall_contacts);
        const bool any = which == Multiplicity::predicted ? !part.pairs.empty() : !part.problem.contacts.empty();
        for (std::size_t side = walls.size(); side < bodies; ++side) part.wall_active[side] = any;
    }
    if (!driven) return;
    const std::span<const double> touching = reduce(comm, bodies, [&parts](std::size_t k) {
        return Buffer(parts[k].wall_active.begin(), parts[k].wall_active.end());
    });
    for (auto& part : parts)
        for (std::size_t w = 0; w < bodies; ++w) {
            part.wall_touched[w] = touching[w] > 0;
            part.problem.wall_multiplicity[w] = (std::max)(1, static_cast<int>(touching[w]));
        }
}

/// Sets the flow of a problem, and behind its walls the sides of the cell that a stress drives.
template <class M>
void set_flow(Subdomain<M>& part, double h) {
    ContactProblem<M>& problem = part.problem;
    const Cell<M>& cell = part.cell;
    auto& flow = problem.flow.emplace();
    flow.gradient = cell.gradient;
    flow.length = cell.length;
    for (int d = 0; d < M::dim; ++d) {
        flow.side[static_cast<std::size_t>(d)] = -1;
        if (!cell.driven[static_cast<std::size_t>(d)]) continue;
        const std::size_t at = problem.walls.size();
        flow.gradient(d, d) = 0;
        flow.side[static_cast<std::size_t>(d)] = static_cast<int>(at);
        problem.walls.push_back({.speed = cell.gradient(d, d) * cell.length - h * cell.force(d) / cell.mass,
                                 .inv_mass = problem.wall_multiplicity[at] / cell.mass});
    }
}

/// Sets bodies and walls of each problem: V_free and split inverse masses. Mass, inertia and external impulse are all
/// divided by m, so V_free is that of the whole grain in every copy.
template <class M>
void split_masses(std::vector<Subdomain<M>>& parts, std::span<const Wall<M>> walls, const typename M::Vec& gravity,
                  double h) {
    for (Subdomain<M>& part : parts) {
        ContactProblem<M>& problem = part.problem;
        problem.bodies.resize(part.grains.size());
        problem.multiplicity.resize(part.grains.size());
        problem.centres.resize(part.grains.size());
        problem.radii.resize(part.grains.size());
        const bool flows = part.cell.flows();
        for (std::size_t g = 0; g < part.grains.size(); ++g) {
            const Grain<M>& grain = part.grains[g];
            Body<M>& body = problem.bodies[g];
            const int m = problem.multiplicity[g] = part.multiplicity(g);
            problem.centres[g] = grain.position;
            problem.radii[g] = grain.radius;
            body.inv_mass = m / grain.mass;
            body.v = grain.velocity;
            if (grain.fixed()) {
                if constexpr (M::friction) body.inv_inertia = 0;
                continue;
            }
            body.linear() += h * (gravity + grain.load.template head<M::dim>() / grain.mass);
            if (flows) body.linear() -= h * flow_over<M>(part.cell.gradient, grain.velocity.template head<M::dim>());
            if constexpr (M::friction) {
                body.inv_inertia = m / grain.inertia;
                body.spin() += h / grain.inertia * grain.load.template tail<M::spins>();
            }
        }
        problem.walls.resize(walls.size());
        for (std::size_t w = 0; w < walls.size(); ++w) {
            problem.walls[w].prescribed = walls[w].velocity;
            const int m = problem.wall_multiplicity[w];
            problem.walls[w].inv_mass = walls[w].driven ? m / walls[w].mass : 0;
            problem.walls[w].speed = walls[w].driven ? walls[w].speed + h * walls[w].force / walls[w].mass : 0;
        }
        for (const auto& touch : part.touches) {
            WallBody<M>& wall = problem.walls.emplace_back(WallBody<M>{.prescribed = touch.velocity});
            if constexpr (M::rolling) wall.spin.value = part.obstacles->spin(touch.number);
        }
        problem.flow.reset();
        if (flows) set_flow(part, h);
    }
}

/// Copies take their velocity from the first active holder: those without a contact had no part in the iteration,
/// and after a factorised gluing copies agree to round-off only.
template <class M>
void share_velocities(std::vector<Subdomain<M>>& parts, Communicator& comm) {
    const auto channel = comm.open(links_between(parts, M::dof));
    comm.each_rank([&](std::size_t k) {
        for (std::size_t l = 0; l < parts[k].neighbours.size(); ++l) {
            auto out = channel->send(k, l).begin();
            for (int g : parts[k].linked[l]) {
                const auto& v = parts[k].problem.bodies[static_cast<std::size_t>(g)].v;
                out = std::copy(v.data(), v.data() + M::dof, out);
            }
        }
    });
    channel->start();
    channel->finish();
    comm.each_rank([&](std::size_t k) {
        Subdomain<M>& part = parts[k];
        for (std::size_t l = 0; l < part.neighbours.size(); ++l)
            for (std::size_t s = 0; s < part.linked[l].size(); ++s) {
                const auto g = static_cast<std::size_t>(part.linked[l][s]);
                if (first_active(part, g) == part.neighbours[l])
                    part.problem.bodies[g].v =
                        Eigen::Map<const typename M::Velocity>(channel->recv(k, l).data() + s * M::dof);
            }
    });
}

}}}  // namespace nscdd::NSCDD_ABI::detail
