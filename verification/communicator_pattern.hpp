// What the ranks tell one another in the tests, and what must arrive, whatever the communicator.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "catch.hpp"
#include "nscdd/comm/communicator.hpp"

namespace pattern {

using nscdd::Buffer;
using nscdd::Links;

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

inline Links links(int rank, int size, int round) {
    Links mine;
    for (int peer = 0; peer < size; ++peer)
        if (linked(rank, peer))
            mine.push_back({peer, message(rank, peer, round), Buffer(message(peer, rank, round).size())});
    return mine;
}

// By hosted rank, but `gathered` by rank, where rank 0 is hosted.
struct Received {
    std::vector<std::vector<Buffer>> exchanged;
    std::vector<Buffer> routed, scattered, gathered;
    Buffer all_gathered, sum;
};

inline Received everything(nscdd::Communicator& comm, int round) {
    Received received;
    const std::span<const int> ranks = comm.ranks();
    const int size = comm.size();
    std::vector<Links> channels;
    std::vector<std::vector<Buffer>> out(ranks.size());
    std::vector<Buffer> up, from_root(static_cast<std::size_t>(size)), mine;
    for (std::size_t k = 0; k < ranks.size(); ++k) {
        channels.push_back(links(ranks[k], size, round));
        for (int d = 0; d < size; ++d) out[k].push_back(message(ranks[k], d, round));
        up.push_back(message(ranks[k], 0, round));
        received.scattered.emplace_back(message(0, ranks[k], round).size());
        mine.push_back(contribution(ranks[k], round));
    }
    if (ranks[0] == 0)
        for (int r = 0; r < size; ++r) {
            received.gathered.emplace_back(message(r, 0, round).size());
            from_root[r] = message(0, r, round);
        }

    comm.exchange(channels);
    received.routed = comm.route(out);
    comm.gather(up, received.gathered);
    comm.scatter(from_root, received.scattered);
    const std::span<const double> all = comm.all_gather(mine);
    received.all_gathered.assign(all.begin(), all.end());
    received.sum.resize(3);
    nscdd::sum_in_rank_order(all, received.sum);

    for (const Links& l : channels) {
        received.exchanged.emplace_back();
        for (const nscdd::Link& link : l) received.exchanged.back().push_back(link.recv);
    }
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
        CHECK(received.scattered[k] == message(0, ranks[k], round));
    }
    CHECK(received.gathered.size() == static_cast<std::size_t>(ranks[0] == 0 ? size : 0));
    for (std::size_t r = 0; r < received.gathered.size(); ++r)
        CHECK(received.gathered[r] == message(static_cast<int>(r), 0, round));

    Buffer all, sum(3);
    for (int r = 0; r < size; ++r) {
        const Buffer c = contribution(r, round);
        all.insert(all.end(), c.begin(), c.end());
        for (int i = 0; i < 3; ++i) sum[i] += c[i];
    }
    CHECK(received.all_gathered == all);
    CHECK(received.sum == sum);
}

// Of one round, summed over all processes, counted from the definitions.
inline nscdd::Traffic expected_traffic(int size) {
    nscdd::Traffic t;
    const auto add = [&t](double messages, std::size_t doubles) {
        t.messages += messages;
        t.bytes += 8 * static_cast<double>(doubles);
    };
    for (int from = 0; from < size; ++from)
        for (int to = 0; to < size; ++to) {
            const std::size_t n = message(from, to, 0).size();
            if (from == to) continue;
            if (linked(from, to)) add(1, n);  // exchange: an empty message is one
            if (n > 0) add(1, n);             // route: it is none
            if (to == 0) add(1, n);           // gather
            if (from == 0) add(1, n);         // scatter
        }
    const int others = size - 1;
    add(2 * others, static_cast<std::size_t>(3 * others + 3 * size * others));  // all-gather: up and down
    return t;
}

}  // namespace pattern
