// What a packing is judged by before it is written, whichever generator made it.
#pragma once

#include <string>

#include "files/packing.hpp"

namespace nscdd {

struct PackingMeasures {
    double solid_fraction = 0;  // of the whole box
    double overlap = 0;         // the largest, in mean diameters, before the radii were shrunk
    double shrink = 0;          // 1 - the factor of the radii
    double smallest_gap = 0;    // in mean diameters, after it; >= 0
    double rattlers = 0;        // share of the grains with too few contacts to be held

    // The core: farther than `margin` mean diameters from every wall, or than a quarter of the box where it is narrower
    // than four margins. Of a box that repeats along all axes, all of it.
    static constexpr double margin = 2;
    int core_grains = 0;
    double counted = 0;  // core grains, at most those of a cube with the core's shortest edge; sets how wide bounds are
    double core_fraction = 0;      // solid fraction of the core
    double core_coordination = 0;  // contacts per grain, without rattlers
};

// Takes the overlaps away by one common shrink of the radii, so that every gap is >= 0 in doubles, and measures.
PackingMeasures remove_overlaps(Packing& packing);

// What was asked for.
struct WantedPacking {
    int dim;
    double spread, solid_fraction;  // 0: to be jammed
};

// Throws InputError, which names `path` and what is out of bounds.
void check_packing(const std::string& path, const PackingMeasures& measures, const WantedPacking& wanted);

}  // namespace nscdd
