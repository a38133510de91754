/// @file
/// The paper's broad phase: all pairs closer than a skin, by sorted cells. It is done every few steps (paper, section
/// 3).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <tuple>
#include <vector>

#include "nscdd/core/cell.hpp"
#include "nscdd/core/grain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Two grains that are close to each other.
struct GrainPair {
    int i;  ///< place in the list of grains, of the one with the lower id
    int j;  ///< place of the other one
};

/// Cubic cells over the grains' centres. They are numbered along a Morton curve, so cells close in space are close in
/// memory.
template <class M>
class Cells {
  public:
    using Coordinates = std::array<std::int64_t, M::dim>;  ///< of a cell, from 1 on along each axis

    /// Makes cells over the centres. `size` is the edge of a cell [m], at least the largest centre distance looked for.
    Cells(std::span<const Grain<M>> grains, double size) {
        typename M::Vec high = M::Vec::Constant(-1e300);
        low_ = M::Vec::Constant(1e300);
        for (const auto& g : grains) low_ = low_.cwiseMin(g.position), high = high.cwiseMax(g.position);
        // far outliers must not overflow the Morton code: wider cells are slower, never wrong
        size_ = (std::max)(size, grains.empty() ? 1.0 : (high - low_).maxCoeff() / double(max_coordinate - 2));
    }

    /// Coordinates of the cell that the point is in; only for points within the box of the grains' centres.
    Coordinates coordinates(const typename M::Vec& x) const {
        Coordinates c;
        for (int d = 0; d < M::dim; ++d)
            c[static_cast<std::size_t>(d)] = static_cast<std::int64_t>((x[d] - low_[d]) / size_) + 1;
        return c;
    }
    /// Place of a cell on the Morton curve: the bits of its coordinates in turn.
    static std::uint64_t code(const Coordinates& c) {
        std::uint64_t code = 0;
        for (int d = 0; d < M::dim; ++d)
            code |= spread(static_cast<std::uint64_t>(c[static_cast<std::size_t>(d)])) << d;
        return code;
    }

  private:
    static constexpr int bits = 63 / M::dim;
    /// Spreads the lower bits of x, `dim` places apart. First halves of the bits are moved to their places, then
    /// quarters, and so on.
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
    static constexpr std::int64_t max_coordinate = std::int64_t{1} << (std::min)(bits, 30);

    typename M::Vec low_;
    double size_;
};

/// Sorts the grains along the cells' curve. Grains of one cell come by id, so the order does not depend on history.
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

/// Thrown by close_pairs() where there are more pairs than a list of candidates may hold.
struct TooManyPairs {
    double overlap = 0;    ///< deepest of the pairs found, over the smaller radius; of grains `i` and `j` (ids)
    int i = -1;            ///< id; -1: none overlap by more than a radius
    int j = -1;            ///< id, likewise
    std::size_t most = 0;  ///< pairs that the list may hold
};

/// Called when a list is full, first at six pairs a grain. Throws if grains overlap by more than a radius, of which
/// there may be n^2 / 2 pairs, or if the list has its most. Fast grains have many neighbours within their skin: 250 a
/// grain is 1.7 radii a step in a dense packing of spheres.
template <class M>
void check_pair_count(std::span<const Grain<M>> grains, std::span<const GrainPair> found) {
    TooManyPairs refused{.most = 250 * grains.size() + 1'000'000};
    for (const GrainPair& pair : found) {
        const Grain<M>&a = grains[static_cast<std::size_t>(pair.i)], &b = grains[static_cast<std::size_t>(pair.j)];
        const double overlap =
            (a.radius + b.radius - (a.position - b.position).norm()) / (std::min)(a.radius, b.radius);
        if (overlap > (std::max)(1.0, refused.overlap)) {
            refused.overlap = overlap;
            std::tie(refused.i, refused.j) = std::minmax(a.id, b.id);
        }
    }
    if (refused.i >= 0 || found.size() >= refused.most) throw refused;
}

/// Finds the pairs with a gap below `skin` [m] whose two grains satisfy `keep(a, b)`, by ascending lower index. i has
/// the lower id. Throws TooManyPairs.
template <class M>
std::vector<GrainPair> close_pairs(std::span<const Grain<M>> grains, const Cells<M>& cells, double skin, auto&& keep) {
    // Cells are numbered row by row, with an empty cell at both ends of a row. The neighbours of a cell are runs of
    // three consecutive numbers, one per adjacent row. As the cell advances, the start of each run only moves forward
    // (first[]).
    struct Filed {
        std::uint64_t cell;
        typename M::Vec position;
        double radius;
        int grain;
    };
    std::vector<Filed> filed;
    filed.reserve(grains.size());
    typename Cells<M>::Coordinates most{};
    for (const auto& g : grains) {
        const auto at = cells.coordinates(g.position);
        for (std::size_t d = 0; d < M::dim; ++d) most[d] = (std::max)(most[d], at[d]);
    }
    const auto row = static_cast<std::uint64_t>(most[0] + 2), layer = row * static_cast<std::uint64_t>(most[1] + 2);
    for (std::size_t k = 0; k < grains.size(); ++k) {
        const auto at = cells.coordinates(grains[k].position);
        std::uint64_t cell = static_cast<std::uint64_t>(at[0]) + row * static_cast<std::uint64_t>(at[1]);
        if constexpr (M::dim == 3) cell += layer * static_cast<std::uint64_t>(at[2]);
        filed.push_back({cell, grains[k].position, grains[k].radius, static_cast<int>(k)});
    }
    std::sort(filed.begin(), filed.end(), [](const Filed& a, const Filed& b) { return a.cell < b.cell; });

    // Written to found[count]; count grows only if the pair is close. Avoids a mispredicted branch.
    std::vector<GrainPair> found(6 * grains.size() + 1);
    std::size_t count = 0;
    const auto test = [&](const Filed& a, const Filed& b) {
        const double candidate_distance = a.radius + b.radius + skin;
        if (count == found.size()) {
            check_pair_count<M>(grains, found);
            found.resize(2 * count);
        }
        found[count] = {a.grain, b.grain};
        count += (a.position - b.position).squaredNorm() < candidate_distance * candidate_distance;
    };
    // Middle cells of the adjacent rows with larger numbers, relative to the cell: so each pair is tested once.
    const std::array<std::uint64_t, 4> ahead{row, layer - row, layer, layer + row};
    std::array<std::size_t, M::dim == 3 ? 4 : 1> first{};
    for (std::size_t p = 0; p < filed.size(); ++p) {
        for (std::size_t q = p + 1; q < filed.size() && filed[q].cell <= filed[p].cell + 1; ++q)
            test(filed[p], filed[q]);
        for (std::size_t r = 0; r < first.size(); ++r) {
            const std::uint64_t middle = filed[p].cell + ahead[r];
            while (first[r] < filed.size() && filed[first[r]].cell < middle - 1) ++first[r];
            for (std::size_t q = first[r]; q < filed.size() && filed[q].cell <= middle + 1; ++q)
                test(filed[p], filed[q]);
        }
    }

    // Counting sort by the lower index, then a sort of each grain's few pairs: cheaper than sorting them all.
    std::vector<std::size_t> end(grains.size() + 1);
    std::size_t kept = 0;
    for (std::size_t p = 0; p < count; ++p) {
        const auto [low, high] = std::minmax({found[p].i, found[p].j});
        if (!keep(grains[static_cast<std::size_t>(low)], grains[static_cast<std::size_t>(high)])) continue;
        found[kept++] = {low, high};
        ++end[static_cast<std::size_t>(low) + 1];
    }
    found.resize(kept);
    std::partial_sum(end.begin(), end.end(), end.begin());
    std::vector<GrainPair> pairs(kept);
    for (const GrainPair& pair : found) pairs[end[static_cast<std::size_t>(pair.i)]++] = pair;
    auto first_of = pairs.begin();
    for (std::size_t low = 0; low < grains.size(); ++low) {
        const auto last_of = pairs.begin() + static_cast<std::ptrdiff_t>(end[low]);
        std::sort(first_of, last_of, [](const GrainPair& a, const GrainPair& b) { return a.j < b.j; });
        for (; first_of != last_of; ++first_of)
            if (grains[static_cast<std::size_t>(first_of->j)].id < grains[low].id) std::swap(first_of->i, first_of->j);
    }
    return pairs;
}

/// The same in a cell that repeats, where `size` [m] is that of the cells to search. A pair of which several images are
/// close is there once.
template <class M>
std::vector<GrainPair> close_pairs(std::span<const Grain<M>> grains, const Cell<M>& cell, double size, double skin,
                                   auto&& keep) {
    std::vector<Grain<M>> all(grains.begin(), grains.end());
    std::vector<int> stands_for(grains.size());
    std::iota(stands_for.begin(), stands_for.end(), 0);
    for (std::size_t g = 0; g < grains.size(); ++g)
        cell.visit_images(grains[g].position, size, [&](const typename M::Vec& image) {
            if (image == grains[g].position) return;
            all.push_back(grains[g]);
            all.back().position = image;
            stands_for.push_back(static_cast<int>(g));
        });
    const auto grain = [&](const Grain<M>& image) -> const Grain<M>& {
        return grains[static_cast<std::size_t>(stands_for[static_cast<std::size_t>(&image - all.data())])];
    };
    const Cells<M> cells(all, size);
    std::vector<GrainPair> pairs = close_pairs<M>(all, cells, skin, [&](const Grain<M>& a, const Grain<M>& b) {
        return a.id != b.id && keep(grain(a), grain(b));
    });
    const auto places = [](const GrainPair& pair) { return std::minmax(pair.i, pair.j); };
    for (GrainPair& pair : pairs)
        pair = {stands_for[static_cast<std::size_t>(pair.i)], stands_for[static_cast<std::size_t>(pair.j)]};
    std::sort(pairs.begin(), pairs.end(), [&](const auto& a, const auto& b) { return places(a) < places(b); });
    const auto same = [&](const auto& a, const auto& b) { return places(a) == places(b); };
    pairs.erase(std::unique(pairs.begin(), pairs.end(), same), pairs.end());
    return pairs;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
