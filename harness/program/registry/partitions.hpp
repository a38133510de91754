// Partitions that --partition names, a line each.
#pragma once

#include "nscdd/partition/bisection.hpp"
#include "nscdd/partition/grid.hpp"
#include "nscdd/partition/metis.hpp"
#include "registry/choices.hpp"
#include "registry/offered.hpp"
#include "registry/registry.hpp"

namespace nscdd {

namespace registry_detail {

template <class M>
detail::GridCells<M::dim> grid_cells(const PartitionChoice& choice) {
    detail::GridCells<M::dim> cells{};
    if (choice.grid.empty()) return cells;
    if (choice.grid.size() != M::dim) throw InputError("--grid needs " + std::to_string(M::dim) + " numbers");
    std::copy(choice.grid.begin(), choice.grid.end(), cells.begin());
    return cells;
}

}  // namespace registry_detail

inline constexpr std::tuple partitions{
    Offered{PartitionInfo{"grid", "equal cells, as in the paper"},
            []<class M>(const PartitionChoice& r) { return by_grid<M>(registry_detail::grid_cells<M>(r)); }},
    Offered{PartitionInfo{"bisection", "cut by cut, equal numbers of contacts"},
            []<class M>(const PartitionChoice& r) { return by_bisection<M>(r.imbalance()); }},
    Offered{PartitionInfo{"metis", "the same with few grains shared"},
            []<class M>(const PartitionChoice& r) { return by_metis<M>(r.imbalance()); }},
};

template <class M>
Partitioner<M> choose_partition(const PartitionChoice& choice) {
    return make_offered<M, Partitioner<M>>(partitions, choice.chosen(), choice);
}

}  // namespace nscdd
