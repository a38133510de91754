// Sums over all processes that do not depend on how the numbers are dealt to them.
#pragma once

#include <algorithm>
#include <cmath>

#include "nscdd/comm/communicator.hpp"

namespace nscdd {

// Of numbers >= 0, each process passes its own: the same to the last bit on any number of processes and in any order.
// Collective. Each number is split into multiples of three units so coarse that their sums are exact.
double sum_in_any_order(Communicator& comm, const auto& mine) {
    double count = 0, most = 0;
    for (const double x : mine) ++count, most = std::max(most, x);
    const auto over_all = [&comm](const Buffer& own, std::size_t added) {
        return reduce(comm, added, [&own](std::size_t k) { return k == 0 ? own : Buffer(own.size()); });
    };
    const std::span<const double> all = over_all({count, most}, 1);
    if (!(all[1] > 0) || !std::isfinite(all[1])) return all[1];
    int exponent = 0, bits = 0;  // all numbers are below 2^exponent, and they are at most 2^bits
    std::frexp(all[1], &exponent);
    std::frexp(all[0], &bits);
    Buffer sums(3);
    for (const double x : mine) {
        double rest = std::ldexp(x, -exponent);
        for (int level = 0; level < 3; ++level) {
            const double unit = std::ldexp(1.0, (level + 1) * (bits - 53)), part = std::nearbyint(rest / unit) * unit;
            rest -= part;
            sums[static_cast<std::size_t>(level)] += part;
        }
    }
    const std::span<const double> total = over_all(sums, 3);
    return std::ldexp(total[0] + (total[1] + total[2]), exponent);
}

}  // namespace nscdd
