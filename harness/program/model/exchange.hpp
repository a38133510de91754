// Grains that enter and leave a scene while it runs: [[insert]] and [[remove]].
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "model/radii.hpp"
#include "model/region.hpp"

namespace nscdd {

// When: from `from` to `until`, and in between at `times`, or at a rate.
struct Schedule {
    double from = 0, until = std::numeric_limits<double>::infinity();  // time of the scene [s]
    std::optional<double> rate;                                        // grains a second
    std::vector<double> times;                                         // ascending [s]; empty: not at given ones

    bool covers(double time) const { return from <= time && time <= until; }
    // By rate: the grains that are due up to a time, the first one at `from`.
    double due(double time) const;
};

// When a step begins, and the ones before and after it [s].
struct StepTimes {
    double before, now, next;
};

struct SceneRemoval {
    Region region;
    Schedule when;

    // How many grains a step may take. By rate: as many as have become due since the step before; no step makes up for
    // what others did not take.
    double allowed(const StepTimes& step) const;
};

struct SceneInsertion {
    Region box;
    int material = 0;                         // index into Scene::materials
    double radius = 0;                        // [m]; 0: as `radii` say
    std::optional<RadiiSpecification> radii;  // each grain draws from it
    Eigen::VectorXd velocity;                 // (dim) [m/s]
    Schedule when;
    std::optional<int> count;  // with times: at each; else: of all. Without: no end
    int seed = 1;

    double largest_radius() const { return radii ? radii->largest : radius; }
    // How many grains are due at the beginning of a step.
    double due(double time) const;
    // All that are ever due; infinite where there is no end.
    double total() const { return due(std::numeric_limits<double>::infinity()); }
    // Radius of the number-th grain that this entry inserts, and the place of a try to insert it in a step: within the
    // box as a whole. They follow from the seed and these numbers alone.
    double radius_of(std::uint64_t entry, std::uint64_t number, int dim) const;
    Eigen::VectorXd place_of(std::uint64_t entry, std::uint64_t number, std::uint64_t step, std::uint64_t trial,
                             double grain_radius) const;
};

struct SceneExchange {
    std::vector<SceneRemoval> removals;
    std::vector<SceneInsertion> insertions;

    bool any() const { return !removals.empty() || !insertions.empty(); }
    // Whether no grain is still to come, of those that each entry has inserted.
    bool all_inserted(const std::vector<double>& inserted) const;
    std::string text() const;  // all of its numbers, for checksums
};

// Throw InputError as TomlTable does. The whole table is read but for the material.
SceneRemoval read_removal(TomlTable& table, int dim);
SceneInsertion read_insertion(TomlTable& table, int dim);

}  // namespace nscdd
