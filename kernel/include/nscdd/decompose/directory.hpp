/// @file
/// Finds the ranks that hold a grain of which only the id is known. Rank id % size knows them. It is used once per
/// simulation, as its grains and impulses may come from any rank. Every rank may have something for every other one, so
/// messages travel in two hops.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/route_by_square.hpp"
#include "nscdd/comm/throw_collectively.hpp"
#include "nscdd/decompose/repartition.hpp"
#include "nscdd/decompose/serialise.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

inline int desk(int id, int size) { return id % size; }

/// Throws std::invalid_argument, on every process, when two grains have one id. `more`: of this process, to come.
/// Collective; ids from 0 on.
template <class M>
void check_ids(const std::vector<Subdomain<M>>& parts, Communicator& comm, std::span<const Grain<M>> more = {}) {
    std::vector<Communicator::Outbox> out(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t g = 0; g < parts[k].grains.size(); ++g)
            if (const int id = parts[k].grains[g].id; parts[k].primary(g)) out[k][desk(id, comm.size())].push_back(id);
    for (const Grain<M>& g : more) out[0][desk(g.id, comm.size())].push_back(g.id);
    std::vector<Buffer> ids = route_by_square(comm, out);
    throw_collectively(comm, [&ids](std::size_t k) {
        std::sort(ids[k].begin(), ids[k].end());
        if (const auto twice = std::adjacent_find(ids[k].begin(), ids[k].end()); twice != ids[k].end())
            throw std::invalid_argument("grain " + std::to_string(static_cast<int>(*twice)) +
                                        ": there are two of this id");
    });
}

/// Sends impulses, which may come from any rank, to the candidates that they belong to; others are ignored.
/// impulses[k]: of the k-th hosted rank. Collective.
template <class M>
void hand_out_impulses(std::vector<Subdomain<M>>& parts, Communicator& comm,
                       const std::vector<std::vector<PairImpulse<M>>>& impulses) {
    using Serialise = Serialise<M>;
    const int size = comm.size();
    std::vector<Communicator::Outbox> holders(parts.size()), asked(parts.size()), answers(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k) {
        for (const auto& g : parts[k].grains) {
            Buffer& to = holders[k][desk(g.id, size)];
            to.insert(to.end(), {double(g.id), double(parts[k].rank)});
        }
        for (const auto& p : impulses[k])
            if (p.i >= 0) Serialise::put(p, asked[k][desk(p.i, size)]);
    }
    const std::vector<Buffer> told = route_by_square(comm, holders), wanted = route_by_square(comm, asked);
    for (std::size_t k = 0; k < parts.size(); ++k) {
        std::vector<Holding> holdings;
        for (std::size_t p = 0; p < told[k].size(); p += 2)
            holdings.push_back({static_cast<int>(told[k][p]), static_cast<int>(told[k][p + 1])});
        std::sort(holdings.begin(), holdings.end());
        for (std::size_t p = 0; p < wanted[k].size(); p += Serialise::impulse_size) {
            const PairImpulse<M> impulse = Serialise::impulse(wanted[k].data() + p);
            for (auto h = std::lower_bound(holdings.begin(), holdings.end(), Holding{impulse.i, 0});
                 h != holdings.end() && h->grain == impulse.i; ++h)
                Serialise::put(impulse, answers[k][h->rank]);
        }
    }
    const std::vector<Buffer> received = route_by_square(comm, answers);
    for (std::size_t k = 0; k < parts.size(); ++k) {
        std::vector<PairImpulse<M>> own;
        for (std::size_t p = 0; p < received[k].size(); p += Serialise::impulse_size)
            own.push_back(Serialise::impulse(received[k].data() + p));
        set_impulses<M>(parts[k], own);
    }
}

}}}  // namespace nscdd::NSCDD_ABI::detail
