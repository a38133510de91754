// The generators of `nscdd pack`, and the start that they share.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "files/error.hpp"
#include "files/packing.hpp"
#include "model/radii.hpp"
#include "nscdd/nscdd.hpp"

namespace nscdd {

struct PackSpecification {
    std::string path;  // of the file
    int dimension = 3, grains = 0, seed = 1;
    double radius = 0.5;                      // mean
    double spread = 0;                        // radii are uniform in radius (1 -+ spread)
    double largest = 0;                       // radius
    std::optional<RadiiSpecification> radii;  // in place of the two above, which are then what they come to
    std::vector<double> drawn;                // of each grain, where `radii` are given
    Eigen::VectorXd aspect;                   // edges of the box, relative
    std::vector<int> periodic;                // axes along which the box repeats
    double loose_fraction = 0;                // solid fraction at the start
    double solid_fraction = 0;                // to stop at; 0: go on until jammed
};

// What a generator made: its overlaps are still there.
struct Generated {
    Packing packing;
    std::string generator;  // with version
};

// A packing pressed by frictionless walls or, where the box repeats along all axes, by a stress.
Generated pack_by_walls(const PackSpecification& spec, bool quiet);

// A packing by `lmp`, found on PATH, which lets the radii grow. Its files are in a folder beside `output`, which is
// removed.
Generated pack_by_lammps(const PackSpecification& spec, const std::string& output);

namespace pack_detail {

// Random sequential addition: a place is drawn until it is free. False when one is not found for a grain: beside walls
// the sample saturates at lower fractions than in bulk.
template <class M>
bool place_grains(std::vector<Grain<M>>& grains, const Cell<M>& box, double cell, auto&& uniform) {
    constexpr int most_draws = 1'000'000;
    std::array<int, M::dim> along{};  // cells; of axes that repeat they must fit
    const auto repeats = [&box](int d) { return box.periodic[static_cast<std::size_t>(d)]; };
    for (int d = 0; d < M::dim; ++d) along[static_cast<std::size_t>(d)] = static_cast<int>(box.size[d] / cell);
    std::map<std::array<int, M::dim>, std::vector<const Grain<M>*>> cells;
    for (auto& grain : grains) {
        bool free = false;
        for (int draws = 0; !free; ++draws) {
            if (draws == most_draws) return false;
            std::array<int, M::dim> at{}, near{};
            for (int d = 0; d < M::dim; ++d) {
                const auto axis = static_cast<std::size_t>(d);
                if (repeats(d)) {
                    grain.position[d] = uniform() * box.size[d];
                    at[axis] = static_cast<int>(grain.position[d] / box.size[d] * along[axis]);
                } else {
                    grain.position[d] = grain.radius + uniform() * (box.size[d] - 2 * grain.radius);
                    at[axis] = static_cast<int>(grain.position[d] / cell);
                }
            }
            free = true;
            for (int n = 0; free && n < (M::dim == 3 ? 27 : 9); ++n) {
                for (int d = 0, rest = n; d < M::dim; ++d, rest /= 3) {
                    const auto axis = static_cast<std::size_t>(d);
                    near[axis] = at[axis] + rest % 3 - 1;
                    if (repeats(d)) near[axis] = (near[axis] + along[axis]) % along[axis];
                }
                if (const auto found = cells.find(near); found != cells.end())
                    for (const Grain<M>* other : found->second)
                        free &= box.apart(other->position, grain.position).norm() > other->radius + grain.radius;
            }
            if (free) cells[at].push_back(&grain);
        }
    }
    return true;
}

}  // namespace pack_detail

// Grains at random places in a box of the loose fraction, or of a lower one where they find no place. Throws InputError
// where the box is too narrow.
template <class M>
std::vector<Grain<M>> throw_grains(const PackSpecification& spec, Cell<M>& box) {
    std::mt19937_64 random(static_cast<std::uint64_t>(spec.seed));
    const auto uniform = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };  // the same everywhere
    std::vector<Grain<M>> grains;
    double volume = 0;
    for (int id = 0; id < spec.grains; ++id) {
        const double radius = spec.radii ? spec.drawn[static_cast<std::size_t>(id)]
                                         : spec.radius * (1 + spec.spread * (2 * uniform() - 1));
        volume += grains.emplace_back(make_grain<M>(id, radius, 1.0, M::Vec::Zero())).mass;
    }
    box.size = spec.aspect * std::pow(volume / spec.loose_fraction / spec.aspect.prod(), 1.0 / M::dim);
    for (const int axis : spec.periodic) box.periodic[static_cast<std::size_t>(axis)] = true;
    const double largest = 2 * spec.largest;
    if (!(box.size.minCoeff() >= 2 * largest))
        throw InputError(spec.path + ": too few grains for a box of this aspect");
    // large ones would find no place among many small ones
    if (spec.radii) std::ranges::stable_sort(grains, std::greater<>(), &Grain<M>::radius);
    while (!pack_detail::place_grains<M>(grains, box, largest, uniform)) box.size *= 1.05;
    if (spec.radii) std::ranges::sort(grains, {}, &Grain<M>::id);
    return grains;
}

template <class M>
void note_periodic(const Cell<M>& cell, Packing& packing) {
    if (cell.repeats()) packing.periodic.assign(cell.periodic.begin(), cell.periodic.end());
}

// Mass of all grains, at unit density.
template <class M>
double total_mass(const std::vector<Grain<M>>& grains) {
    double mass = 0;
    for (const auto& grain : grains) mass += grain.mass;
    return mass;
}

}  // namespace nscdd
