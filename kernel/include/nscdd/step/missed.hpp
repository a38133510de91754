/// @file
/// Candidates that become contacts where a step is solved again.
#pragma once

#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/decompose/multiplicity.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Grains of contacts that mark_passing() takes away now, 1 on all ranks that have one. Collective.
template <class M>
std::vector<std::vector<char>> deflected_grains(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
    std::vector<std::vector<char>> deflected(parts.size());
    const auto channel = comm.open(links_between(parts, 1));
    comm.each_rank([&](std::size_t k) {
        const Subdomain<M>& part = parts[k];
        deflected[k].assign(part.grains.size(), 0);
        for (const int source : part.source) {
            const auto& c = part.pairs[static_cast<std::size_t>(source)];
            if (!c.passes || c.missed) continue;
            for (const int g : {c.i, c.j})
                if (const auto at = static_cast<std::size_t>(g); !part.grains[at].fixed()) deflected[k][at] = 1;
        }
        for (std::size_t l = 0; l < part.neighbours.size(); ++l) {
            auto out = channel->send(k, l).begin();
            for (const int g : part.linked[l]) *out++ = deflected[k][static_cast<std::size_t>(g)];
        }
    });
    channel->start();
    channel->finish();
    comm.each_rank([&](std::size_t k) {
        for (std::size_t l = 0; l < parts[k].neighbours.size(); ++l) {
            auto in = channel->recv(k, l).begin();
            for (const int g : parts[k].linked[l])
                if (*in++ > 0) deflected[k][static_cast<std::size_t>(g)] = 1;
        }
    });
    return deflected;
}

/// Candidates that find_tunnelled() has found to close become contacts in the next attempt. Where contacts are taken
/// away, `passes`, not those of a grain that one of them has deflected: its impulse may be what closes them.
/// Collective.
template <class M>
void mark_missed(std::vector<Subdomain<M>>& parts, Communicator& comm, bool passes) {
    std::vector<std::vector<char>> deflected;
    if (passes) deflected = deflected_grains(parts, comm);
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const auto straight = [&](int grain) { return !passes || !deflected[k][static_cast<std::size_t>(grain)]; };
        for (auto& c : parts[k].pairs) c.missed |= c.closes && straight(c.i) && straight(c.j);
        for (auto& c : parts[k].wall_pairs) c.missed |= c.closes && straight(c.i);
    }
}

}}}  // namespace nscdd::NSCDD_ABI::detail
