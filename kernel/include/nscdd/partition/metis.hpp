/// @file
/// Partition by METIS, with the fewest grains shared and equal numbers of contacts. This is the only header that
/// includes metis.h; nothing else includes this one. Link METIS (libmetis).
#pragma once

#include <metis.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nscdd/partition/partition.hpp"
#include "nscdd/partition/weights.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Small equal cells over a box, each of which has a rank. Points outside belong to the nearest cell. Parts need not be
/// connected.
template <class M>
class CellTable {
  public:
    using Vec = typename M::Vec;

    /// Takes the cells. `low` is the corner of the box [m], `edge` that of a cell, per axis [m]. `owner` has the rank
    /// of each cell, the first axis fastest. Throws std::invalid_argument for less than one cell, another number of
    /// owners, an owner that is no rank, and a box that is not finite.
    CellTable(const std::array<int, M::dim>& cells, const Vec& low, const Vec& edge, std::vector<int> owner, int ranks)
        : cells_(cells), low_(low), edge_(edge), owner_(std::move(owner)), ranks_(ranks) {
        double count = 1;
        for (const int along : cells_) count *= along >= 1 ? along : 0;
        if (count != static_cast<double>(owner_.size()) || count == 0)
            throw std::invalid_argument("a table of cells has one owner for each cell");
        if (!std::all_of(owner_.begin(), owner_.end(), [ranks](int rank) { return rank >= 0 && rank < ranks; }))
            throw std::invalid_argument("an owner in a table of cells is no rank");
        if (!low.allFinite() || !edge.allFinite() || !(edge.minCoeff() > 0))
            throw std::invalid_argument("the cells of a table must have a finite place and size");
    }

    /// Rank of the cell that the point is in.
    int owner(const Vec& point) const {
        std::size_t at = 0;
        for (int d = M::dim - 1; d >= 0; --d) at = at * static_cast<std::size_t>(along(d)) + cell(point[d], d);
        return owner_[at];
    }

    /// Calls visit(rank) once for each rank that has a cell within `reach` [m] (per axis) of the point.
    void visit_owners(const Vec& point, double reach, auto&& visit) const {
        std::array<std::size_t, 3> first{}, last{};
        for (int d = 0; d < M::dim; ++d) {
            first[static_cast<std::size_t>(d)] = cell(point[d] - reach, d);
            last[static_cast<std::size_t>(d)] = cell(point[d] + reach, d);
        }
        std::vector<int> seen;
        const auto nx = static_cast<std::size_t>(along(0)), ny = static_cast<std::size_t>(along(1));
        for (std::size_t z = first[2]; z <= last[2]; ++z)
            for (std::size_t y = first[1]; y <= last[1]; ++y)
                for (std::size_t x = first[0]; x <= last[0]; ++x) {
                    const int rank = owner_[x + nx * (y + ny * z)];
                    if (std::find(seen.begin(), seen.end(), rank) == seen.end()) seen.push_back(rank);
                }
        for (const int rank : seen) visit(rank);
    }

    std::string name() const { return "METIS into " + std::to_string(ranks_); }  ///< name, with the number of ranks
    /// Ranks, cells per axis, low corner [m], edges [m], owners, for Partitioner::restore.
    Buffer numbers() const {
        Buffer out{static_cast<double>(ranks_)};
        out.insert(out.end(), cells_.begin(), cells_.end());
        out.insert(out.end(), low_.data(), low_.data() + M::dim);
        out.insert(out.end(), edge_.data(), edge_.data() + M::dim);
        out.insert(out.end(), owner_.begin(), owner_.end());
        return out;
    }

  private:
    int along(int d) const { return cells_[static_cast<std::size_t>(d)]; }
    std::size_t cell(double coordinate, int d) const {
        const double at = (coordinate - low_[d]) / edge_[d];  // a NaN or a far point must not reach the cast
        return static_cast<std::size_t>(at >= along(d) ? along(d) - 1 : at > 0 ? static_cast<int>(at) : 0);
    }

    std::array<int, M::dim> cells_;
    Vec low_, edge_;
    std::vector<int> owner_;
    int ranks_;
};

/// Contacts and grains counted by cells. A contact adds one to the weight of its midpoint's cell, and joins that cell
/// with the cells of its two grains. A grain is sent to each other rank that has a contact of it: METIS is asked for
/// the fewest grains sent, over the cells that hold any.
class CellGraph {
  public:
    std::vector<idx_t> contacts, grains;  ///< numbers by cell: of midpoints of contacts, of centres of grains
    std::map<std::pair<std::int64_t, std::int64_t>, idx_t> joined;  ///< contacts that join two cells, lower cell first

    static constexpr std::size_t few = 8;  ///< cells a rank; with fewer METIS fails, and prints that it does

    /// Where no contacts are known: joins each cell with the next one along each axis that has grains, as if by one
    /// contact for each grain of the cell that has fewer. Without this METIS would deal cells from all over the box to
    /// a rank.
    template <std::size_t dim>
    void join_neighbours(const std::array<int, dim>& cells) {
        for (std::size_t cell = 0; cell < contacts.size(); ++cell) {
            std::size_t stride = 1, rest = cell;
            for (const int along : cells) {
                const auto count = static_cast<std::size_t>(along);
                std::size_t next = cell, left = count - 1 - rest % count;
                for (; left > 0 && (next == cell || contacts[next] == 0); --left) next += stride;
                if (const idx_t shared = (std::min)(contacts[cell], contacts[next]); next != cell && shared > 0)
                    joined[{static_cast<std::int64_t>(cell), static_cast<std::int64_t>(next)}] = shared;
                rest /= count;
                stride *= count;
            }
        }
    }

    /// Rank of each cell; -1 for cells without contacts, which METIS need not know. Empty if METIS fails.
    std::vector<int> part(int ranks) const {
        std::vector<int> owner(contacts.size(), -1);
        std::vector<idx_t> vertex(contacts.size(), -1), weight, sizes, begin{0}, to, shared;
        std::vector<std::size_t> cell_of;
        std::vector<std::vector<std::pair<idx_t, idx_t>>> edges;
        const auto vertex_of = [&](std::int64_t cell) {
            auto& at = vertex[static_cast<std::size_t>(cell)];
            if (at < 0) {
                at = static_cast<idx_t>(cell_of.size());
                cell_of.push_back(static_cast<std::size_t>(cell));
                weight.push_back(contacts[static_cast<std::size_t>(cell)]);
                sizes.push_back(grains[static_cast<std::size_t>(cell)]);
                edges.emplace_back();
            }
            return static_cast<std::size_t>(at);
        };
        for (std::size_t cell = 0; cell < contacts.size(); ++cell)
            if (contacts[cell] > 0) vertex_of(static_cast<std::int64_t>(cell));
        for (const auto& [pair, count] : joined) {
            const std::size_t a = vertex_of(pair.first), b = vertex_of(pair.second);
            edges[a].emplace_back(static_cast<idx_t>(b), count);
            edges[b].emplace_back(static_cast<idx_t>(a), count);
        }
        for (const auto& of_vertex : edges) {
            for (const auto& [other, count] : of_vertex) {
                to.push_back(other);
                shared.push_back(count);
            }
            begin.push_back(static_cast<idx_t>(to.size()));
        }
        std::vector<idx_t> found(cell_of.size(), 0);
        if (cell_of.size() < few * static_cast<std::size_t>(ranks))
            deal_in_turn(weight, ranks, found);
        else if (ranks > 1 && !call_metis(begin, to, weight, sizes, shared, ranks, found))
            return {};
        for (std::size_t v = 0; v < cell_of.size(); ++v) owner[cell_of[v]] = static_cast<int>(found[v]);
        return owner;
    }

  private:
    /// Gives a rank one cell after the other, until it has its share. The last cells may have no contact, only a grain
    /// of one.
    static void deal_in_turn(const std::vector<idx_t>& weight, int ranks, std::vector<idx_t>& found) {
        const double all = std::accumulate(weight.begin(), weight.end(), 0.0);
        double before = 0;
        for (std::size_t v = 0; v < weight.size(); ++v) {
            const double middle = before + 0.5 * static_cast<double>(weight[v]);
            found[v] =
                all > 0 ? (std::min)(static_cast<idx_t>(middle / all * ranks), static_cast<idx_t>(ranks - 1)) : 0;
            before += static_cast<double>(weight[v]);
        }
    }

    static bool call_metis(std::vector<idx_t>& begin, std::vector<idx_t>& to, std::vector<idx_t>& weight,
                           std::vector<idx_t>& sizes, std::vector<idx_t>& shared, int ranks,
                           std::vector<idx_t>& found) {
        auto vertices = static_cast<idx_t>(weight.size()), constraints = idx_t{1}, parts = static_cast<idx_t>(ranks),
             cut = idx_t{0};
        std::array<idx_t, METIS_NOPTIONS> options;
        METIS_SetDefaultOptions(options.data());
        options[METIS_OPTION_SEED] = 1;
        options[METIS_OPTION_OBJTYPE] = METIS_OBJTYPE_VOL;
        return METIS_PartGraphKway(&vertices, &constraints, begin.data(), to.data(), weight.data(), sizes.data(),
                                   shared.data(), &parts, nullptr, nullptr, options.data(), &cut,
                                   found.data()) == METIS_OK;
    }
};

/// Gives cells without an owner that of the nearest cell with one, by steps along the axes.
template <std::size_t dim>
void fill_owners(const std::array<int, dim>& cells, std::vector<int>& owner) {
    std::vector<std::size_t> front;
    for (std::size_t c = 0; c < owner.size(); ++c)
        if (owner[c] >= 0) front.push_back(c);
    if (front.empty()) std::fill(owner.begin(), owner.end(), 0);
    for (std::size_t next = 0; next < front.size(); ++next) {
        std::size_t stride = 1, rest = front[next];
        for (std::size_t d = 0; d < dim; ++d) {
            const auto along = static_cast<std::size_t>(cells[d]);
            const std::size_t at = rest % along;
            rest /= along;
            const auto take = [&](std::size_t neighbour) {
                if (owner[neighbour] >= 0) return;
                owner[neighbour] = owner[front[next]];
                front.push_back(neighbour);
            };
            if (at > 0) take(front[next] - stride);
            if (at + 1 < along) take(front[next] + stride);
            stride *= along;
        }
    }
}

/// The edge of equal cells of a box, `wanted` in all: an axis shorter than the edge has one cell, so that a layer of
/// grains has no more cells than a heap.
template <class M>
double edge_of_cells(typename M::Vec extent, double wanted) {
    std::sort(extent.data(), extent.data() + M::dim, std::greater<>());
    double volume = 1, edge = 0;
    for (int d = 0; d < M::dim && (d == 0 || extent[d] > edge); ++d) {
        volume *= extent[d];
        edge = std::pow(volume / wanted, 1.0 / (d + 1));
    }
    return edge;
}

/// Number of grains and sums of their places [m], measured from the middle of a box, and of their squares.
template <class M>
struct Cloud {
    double grains = 0;
    typename M::Vec from_middle = M::Vec::Zero(), square = M::Vec::Zero();
    auto summed() { return std::tie(grains, from_middle, square); }
    auto largest() { return std::tie(); }
};

/// The box to divide into cells: that of all grains, without the few that lie far from the others, lest these others
/// have few cells. An axis is cut 4 standard deviations from the mean where at most half of it is left by that. Mean
/// and deviation are then those of the grains left, and so on.
template <class M>
typename PartitionInput<M>::Box box_of_most(const PartitionInput<M>& scene, auto&& own_grains) {
    using Vec = typename M::Vec;
    typename PartitionInput<M>::Box box = scene.box;
    for (bool shorter = true; shorter;) {
        const Vec middle = 0.5 * (box.low + box.high);
        const auto cloud = reduce<Cloud<M>>(scene.comm, [&](std::size_t k) {
            Cloud<M> mine;
            own_grains(k, [&](const Vec& x) {
                if ((x - box.low).minCoeff() < 0 || (box.high - x).minCoeff() < 0) return;
                ++mine.grains;
                mine.from_middle += x - middle;
                mine.square += (x - middle).cwiseAbs2();
            });
            return mine;
        });
        const Vec mean = cloud.from_middle / (std::max)(cloud.grains, 1.0),
                  far = 4 * (cloud.square / (std::max)(cloud.grains, 1.0) - mean.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
        shorter = false;
        for (int d = 0; d < M::dim; ++d) {
            const double low = (std::max)(box.low[d], middle[d] + mean[d] - far[d]),
                         high = (std::min)(box.high[d], middle[d] + mean[d] + far[d]);
            if (!(low < high && high - low <= 0.5 * (box.high[d] - box.low[d]))) continue;
            box.low[d] = low;
            box.high[d] = high;
            shorter = true;
        }
    }
    return box;
}

template <class M>
CellTable<M> part_by_metis(const PartitionInput<M>& scene) {
    using Vec = typename M::Vec;
    const std::vector<Subdomain<M>>& parts = scene.parts;
    Communicator& comm = scene.comm;
    const auto own_grains = [&parts](std::size_t k, auto&& visit) {
        for (std::size_t g = 0; g < parts[k].grains.size(); ++g)
            if (parts[k].primary(g)) visit(parts[k].grains[g].position);
    };
    const double grains = reduce(comm, 1, [&](std::size_t k) {
        double count = 0;
        own_grains(k, [&count](const Vec&) { ++count; });
        return Buffer{count};
    })[0];
    const typename PartitionInput<M>::Box box = box_of_most(scene, own_grains);
    // Fine enough to tell a contact from its neighbours: with one cell a grain a quarter more grains are shared. Grains
    // alone, without contacts, need cells that are neighbours. Every process holds the table.
    const bool candidates = detail::any_candidates(parts, comm);
    const double wanted =
        std::clamp((candidates ? 6 : 0.5) * grains, 8.0 * comm.size(), (std::max)(8.0 * comm.size(), double(1 << 20)));
    const Vec extent = (box.high - box.low).cwiseMax(1e-9 * (box.high - box.low).maxCoeff()).cwiseMax(1e-300);
    const double size = edge_of_cells<M>(extent, wanted);
    std::array<int, M::dim> cells;
    Vec edge;
    std::size_t count = 1;
    for (int d = 0; d < M::dim; ++d) {
        const double along = std::clamp(std::round(extent[d] / size), 1.0, wanted);
        cells[static_cast<std::size_t>(d)] = static_cast<int>(along);
        edge[d] = extent[d] / along;
        count *= static_cast<std::size_t>(along);
    }
    std::vector<int> numbered(count);
    std::iota(numbered.begin(), numbered.end(), 0);
    const CellTable<M> number(cells, box.low, edge, numbered, static_cast<int>(count));  // owner: the cell itself

    // cell, the other cell or what is counted, number
    constexpr int of_contacts = -1, of_grains = -2;
    std::vector<Communicator::Outbox> out(parts.size()), table(parts.size());
    for (std::size_t k = 0; k < parts.size(); ++k) {
        std::map<std::pair<int, int>, double> counted;
        own_grains(k, [&](const Vec& x) {
            ++counted[{number.owner(x), of_grains}];
            if (!candidates) ++counted[{number.owner(x), of_contacts}];
        });
        detail::visit_candidates(parts[k], [&](const Vec& midpoint, const Vec& a, const Vec& b) {
            const int at = number.owner(midpoint);
            ++counted[{at, of_contacts}];
            for (const int grain : {number.owner(a), number.owner(b)})
                if (grain != at) ++counted[{(std::min)(grain, at), (std::max)(grain, at)}];
        });
        for (const auto& [pair, number_of] : counted)
            out[k][0].insert(out[k][0].end(), {double(pair.first), double(pair.second), number_of});
    }
    const std::vector<Buffer> in = comm.route(out);
    if (comm.ranks()[0] == 0) {
        CellGraph graph;
        graph.contacts.assign(count, 0);
        graph.grains.assign(count, 0);
        for (std::size_t p = 0; p < in[0].size(); p += 3) {
            const auto a = static_cast<std::int64_t>(in[0][p]), b = static_cast<std::int64_t>(in[0][p + 1]);
            const auto at = static_cast<std::size_t>(a);
            (b == of_contacts ? graph.contacts[at]
             : b == of_grains ? graph.grains[at]
                              : graph.joined[{a, b}]) += static_cast<idx_t>(in[0][p + 2]);
        }
        if (!candidates) graph.join_neighbours(cells);
        std::vector<int> owner = graph.part(comm.size());
        fill_owners(cells, owner);
        owner.resize(count, -1);
        for (int rank = 0; rank < comm.size(); ++rank) table[0][rank].assign(owner.begin(), owner.end());
    }
    const std::vector<Buffer> told = comm.route(table);
    if (told[0][0] < 0) throw std::runtime_error("METIS finds no partition into " + std::to_string(comm.size()));
    return CellTable<M>(cells, box.low, edge, std::vector<int>(told[0].begin(), told[0].end()), comm.size());
}

}  // namespace detail

/// Deals out the candidates of the last broad phase, or the grains before the first one. The graph has a few hundred
/// cells a rank, because METIS would begin by putting grains together as well. For `imbalance` see Partitioner.
template <class M>
Partitioner<M> by_metis(double imbalance = detail::default_imbalance) {
    const auto restore = [](std::span<const double> numbers, int ranks) -> std::optional<Partition<M>> {
        constexpr std::size_t head = 1 + 3 * M::dim;
        const auto whole = [](double x) { return x >= 0 && x <= 1e9 ? static_cast<int>(x) : -1; };
        if (numbers.size() <= head || numbers[0] != ranks) return {};
        std::array<int, M::dim> cells;
        std::transform(numbers.begin() + 1, numbers.begin() + 1 + M::dim, cells.begin(), whole);
        std::vector<int> owner;
        for (const double rank : numbers.subspan(head)) owner.push_back(whole(rank));
        using Vector = Eigen::Map<const typename M::Vec>;
        try {
            return detail::CellTable<M>(cells, Vector(&numbers[1 + M::dim]), Vector(&numbers[1 + 2 * M::dim]),
                                        std::move(owner), ranks);
        } catch (const std::invalid_argument&) {
            return {};  // of another number of ranks
        }
    };
    return {.kind = "metis", .make = detail::part_by_metis<M>, .restore = restore, .imbalance = imbalance};
}

}}  // namespace nscdd::NSCDD_ABI
