// Materials of the grains of a packing that a scene deals out: by fractions, by regions.
#pragma once

#include <vector>

#include "files/packing.hpp"
#include "model/region.hpp"

namespace nscdd {

struct MaterialMix {
    std::vector<int> materials;     // indices into Scene::materials; empty: all grains are of [packing] material
    std::vector<double> fractions;  // of the grains by number, of each; their sum is 1
    int seed = 1;                   // of who gets which
    struct Part {
        Region region;
        int material = 0;
    };
    std::vector<Part> parts;  // of several regions the last one that has the grain counts

    bool any() const { return !materials.empty() || !parts.empty(); }
};

// The key fractions of a table, whose sum is 1: so many numbers above 0. Throws InputError as TomlTable does.
std::vector<double> read_fractions(TomlTable& table, std::size_t count);

// How many of n are of each fraction: whole numbers with the sum n, each less than 1 from its share.
std::vector<std::size_t> shares_of(const std::vector<double>& fractions, std::size_t n);

// Sets packing.material. Fractions are met as well as whole numbers can, whichever process has which rows.
void deal_materials(Packing& packing, const MaterialMix& mix, int otherwise);

}  // namespace nscdd
