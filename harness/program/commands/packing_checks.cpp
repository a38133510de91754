#include "commands/packing_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "files/error.hpp"
#include "nscdd/core/model.hpp"
#include "nscdd/detect/close_pairs.hpp"

namespace nscdd {

namespace {

// In mean diameters: a pair with a smaller gap, before the radii are shrunk, counts as a contact. In a jammed packing
// of 2,000 disks by LAMMPS, 0.3 % of these pairs do not push.
constexpr double contact_gap = 1e-4;
constexpr double most_overlap = 1e-3;

// Bounds of the core of a jammed packing of many grains; in a core of n grains both ends are wider by a number over
// sqrt(n). Both generators stay within three quarters of that from 40 to 1,000 grains, with up to six seeds.
struct CoreBounds {
    double fraction[2], fraction_few, coordination[2], coordination_few;
};
constexpr CoreBounds disks{{0.82, 0.86}, 0.2, {3.5, 4.1}, 3};
constexpr CoreBounds spheres{{0.60, 0.65}, 0.5, {5.5, 6.2}, 5};

struct Near {
    std::size_t i, j;  // j == size(): a wall
    double distance;   // of the centres, or of the centre from the wall
};

double mean_diameter(const Packing& packing) {
    double sum = 0;
    for (const double radius : packing.radius) sum += 2 * radius;
    return sum / static_cast<double>(packing.size());
}

// Distance at which the two touch: the sum of their radii, 0 for a wall.
double contact_distance(const Packing& packing, const Near& near) {
    return packing.radius[near.i] + (near.j < packing.size() ? packing.radius[near.j] : 0.0);
}

// Adds all pairs of grains whose gap is less than `gap`.
template <int dim>
void add_grain_pairs(const Packing& packing, double gap, std::vector<Near>& pairs) {
    using M = Model<dim, Frictionless>;
    std::vector<Grain<M>> grains;
    for (std::size_t i = 0; i < packing.size(); ++i)
        grains.push_back(make_grain<M>(static_cast<int>(i), packing.radius[i], 1.0,
                                       Eigen::Map<const typename M::Vec>(packing.x.data() + i * dim)));
    const double widest = 2 * *std::ranges::max_element(packing.radius) + gap;
    const auto all = [](const auto&, const auto&) { return true; };
    Cell<M> cell;
    for (std::size_t d = 0; d < packing.periodic.size(); ++d) {
        cell.periodic[d] = packing.periodic[d] != 0;
        cell.size[static_cast<int>(d)] = packing.box[d];
    }
    const auto add = [&](std::size_t i, std::size_t j) {
        const typename M::Vec apart = cell.apart(grains[i].position, grains[j].position);
        double square = 0;  // in this order: checksums of packings hang on the last bit
        for (int d = 0; d < dim; ++d) square += std::pow(apart[d], 2);
        pairs.push_back({i, j, std::sqrt(square)});
    };
    try {
        for (const detail::GrainPair& pair :
             cell.repeats() ? detail::close_pairs<M>(grains, cell, widest, gap, all)
                            : detail::close_pairs<M>(grains, detail::Cells<M>(grains, widest), gap, all))
            add(static_cast<std::size_t>(pair.i), static_cast<std::size_t>(pair.j));
    } catch (const detail::TooManyPairs& refused) {  // the deepest of a heap of grains says enough
        add(static_cast<std::size_t>(refused.i), static_cast<std::size_t>(refused.j));
    }
}

bool repeats(const Packing& packing, std::size_t axis) {
    return axis < packing.periodic.size() && packing.periodic[axis] != 0;
}

// All pairs of grains, and of grains and walls, whose gap is less than `gap`.
std::vector<Near> near_pairs(const Packing& packing, double gap) {
    const auto dim = static_cast<std::size_t>(packing.dim);
    const std::size_t n = packing.size();
    std::vector<Near> pairs;
    packing.dim == 3 ? add_grain_pairs<3>(packing, gap, pairs) : add_grain_pairs<2>(packing, gap, pairs);
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t d = 0; d < dim; ++d)
            for (const double distance :
                 repeats(packing, d) ? std::vector<double>{}
                                     : std::vector{packing.x[i * dim + d], packing.box[d] - packing.x[i * dim + d]})
                if (distance - packing.radius[i] < gap) pairs.push_back({i, n, distance});
    return pairs;
}

// The share of the volume of a disk or sphere on the inner side of a plane `t` radii from its centre; t > 0: the centre
// is inside.
double cut_share(double t, int dim) {
    t = std::clamp(t, -1.0, 1.0);
    if (dim == 3) return (2 + 3 * t - t * t * t) / 4;
    return 0.5 + (t * std::sqrt(1 - t * t) + std::asin(t)) / std::numbers::pi;
}

double volume(double radius, int dim) {
    return dim == 3 ? 4.0 / 3 * std::numbers::pi * radius * radius * radius : std::numbers::pi * radius * radius;
}

// Grains that contacts can hold: those with dim + 1 contacts with walls or with grains that are held themselves.
std::vector<char> held_grains(const Packing& packing, const std::vector<Near>& contacts) {
    const std::size_t n = packing.size();
    std::vector<char> held(n + 1, true);
    for (bool changed = true; changed;) {
        std::vector<int> count(n + 1);
        for (const Near& c : contacts)
            if (held[c.i] && held[c.j]) ++count[c.i], ++count[c.j];
        changed = false;
        for (std::size_t i = 0; i < n; ++i)
            if (held[i] && count[i] <= packing.dim) held[i] = false, changed = true;
    }
    return held;
}

void measure_core(const Packing& packing, const std::vector<Near>& contacts, double diameter, PackingMeasures& m) {
    const auto dim = static_cast<std::size_t>(packing.dim);
    const std::size_t n = packing.size();
    double narrowest = std::numeric_limits<double>::infinity();  // between walls
    for (std::size_t d = 0; d < dim; ++d)
        if (!repeats(packing, d)) narrowest = std::min(narrowest, packing.box[d]);
    const double margin = std::min(m.margin * diameter, narrowest / 4);
    double room = 1, solid = 0, all = 0, width = std::numeric_limits<double>::infinity();
    for (std::size_t d = 0; d < dim; ++d) {
        const double edge = packing.box[d] - (repeats(packing, d) ? 0 : 2 * margin);
        room *= edge;
        width = std::min(width, edge / diameter);
    }
    std::vector<char> core(n + 1, true);
    for (std::size_t i = 0; i < n; ++i) {
        double share = 1;  // exact but for grains at edges of the core
        for (std::size_t d = 0; d < dim; ++d) {
            if (repeats(packing, d)) continue;
            const double x = packing.x[i * dim + d];
            core[i] = core[i] && x > margin && x < packing.box[d] - margin;
            share *= cut_share((x - margin) / packing.radius[i], packing.dim) *
                     cut_share((packing.box[d] - margin - x) / packing.radius[i], packing.dim);
        }
        all += volume(packing.radius[i], packing.dim);
        solid += share * volume(packing.radius[i], packing.dim);
    }
    m.core_fraction = solid / room;
    double box = 1;
    for (const double edge : packing.box) box *= edge;
    m.solid_fraction = all / box;

    const std::vector<char> held = held_grains(packing, contacts);
    int touching = 0, held_core = 0, held_all = 0;
    for (const Near& c : contacts)
        if (held[c.i] && held[c.j]) touching += (core[c.i] ? 1 : 0) + (c.j < n && core[c.j] ? 1 : 0);
    for (std::size_t i = 0; i < n; ++i) {
        m.core_grains += core[i];
        held_all += held[i];
        held_core += held[i] && core[i];
    }
    m.counted = std::min<double>(m.core_grains, std::pow(width, packing.dim));
    m.core_coordination = held_core ? static_cast<double>(touching) / held_core : 0;
    m.rattlers = 1 - static_cast<double>(held_all) / static_cast<double>(n);
}

}  // namespace

PackingMeasures remove_overlaps(Packing& packing) {
    const double diameter = mean_diameter(packing);
    PackingMeasures measures;
    const std::vector<Near> contacts = near_pairs(packing, contact_gap * diameter);
    measure_core(packing, contacts, diameter, measures);
    double factor = 1;
    for (const Near& c : contacts) {
        measures.overlap = std::max(measures.overlap, (contact_distance(packing, c) - c.distance) / diameter);
        factor = std::min(factor, c.distance / contact_distance(packing, c));
    }
    factor *= 1 - 1e-14;  // for the rounding of products and sums of radii, here and where others subtract them
    for (double& radius : packing.radius) radius *= factor;
    measures.shrink = 1 - factor;
    measures.solid_fraction *= std::pow(factor, packing.dim);
    measures.core_fraction *= std::pow(factor, packing.dim);
    measures.smallest_gap = std::numeric_limits<double>::infinity();
    for (const Near& c : near_pairs(packing, 2 * contact_gap * diameter))
        measures.smallest_gap = std::min(measures.smallest_gap, (c.distance - contact_distance(packing, c)) / diameter);
    return measures;
}

void check_packing(const std::string& path, const PackingMeasures& measures, const WantedPacking& wanted) {
    const auto require = [&](const char* what, double value, double low, double high) {
        if (!(value >= low && value <= high))
            throw InputError(
                fmt::format("{}: {} {:.6g} of the packing is out of bounds, {:.4g} to {:.4g}: nothing is written", path,
                            what, value, low, high));
    };
    constexpr double infinity = std::numeric_limits<double>::infinity();
    require("largest overlap in diameters", measures.overlap, 0, most_overlap);
    require("smallest gap in diameters", measures.smallest_gap, 0, infinity);
    if (wanted.solid_fraction > 0) {
        require("solid fraction", measures.solid_fraction, wanted.solid_fraction - 0.005, wanted.solid_fraction + 0.02);
        return;
    }
    // Equal disks crystallise, and small grains fill the pores of much larger ones: no bounds are known for those.
    if (wanted.spread > 0.3 || (wanted.dim == 2 && wanted.spread < 0.1)) return;
    const CoreBounds& bounds = wanted.dim == 3 ? spheres : disks;
    const double few = 1 / std::sqrt(std::max(1.0, measures.counted));
    const double phi = bounds.fraction_few * few, z = bounds.coordination_few * few;
    require("solid fraction of the core", measures.core_fraction, bounds.fraction[0] - phi, bounds.fraction[1] + phi);
    require("coordination of the core without rattlers", measures.core_coordination, bounds.coordination[0] - z,
            bounds.coordination[1] + z);
    require("share of rattlers", measures.rattlers, 0, 0.15 + 0.5 * few);
}

}  // namespace nscdd
