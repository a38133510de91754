#include "model/material_mix.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "model/counter_random.hpp"

namespace nscdd {

std::vector<double> read_fractions(TomlTable& table, std::size_t count) {
    const Eigen::VectorXd given = table.vector("fractions", static_cast<int>(count));
    if (!(given.minCoeff() > 0)) table.fail("fractions", "must be above 0");
    if (!(std::abs(given.sum() - 1) <= 1e-6))
        table.fail("fractions", fmt::format("must add up to 1, found {}", given.sum()));
    return {given.begin(), given.end()};
}

std::vector<std::size_t> shares_of(const std::vector<double>& fractions, std::size_t n) {
    std::vector<std::size_t> shares, by_rest(fractions.size());
    std::vector<double> rest;
    for (const double fraction : fractions) {
        const double share = fraction * static_cast<double>(n);
        shares.push_back(static_cast<std::size_t>(share));
        rest.push_back(share - std::floor(share));
    }
    std::iota(by_rest.begin(), by_rest.end(), std::size_t{0});
    std::ranges::stable_sort(by_rest, std::greater<>(), [&rest](std::size_t k) { return rest[k]; });
    const std::size_t dealt = std::accumulate(shares.begin(), shares.end(), std::size_t{0});
    for (std::size_t k = 0; k + dealt < n; ++k) ++shares[by_rest[k % shares.size()]];
    return shares;
}

void deal_materials(Packing& packing, const MaterialMix& mix, int otherwise) {
    const std::size_t n = packing.total(), dim = static_cast<std::size_t>(packing.dim);
    packing.material.assign(packing.size(), otherwise);
    if (!mix.materials.empty()) {
        std::vector<std::size_t> ends = shares_of(mix.fractions, n);
        std::partial_sum(ends.begin(), ends.end(), ends.begin());
        const Permutation place(n, static_cast<std::uint64_t>(mix.seed));
        for (std::size_t g = 0; g < packing.size(); ++g) {
            const auto end = std::ranges::upper_bound(ends, place(packing.before + g));
            packing.material[g] = mix.materials[static_cast<std::size_t>(end - ends.begin())];
        }
    }
    for (std::size_t g = 0; g < packing.size(); ++g) {
        const Eigen::Map<const Eigen::VectorXd> x(packing.x.data() + g * dim, packing.dim);
        for (const MaterialMix::Part& part : mix.parts)
            if (part.region.contains(x)) packing.material[g] = part.material;
    }
}

}  // namespace nscdd
