#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include "nscdd/partition/partition.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Number of cells along each axis.
template <int dim>
using GridCells = std::array<int, static_cast<std::size_t>(dim)>;

/// Splits `count` over the axes such that cells are nearest to cubes (least cut area). In a cube 3 gives 3x1x1, 4 gives
/// 2x2x1 and 8 gives 2x2x2, as in Table 1 of the paper. Ties go to more cells along the first axes.
///
/// `extent` is that of the box [m]; axes along which it is next to nothing are not cut. Throws std::invalid_argument
/// for a count below 1.
template <class M>
GridCells<M::dim> choose_cells(int count, const typename M::Vec& extent) {
    if (count < 1) throw std::invalid_argument("a scene has at least one subdomain");
    // grains on a line or in a plane: every cut area is 0 where an extent is
    const typename M::Vec edge = extent.cwiseMax(1e-9 * extent.maxCoeff());
    GridCells<M::dim> best{};
    double least = 0;
    const auto consider = [&](const GridCells<M::dim>& cells) {
        double cut = 0;
        for (int d = 0; d < M::dim; ++d) {
            double area = cells[static_cast<std::size_t>(d)] - 1;
            for (int e = 0; e < M::dim; ++e)
                if (e != d) area *= edge[e];
            cut += area;
        }
        if (best[0] == 0 || cut < least * (1 - 1e-9)) best = cells, least = cut;
    };
    for (int nx = count; nx >= 1; --nx) {
        if (count % nx != 0) continue;
        if constexpr (M::dim == 2) {
            consider({nx, count / nx});
        } else {
            for (int ny = count / nx; ny >= 1; --ny)
                if (count / nx % ny == 0) consider({nx, ny, count / nx / ny});
        }
    }
    return best;
}

/// True if there is one cell for each rank. Cells may have any sign or size, as a file may bring them.
inline bool one_cell_each(std::span<const int> cells, int ranks) {
    for (const int count : cells) {
        if (count < 1 || ranks % count != 0) return false;
        ranks /= count;
    }
    return ranks == 1;
}

/// Throws std::invalid_argument unless there is at least one cell along each axis, and as many in all as ranks.
template <int dim>
void check_cells(const GridCells<dim>& cells, int ranks) {
    if (!one_cell_each(cells, ranks))
        throw std::invalid_argument("the grid's cells must be at least 1 along each axis, and as many as the ranks (" +
                                    std::to_string(ranks) + ")");
}

/// The regular grid that deals points to subdomains (paper, section 3.1).
template <class M>
class Grid {
  public:
    /// Makes equal cells over the box [low, high]. Points outside belong to the nearest cell. Throws
    /// std::invalid_argument for a grid without cells, or a box that is not finite.
    Grid(const GridCells<M::dim>& cells, const typename M::Vec& low, const typename M::Vec& high)
        : cells_(cells), low_(low), high_(high), size_(high - low) {
        if (*std::min_element(cells.begin(), cells.end()) < 1)
            throw std::invalid_argument("a grid has at least one cell along each axis");
        if (!low.allFinite() || !size_.allFinite()) throw std::invalid_argument("the box of a grid must be finite");
    }

    /// Rank of the cell that the point is in, the first axis fastest.
    int owner(const typename M::Vec& point) const {
        int rank = 0;
        for (int d = M::dim - 1; d >= 0; --d) rank = rank * cells(d) + cell(point[d], d);
        return rank;
    }

    /// Calls visit(rank) for every subdomain whose cell comes within `reach` [m] (per axis) of the point.
    void visit_owners(const typename M::Vec& point, double reach, auto&& visit) const {
        std::array<int, 3> first{0, 0, 0}, last{0, 0, 0};
        for (int d = 0; d < M::dim; ++d) {
            first[static_cast<std::size_t>(d)] = cell(point[d] - reach, d);
            last[static_cast<std::size_t>(d)] = cell(point[d] + reach, d);
        }
        const int nx = cells(0), ny = cells(1);
        for (int z = first[2]; z <= last[2]; ++z)
            for (int y = first[1]; y <= last[1]; ++y)
                for (int x = first[0]; x <= last[0]; ++x) visit(x + nx * (y + ny * z));
    }

    /// Name, such as "grid 2x2x1".
    std::string name() const {
        std::string text = "grid ";
        for (int d = 0; d < M::dim; ++d) {
            if (d > 0) text += 'x';
            text += std::to_string(cells(d));
        }
        return text;
    }
    /// Cells per axis, low corner, high corner [m], for Partitioner::restore.
    Buffer numbers() const {
        Buffer out(cells_.begin(), cells_.end());
        out.insert(out.end(), low_.data(), low_.data() + M::dim);
        out.insert(out.end(), high_.data(), high_.data() + M::dim);
        return out;
    }

  private:
    int cells(int d) const { return cells_[static_cast<std::size_t>(d)]; }
    int cell(double coordinate, int d) const {
        if (cells(d) == 1) return 0;  // most grids have one along some axis, and divisions are slow
        const double share = (coordinate - low_[d]) / size_[d] * cells(d);
        // compared as doubles: a NaN or a far point must not reach the cast
        return share >= cells(d) ? cells(d) - 1 : share > 0 ? static_cast<int>(share) : 0;
    }

    GridCells<M::dim> cells_;
    typename M::Vec low_, high_, size_;
};

}  // namespace detail

/// A grid over the box of the grains, anew at every broad phase. There is one cell for each rank; zeros mean that
/// numbers are chosen when the first grid is made. Making one throws std::invalid_argument for cells that are not one
/// for each rank.
template <class M>
Partitioner<M> by_grid(const detail::GridCells<M::dim>& wanted = {}) {
    const auto make = [wanted](const PartitionInput<M>& scene) {
        detail::GridCells<M::dim> cells = wanted;
        if (cells == detail::GridCells<M::dim>{} && scene.numbers.size() >= M::dim)
            std::copy_n(scene.numbers.begin(), M::dim, cells.begin());
        if (cells == detail::GridCells<M::dim>{})
            cells = detail::choose_cells<M>(scene.comm.size(), scene.box.high - scene.box.low);
        detail::check_cells<M::dim>(cells, scene.comm.size());
        return detail::Grid<M>(cells, scene.box.low, scene.box.high);
    };
    const auto restore = [wanted](std::span<const double> numbers, int ranks) -> std::optional<Partition<M>> {
        const auto finite = [](double x) { return std::isfinite(x); };
        const auto cell = [ranks](double x) { return x >= 1 && x <= ranks; };
        if (numbers.size() != 3 * M::dim || !std::all_of(numbers.begin(), numbers.end(), finite) ||
            !std::all_of(numbers.begin(), numbers.begin() + M::dim, cell))
            return {};
        detail::GridCells<M::dim> cells;
        std::copy_n(numbers.begin(), M::dim, cells.begin());
        if (!detail::one_cell_each(cells, ranks) || (wanted != detail::GridCells<M::dim>{} && wanted != cells))
            return {};
        using Vector = Eigen::Map<const typename M::Vec>;
        return detail::Grid<M>(cells, Vector(&numbers[M::dim]), Vector(&numbers[2 * M::dim]));
    };
    return {.kind = "grid", .make = make, .restore = restore};
}

}}  // namespace nscdd::NSCDD_ABI
