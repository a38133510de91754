/// @file
/// Broad phase and the new decomposition of the domain. Grains migrate. Candidates are found where their midpoint lies.
/// Impulses follow their pair. All subdomains with a copy of a grain agree on who they are.
///
/// No rank sees the whole scene: a grain is sent to the subdomains that its contacts could fall into. Contacts are
/// dealt by the very point that impulses are forwarded by, so none is lost (warm start).
#pragma once

#include <algorithm>
#include <limits>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/route_by_square.hpp"
#include "nscdd/comm/throw_collectively.hpp"
#include "nscdd/core/two_digits.hpp"
#include "nscdd/core/wall.hpp"
#include "nscdd/decompose/serialise.hpp"
#include "nscdd/detect/close_pairs.hpp"
#include "nscdd/partition/partition.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Gives the impulses to the candidates that they belong to; others are ignored.
template <class M>
void set_impulses(Subdomain<M>& part, std::span<const PairImpulse<M>> impulses) {
    PairTable<typename Candidates<M>::Candidate> by_ids(part.pairs.size() + part.wall_pairs.size());
    const auto id = [&](int local) { return part.grains[static_cast<std::size_t>(local)].id; };
    for (auto& c : part.pairs) by_ids[pair_key(id(c.i), id(c.j))] = &c;
    for (auto& c : part.wall_pairs) by_ids[pair_key(id(c.i), -1 - c.j)] = &c;
    for (const auto& p : impulses)
        if (auto* found = by_ids[pair_key(p.i, p.j)]) found->r = p.r;
}

/// visit(candidate, PairImpulse) for all impulses that are not zero.
template <class M>
void visit_impulses(const Subdomain<M>& part, auto&& visit) {
    for (const auto& c : part.pairs)
        if (!c.r.isZero(0))
            visit(c, PairImpulse<M>{part.grains[static_cast<std::size_t>(c.i)].id,
                                    part.grains[static_cast<std::size_t>(c.j)].id, c.r});
    for (const auto& c : part.wall_pairs)
        if (!c.r.isZero(0)) visit(c, PairImpulse<M>{part.grains[static_cast<std::size_t>(c.i)].id, -1 - c.j, c.r});
}

/// A rank farther than this from a grain's centre has no candidate of the grain: the midpoint of a candidate is no
/// farther than half its length.
template <class M>
double reach(const Grain<M>& grain, double skin, double largest_radius) {
    return 0.5 * (grain.radius + largest_radius + skin);
}

/// The ranks that own a point within `reach` [m] of a place or of one of its images, each once.
template <class M>
void find_owners(const Partition<M>& partition, const Cell<M>& cell, const typename M::Vec& place, double reach,
                 std::vector<int>& ranks) {
    ranks.clear();
    cell.visit_images(place, reach, [&](const typename M::Vec& image) {
        partition.visit_owners(image, reach, [&ranks](int rank) { ranks.push_back(rank); });
    });
    if (!cell.repeats()) return;  // a partition that visits a rank twice is told
    std::sort(ranks.begin(), ranks.end());
    ranks.erase(std::unique(ranks.begin(), ranks.end()), ranks.end());
}

/// What is wrong with a partition as a grain finds it, in one line; empty if nothing is. visited: by find_owners() for
/// the centre and `reach`. Of all points within reach one is asked for, in a direction that goes by the id, so that
/// several grains find a neighbour that is not visited.
template <class M>
std::string partition_fault(const Partition<M>& partition, int ranks, const Grain<M>& grain, double reach,
                            const std::vector<int>& visited) {
    const auto unknown = [ranks](int rank) { return rank < 0 || rank >= ranks; };
    const auto fault = [&](const std::string& text) {
        return "grain " + std::to_string(grain.id) + ": the partition `" + partition.name() + "` " + text;
    };
    const auto named = [](int rank) { return "rank " + std::to_string(rank); };
    for (auto v = visited.begin(); v != visited.end(); ++v) {
        if (unknown(*v)) return fault("visits " + named(*v) + " of " + std::to_string(ranks));
        if (std::find(visited.begin(), v, *v) != v) return fault("visits " + named(*v) + " twice");
    }
    typename M::Vec near = grain.position;
    near[grain.id / 2 % M::dim] += (grain.id % 2 == 0 ? 0.99 : -0.99) * reach;
    for (const typename M::Vec& point : {grain.position, near}) {
        const int owner = partition.owner(point);
        if (unknown(owner))
            return fault("gives a point within reach to " + named(owner) + " of " + std::to_string(ranks));
        if (std::find(visited.begin(), visited.end(), owner) == visited.end())
            return fault("does not visit " + named(owner) + ", which owns a point within reach");
    }
    return {};
}

/// Here_only: no other rank has the grain.
enum class Use : char { none, here, here_only };

/// Tells every holder of a grain who the others are; returns, per hosted rank, all holdings in order, of grains that
/// others may have. The rank where the centre lies keeps the list, and keeps the grain when nobody has a candidate for
/// it.
template <class M>
std::vector<std::vector<Holding>> agree_on_replicas(const std::vector<Subdomain<M>>& parts,
                                                    const std::vector<std::vector<Use>>& uses, Communicator& comm,
                                                    const Partition<M>& partition) {
    const auto put = [](const Holding& h, Buffer& out) { out.insert(out.end(), {double(h.grain), double(h.rank)}); };
    const auto read = [](const Buffer& in, std::vector<Holding>& out) {
        for (std::size_t p = 0; p < in.size(); p += 2)
            out.push_back({static_cast<int>(in[p]), static_cast<int>(in[p + 1])});
        std::sort(out.begin(), out.end());
    };
    constexpr int nobody = (std::numeric_limits<int>::max)();  // sorts behind all ranks
    std::vector<std::vector<Holding>> listed(parts.size()), holdings(parts.size());
    std::vector<Communicator::Outbox> to_home(parts.size()), answers(parts.size());
    comm.each_rank([&](std::size_t k) {
        for (std::size_t g = 0; g < parts[k].grains.size(); ++g) {
            if (uses[k][g] == Use::here_only) continue;
            const Grain<M>& grain = parts[k].grains[g];
            const int home = partition.owner(grain.position);
            if (home == parts[k].rank) listed[k].push_back({grain.id, nobody});
            if (uses[k][g] == Use::here) put({grain.id, parts[k].rank}, to_home[k][home]);
        }
    });
    const std::vector<Buffer> at_home = comm.route(to_home);

    comm.each_rank([&](std::size_t k) {
        std::vector<Holding>& list = listed[k];
        read(at_home[k], list);
        for (auto first = list.begin(); first != list.end();) {
            auto last = first;
            while (last->rank != nobody) ++last;
            const auto next = last + 1;
            if (first == last) (last++)->rank = parts[k].rank;
            for (auto to = first; to != last; ++to)
                for (auto h = first; h != last; ++h) put(*h, answers[k][to->rank]);
            first = next;
        }
    });
    const std::vector<Buffer> told = comm.route(answers);
    comm.each_rank([&](std::size_t k) { read(told[k], holdings[k]); });
    return holdings;
}

/// Drops grains that nobody here needs and sets replicas and neighbours.
template <class M>
void keep_shared(Subdomain<M>& part, const std::vector<Use>& uses, const std::vector<Holding>& holdings) {
    std::vector<int> renamed(part.grains.size(), -1);
    std::vector<Grain<M>> kept;
    kept.reserve(part.grains.size());
    part.replica_begin.assign(1, 0);
    part.replicas.clear();
    std::map<int, std::vector<std::pair<int, int>>> shared;  // peer -> (id, local)
    for (std::size_t g = 0; g < part.grains.size(); ++g) {
        const int id = part.grains[g].id, local = static_cast<int>(kept.size());
        const bool alone = uses[g] == Use::here_only;
        auto held = alone ? holdings.end() : std::lower_bound(holdings.begin(), holdings.end(), Holding{id, 0});
        if (!alone && (held == holdings.end() || held->grain != id)) continue;
        renamed[g] = local;
        kept.push_back(part.grains[g]);
        if (alone) part.replicas.push_back(part.rank);
        for (; held != holdings.end() && held->grain == id; ++held) {
            part.replicas.push_back(held->rank);
            if (held->rank != part.rank) shared[held->rank].push_back({id, local});
        }
        part.replica_begin.push_back(static_cast<int>(part.replicas.size()));
    }
    part.grains.swap(kept);
    for (auto& c : part.pairs) {
        c.i = renamed[static_cast<std::size_t>(c.i)];
        c.j = renamed[static_cast<std::size_t>(c.j)];
    }
    for (auto& c : part.wall_pairs) c.i = renamed[static_cast<std::size_t>(c.i)];

    part.neighbours.clear();
    part.linked.clear();
    for (auto& [peer, grains] : shared) {
        std::sort(grains.begin(), grains.end());
        part.neighbours.push_back(peer);
        part.linked.emplace_back();
        for (const auto& entry : grains) part.linked.back().push_back(entry.second);
    }
}

/// Throws, the same on every rank, if a rank has refused; all: four numbers of each rank (TooManyPairs).
inline void throw_if_refused(std::span<const double> all, double skin) {
    for (std::size_t p = 0; p < all.size(); p += 4) {
        if (all[p + 3] == 0) continue;
        if (all[p + 1] >= 0)
            throw std::runtime_error("grain " + std::to_string(int(all[p + 1])) + " and grain " +
                                     std::to_string(int(all[p + 2])) + " overlap by " + two_digits(100 * all[p]) +
                                     " % of a radius");
        throw std::runtime_error("more than " + std::to_string(std::size_t(all[p + 3])) +
                                 " pairs of grains are closer than the " + two_digits(skin) +
                                 " m that they may move until the next detection: take a smaller step");
    }
}

/// In: subdomains of any earlier decomposition (every grain held by one rank at least). Out: the decomposition by
/// `partition`, with all candidates that are closer than `skin` [m]. `largest_radius` of the whole scene [m].
/// `anywhere`, the same on every rank: most ranks have grains for most others, as where the partition is new. Throws,
/// the same on every rank, std::runtime_error when there are too many candidates (TooManyPairs), std::invalid_argument
/// with the id of a grain that the partition would lose or have twice.
template <class M>
void repartition(std::vector<Subdomain<M>>& parts, Communicator& comm, const Partition<M>& partition,
                 std::span<const Wall<M>> walls, double skin, double largest_radius, bool anywhere = false) {
    using Serialise = Serialise<M>;
    std::vector<Communicator::Outbox> grains(parts.size()), impulses(parts.size());
    std::vector<std::string> faults(parts.size());
    comm.each_rank([&](std::size_t k) {
        const Subdomain<M>& part = parts[k];
        std::vector<int> visited;
        for (std::size_t g = 0; g < part.grains.size() && faults[k].empty(); ++g) {
            if (!part.primary(g)) continue;
            const Grain<M>& grain = part.grains[g];
            const double reach = detail::reach(grain, skin, largest_radius);
            find_owners(partition, part.cell, grain.position, reach, visited);
            faults[k] = partition_fault(partition, comm.size(), grain, reach, visited);
            if (faults[k].empty())
                for (const int rank : visited) Serialise::put(grain, grains[k][rank]);
        }
        if (!faults[k].empty()) return;  // told below, when all ranks have come there
        visit_impulses(part, [&](const auto& c, const PairImpulse<M>& p) {
            const typename M::Vec& xi = part.grains[static_cast<std::size_t>(c.i)].position;
            const typename M::Vec midpoint =
                p.j < 0 ? xi : part.cell.middle(xi, part.grains[static_cast<std::size_t>(c.j)].position);
            Serialise::put(p, impulses[k][partition.owner(midpoint)]);
        });
    });
    const auto route = [&](const auto& out) { return anywhere ? route_by_square(comm, out) : comm.route(out); };
    const std::vector<Buffer> received = route(grains), carried = route(impulses);

    std::vector<std::vector<Use>> uses(parts.size());
    std::vector<std::vector<int>> owners(parts.size());
    std::vector<Buffer> refused(parts.size(),
                                Buffer(4));  // deepest overlap, ids of its two grains, pairs that a list may hold
    comm.each_rank([&](std::size_t k) {
        Subdomain<M>& part = parts[k];
        part.grains.clear();
        for (std::size_t p = 0; p < received[k].size(); p += Serialise::grain_size)
            part.grains.push_back(Serialise::grain(received[k].data() + p));
        const Cells<M> cells(part.grains, 2 * largest_radius + skin);
        sort_in_space(part.grains, cells);

        const bool repeats = part.cell.repeats();
        const auto mine = [&](const Grain<M>& a, const Grain<M>& b) {
            const Grain<M>&low = a.id < b.id ? a : b, &high = a.id < b.id ? b : a;  // the same sum as above
            const typename M::Vec midpoint = repeats ? part.cell.middle(low.position, high.position)
                                                     : typename M::Vec(0.5 * (low.position + high.position));
            return partition.owner(midpoint) == part.rank;
        };
        part.pairs.clear();
        part.wall_pairs.clear();
        uses[k].assign(part.grains.size(), Use::none);
        std::vector<GrainPair> close;
        try {
            close = repeats ? close_pairs<M>(part.grains, part.cell, 2 * largest_radius + skin, skin, mine)
                            : close_pairs<M>(part.grains, cells, skin, mine);
        } catch (const TooManyPairs& pairs) {
            refused[k] = {pairs.overlap, double(pairs.i), double(pairs.j), double(pairs.most)};
            return;
        }
        const auto fixed = [&part](int g) { return part.grains[static_cast<std::size_t>(g)].fixed(); };
        for (const GrainPair& pair : close) {
            if (fixed(pair.i) && fixed(pair.j)) continue;
            part.pairs.push_back({pair.i, pair.j});
            uses[k][static_cast<std::size_t>(pair.i)] = uses[k][static_cast<std::size_t>(pair.j)] = Use::here;
        }
        for (std::size_t g = 0; g < part.grains.size(); ++g) {
            const Grain<M>& grain = part.grains[g];
            if (partition.owner(grain.position) != part.rank) continue;
            for (std::size_t w = 0; w < walls.size(); ++w)
                if (walls[w].distance(grain.position) - grain.radius < skin && (!grain.fixed() || walls[w].driven)) {
                    part.wall_pairs.push_back({static_cast<int>(g), static_cast<int>(w)});
                    uses[k][g] = Use::here;
                }
            if (part.obstacles && !grain.fixed())
                part.obstacles->visit_near(grain.position, grain.radius + skin, [&](int number) {
                    part.wall_pairs.push_back({static_cast<int>(g), number});
                    uses[k][g] = Use::here;
                });
            std::vector<int>& receivers = owners[k];
            find_owners(partition, part.cell, grain.position, reach(grain, skin, largest_radius), receivers);
            if (receivers.size() == 1) uses[k][g] = Use::here_only;
        }
    });
    // Who has refused is gathered only where somebody has: a step has no message to all ranks.
    const auto any = [&](std::size_t k) { return Buffer{faults[k].empty() ? refused[k][3] : 1.0}; };
    if (reduce(comm, 0, any)[0] > 0) {
        throw_collectively(comm, faults);
        throw_if_refused(comm.all_gather(refused), skin);
    }

    const auto holdings = agree_on_replicas(parts, uses, comm, partition);
    comm.each_rank([&](std::size_t k) {
        Subdomain<M>& part = parts[k];
        keep_shared(part, uses[k], holdings[k]);
        part.broad_phase_position.clear();
        for (const auto& g : part.grains) part.broad_phase_position.push_back(g.position);
        std::vector<PairImpulse<M>> own;
        for (std::size_t p = 0; p < carried[k].size(); p += Serialise::impulse_size)
            own.push_back(Serialise::impulse(carried[k].data() + p));
        set_impulses<M>(part, own);
    });
}

}}}  // namespace nscdd::NSCDD_ABI::detail
