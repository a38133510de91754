// The regular grid that deals points to subdomains (paper, section 3.1).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include "nscdd/core/model.hpp"

namespace nscdd::inline NSCDD_ABI {

template <int dim>
using GridCells = std::array<int, dim>;

// The factorisation of `count` over the axes whose cells are nearest to cubes (least cut area): 3 -> 3x1x1,
// 4 -> 2x2x1, 8 -> 2x2x2 in a cube, as in Table 1 of the paper. Ties go to more cells along the first axes.
template <class M>
GridCells<M::dim> choose_cells(int count, const typename M::Vec& extent) {
    if (count < 1) throw std::invalid_argument("a scene has at least one subdomain");
    GridCells<M::dim> best{};
    double least = 0;
    const auto consider = [&](const GridCells<M::dim>& cells) {
        double cut = 0;
        for (int d = 0; d < M::dim; ++d) {
            double area = cells[static_cast<std::size_t>(d)] - 1;
            for (int e = 0; e < M::dim; ++e)
                if (e != d) area *= extent[e];
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

// Whether there is one cell for each rank. Cells of whatever sign or size, which a file may bring.
inline bool one_cell_each(std::span<const int> cells, int ranks) {
    for (const int count : cells) {
        if (count < 1 || ranks % count != 0) return false;
        ranks /= count;
    }
    return ranks == 1;
}

// Throws std::invalid_argument unless there is at least one cell along each axis, and as many in all as ranks.
template <int dim>
void check_cells(const GridCells<dim>& cells, int ranks) {
    if (!one_cell_each(cells, ranks))
        throw std::invalid_argument("the grid's cells must be at least 1 along each axis, and as many as the ranks (" +
                                    std::to_string(ranks) + ")");
}

template <class M>
class Grid {
  public:
    // Equal cells over the box [low, high]; points outside belong to the nearest cell. Throws std::invalid_argument for
    // a grid without cells, or a box that is not finite.
    Grid(const GridCells<M::dim>& cells, const typename M::Vec& low, const typename M::Vec& high)
        : cells_(cells), low_(low), size_(high - low) {
        if (std::ranges::min(cells) < 1) throw std::invalid_argument("a grid has at least one cell along each axis");
        if (!low.allFinite() || !size_.allFinite()) throw std::invalid_argument("the box of a grid must be finite");
    }

    int owner(const typename M::Vec& point) const {
        int rank = 0;
        for (int d = M::dim - 1; d >= 0; --d) rank = rank * cells(d) + cell(point[d], d);
        return rank;
    }

    // Calls visit(rank) for every subdomain whose cell comes within `reach` (per axis) of the point.
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

    static std::string name(const GridCells<M::dim>& cells) {
        std::string text = "grid ";
        for (int d = 0; d < M::dim; ++d) {
            if (d > 0) text += 'x';
            text += std::to_string(cells[static_cast<std::size_t>(d)]);
        }
        return text;
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
    typename M::Vec low_, size_;
};

}  // namespace nscdd
