// What the ranks tell one another in the tests, and what must arrive, whatever the communicator.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "catch.hpp"
#include "nscdd/comm/communicator.hpp"

namespace pattern {

using nscdd::Buffer;
using nscdd::Communicator;

// Of 0 to 3 doubles, all different.
inline Buffer message(int from, int to, int round) {
    Buffer b(static_cast<std::size_t>((2 * from + 3 * to + 1) % 4));
    for (std::size_t i = 0; i < b.size(); ++i) b[i] = 1000 * round + 100 * from + 10 * to + static_cast<double>(i) / 3;
    return b;
}

// Of very different sizes, so that a sum depends on its order.
inline Buffer contribution(int rank, int round) {
    const double sign = rank % 2 == 0 ? 1 : -1;
    return {std::pow(0.1, rank), sign * 1e16 / (1 + rank / 2), 0.1 * (rank + round)};
}

// Some pairs have no link; every rank has one to itself, which is no message.
inline bool linked(int a, int b) { return (a + b) % 4 != 3; }

inline Communicator::Links links(int rank, int size, int round) {
    Communicator::Links mine;
    for (int peer = 0; peer < size; ++peer)
        if (linked(rank, peer))
            mine.push_back({peer, message(rank, peer, round).size(), message(peer, rank, round).size()});
    return mine;
}

// What rank 0 to size-1 contribute, combined in the order that reduce() promises: the first `added` entries summed.
inline Buffer tree(int size, int round, std::size_t added) {
    std::vector<Buffer> v;
    for (int r = 0; r < size; ++r) v.push_back(contribution(r, round));
    const auto combine = [&](int to, int from) {
        for (std::size_t i = 0; i < 3; ++i)
            v[to][i] = i < added ? v[to][i] + v[from][i] : std::max(v[to][i], v[from][i]);
    };
    int p = 1;
    while (2 * p <= size) p *= 2;
    for (int r = p; r < size; ++r) combine(r - p, r);
    for (int step = 1; step < p; step *= 2)
        for (int r = 0; r + step < p; r += 2 * step) combine(r, r + step);
    return v[0];
}

// By hosted rank.
struct Received {
    std::vector<std::vector<Buffer>> exchanged;  // the same channel twice: the second time
    std::vector<Buffer> routed;
    Buffer all_gathered, reduced;
};

inline Received everything(nscdd::Communicator& comm, int round) {
    Received received;
    const std::span<const int> ranks = comm.ranks();
    const int size = comm.size();
    std::vector<Communicator::Links> links_of;
    std::vector<Communicator::Outbox> out(ranks.size());
    std::vector<Buffer> mine;
    for (std::size_t k = 0; k < ranks.size(); ++k) {
        links_of.push_back(links(ranks[k], size, round));
        for (int d = 0; d < size; ++d) out[k][d] = message(ranks[k], d, round);
        mine.push_back(contribution(ranks[k], round));
    }
    const auto channel = comm.open(links_of);
    for (const int factor : {7, 1}) {
        for (std::size_t k = 0; k < ranks.size(); ++k)
            for (std::size_t l = 0; l < links_of[k].size(); ++l)
                std::ranges::transform(message(ranks[k], links_of[k][l].peer, round), channel->send(k, l).begin(),
                                       [factor](double x) { return factor * x; });
        channel->start();
        channel->finish();
    }
    for (std::size_t k = 0; k < ranks.size(); ++k) {
        received.exchanged.emplace_back();
        for (std::size_t l = 0; l < links_of[k].size(); ++l)
            received.exchanged.back().emplace_back(channel->recv(k, l).begin(), channel->recv(k, l).end());
    }
    received.routed = comm.route(out);
    const std::span<const double> all = comm.all_gather(mine);
    received.all_gathered.assign(all.begin(), all.end());
    comm.start_reduce(mine, 2);
    comm.advance();
    const std::span<const double> reduced = comm.finish_reduce();
    received.reduced.assign(reduced.begin(), reduced.end());
    return received;
}

inline void check_received(const Received& received, std::span<const int> ranks, int size, int round) {
    CHECK(received.exchanged.size() == ranks.size());
    CHECK(received.routed.size() == ranks.size());
    for (std::size_t k = 0; k < ranks.size(); ++k) {
        std::vector<Buffer> exchanged;
        Buffer routed;
        for (int source = 0; source < size; ++source) {
            const Buffer m = message(source, ranks[k], round);
            if (linked(source, ranks[k])) exchanged.push_back(m);
            routed.insert(routed.end(), m.begin(), m.end());
        }
        CHECK(received.exchanged[k] == exchanged);
        CHECK(received.routed[k] == routed);
    }
    Buffer all;
    for (int r = 0; r < size; ++r) {
        const Buffer c = contribution(r, round);
        all.insert(all.end(), c.begin(), c.end());
    }
    CHECK(received.all_gathered == all);
    CHECK(received.reduced == tree(size, round, 2));
}

// Of one round, summed over all processes, counted from the definitions.
inline Communicator::Traffic expected_traffic(int size) {
    Communicator::Traffic t;
    const auto add = [&t](double messages, std::size_t doubles) {
        t.messages += messages;
        t.bytes += 8 * static_cast<double>(doubles);
    };
    for (int from = 0; from < size; ++from)
        for (int to = 0; to < size; ++to) {
            const std::size_t n = message(from, to, 0).size();
            if (from == to) continue;
            if (linked(from, to)) add(2, 2 * n);  // the channel, twice: an empty message is one
            if (n > 0) add(1, n);                 // route: it is none
        }
    const int others = size - 1;
    add(2 * others, static_cast<std::size_t>(3 * others + 3 * size * others));  // all-gather: up and down
    // A reduction: in groups of four everybody tells everybody, then four groups, and so on. Ranks beyond the largest
    // power of two are in the group of rank - p; they send in the first round alone.
    int p = 1;
    while (2 * p <= size) p *= 2;
    for (int step = 1; step < p; step *= 4)
        for (int from = 0; from < size; ++from)
            for (int to = 0; to < size; ++to) {
                const int a = from % p, b = to % p;
                const bool together = a / (4 * step) == b / (4 * step) && a % step == b % step;
                if (from != to && together && (step == 1 || (from < p && a != b))) add(1, 3);
            }
    return t;
}

}  // namespace pattern
