// Rough detection: all pairs closer than a skin, by sorted cells. Done every few steps (paper, section 3).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "nscdd/core/grain.hpp"

namespace nscdd {

struct GrainPair {
    int i, j;
};

// Cubic cells over the grains' centres, numbered along a Morton curve so that close in space is close in memory.
template <class M>
class Cells {
  public:
    using Coordinates = std::array<std::int64_t, M::dim>;

    // `size`: edge of a cell, at least the largest centre distance looked for.
    Cells(std::span<const Grain<M>> grains, double size) {
        typename M::Vec high = M::Vec::Constant(-1e300);
        low_ = M::Vec::Constant(1e300);
        for (const auto& g : grains) low_ = low_.cwiseMin(g.position), high = high.cwiseMax(g.position);
        // far outliers must not overflow the Morton code: wider cells are slower, never wrong
        size_ = std::max(size, grains.empty() ? 1.0 : (high - low_).maxCoeff() / double(max_coordinate - 2));
    }

    Coordinates coordinates(const typename M::Vec& x) const {
        Coordinates c;
        for (int d = 0; d < M::dim; ++d)
            c[static_cast<std::size_t>(d)] = static_cast<std::int64_t>((x[d] - low_[d]) / size_) + 1;
        return c;
    }
    static std::uint64_t code(const Coordinates& c) {
        std::uint64_t code = 0;
        for (int d = 0; d < M::dim; ++d)
            code |= spread(static_cast<std::uint64_t>(c[static_cast<std::size_t>(d)])) << d;
        return code;
    }

  private:
    static constexpr int bits = 63 / M::dim;
    // The lower bits, `dim` places apart: halves, then quarters ... are moved where they belong.
    static std::uint64_t spread(std::uint64_t x) {
        if constexpr (M::dim == 3) {
            x &= 0x1fffff;
            x = (x | x << 32) & 0x001f00000000ffff;
            x = (x | x << 16) & 0x001f0000ff0000ff;
            x = (x | x << 8) & 0x100f00f00f00f00f;
            x = (x | x << 4) & 0x10c30c30c30c30c3;
            return (x | x << 2) & 0x1249249249249249;
        } else {
            x &= 0x7fffffff;
            x = (x | x << 16) & 0x0000ffff0000ffff;
            x = (x | x << 8) & 0x00ff00ff00ff00ff;
            x = (x | x << 4) & 0x0f0f0f0f0f0f0f0f;
            x = (x | x << 2) & 0x3333333333333333;
            return (x | x << 1) & 0x5555555555555555;
        }
    }
    static constexpr std::int64_t max_coordinate = std::int64_t{1} << std::min(bits, 30);

    typename M::Vec low_;
    double size_;
};

// Sorts the grains along the cells' curve. Equal cells: by id, so that the order does not depend on history.
template <class M>
void sort_in_space(std::vector<Grain<M>>& grains, const Cells<M>& cells) {
    std::vector<std::pair<std::uint64_t, int>> keys(grains.size());
    for (std::size_t k = 0; k < grains.size(); ++k)
        keys[k] = {cells.code(cells.coordinates(grains[k].position)), static_cast<int>(k)};
    std::sort(keys.begin(), keys.end(), [&](const auto& a, const auto& b) {
        if (a.first != b.first) return a.first < b.first;
        return grains[static_cast<std::size_t>(a.second)].id < grains[static_cast<std::size_t>(b.second)].id;
    });
    std::vector<Grain<M>> sorted;
    sorted.reserve(grains.size());
    for (const auto& key : keys) sorted.push_back(grains[static_cast<std::size_t>(key.second)]);
    grains.swap(sorted);
}

// Pairs with a gap below `skin` whose two grains satisfy `keep(a, b)`, by ascending lower index; i has the lower id.
// `grains` sorted by sort_in_space with the same cells.
template <class M>
std::vector<GrainPair> close_pairs(std::span<const Grain<M>> grains, const Cells<M>& cells, double skin, auto&& keep) {
    struct Cell {
        std::uint64_t code;
        typename Cells<M>::Coordinates at;
        int begin, end;
    };
    std::vector<Cell> filled;
    for (std::size_t k = 0; k < grains.size(); ++k) {
        const auto at = cells.coordinates(grains[k].position);
        const std::uint64_t code = Cells<M>::code(at);
        const int index = static_cast<int>(k);
        if (filled.empty() || filled.back().code != code) filled.push_back({code, at, index, index});
        filled.back().end = index + 1;
    }

    std::vector<GrainPair> pairs;
    const auto test = [&](int p, int q) {
        const Grain<M>&a = grains[static_cast<std::size_t>(p)], &b = grains[static_cast<std::size_t>(q)];
        const double reach = a.radius + b.radius + skin;
        if ((a.position - b.position).squaredNorm() < reach * reach && keep(a, b))
            pairs.push_back(a.id < b.id ? GrainPair{p, q} : GrainPair{q, p});
    };
    constexpr int neighbours = M::dim == 3 ? 27 : 9;
    for (const Cell& cell : filled) {
        for (int p = cell.begin; p < cell.end; ++p)
            for (int q = p + 1; q < cell.end; ++q) test(p, q);
        for (int n = neighbours / 2 + 1; n < neighbours; ++n) {  // half of the neighbours: each pair once
            auto at = cell.at;
            for (int d = 0, rest = n; d < M::dim; ++d, rest /= 3) at[static_cast<std::size_t>(d)] += rest % 3 - 1;
            const std::uint64_t code = Cells<M>::code(at);
            const auto other = std::lower_bound(filled.begin(), filled.end(), code,
                                                [](const Cell& c, std::uint64_t value) { return c.code < value; });
            if (other == filled.end() || other->code != code) continue;
            for (int p = cell.begin; p < cell.end; ++p)
                for (int q = other->begin; q < other->end; ++q) test(p, q);
        }
    }
    std::sort(pairs.begin(), pairs.end(), [](const GrainPair& a, const GrainPair& b) {
        return std::pair(std::min(a.i, a.j), std::max(a.i, a.j)) < std::pair(std::min(b.i, b.j), std::max(b.i, b.j));
    });
    return pairs;
}

}  // namespace nscdd
