// Why a step is refused, in one line.
#pragma once

#include <cmath>
#include <sstream>
#include <string>

#include "nscdd/detect/fine.hpp"
#include "nscdd/detect/passage.hpp"

namespace nscdd::inline NSCDD_ABI {

// Names the two bodies, such as "step 12: grain 3 and wall 1"; ids as in GatheredContact.
inline std::string pair_of_step(int step, int i, int j) {
    return "step " + std::to_string(step) + ": grain " + std::to_string(i) + " and " +
           (j < 0 ? "wall " + std::to_string(-1 - j) : "grain " + std::to_string(j));
}

// The message of Simulation::step() when it refuses. largest_overlap: that of SimulationSettings, over a radius [1].
inline std::string refusal(int step, const Overlap& worst, double largest_overlap) {
    return pair_of_step(step, worst.i, worst.j) + " overlap by " + std::to_string(100 * worst.ratio) +
           " % of a radius (at most " + std::to_string(100 * largest_overlap) + " %)";
}

inline std::string refusal(int step, const Passage& worst, double largest_overlap) {
    const std::string pair = pair_of_step(step, worst.i, worst.j);
    if (worst.h <= 0)
        return pair + " overlap by more than " + std::to_string(100 * largest_overlap) + " % of a radius, and close";
    // two figures, rounded down; with the step itself round-off would decide
    const double least = 0.999 * worst.h, digit = std::pow(10, std::floor(std::log10(least)) - 1);
    std::ostringstream h;
    h << std::floor(least / digit) * digit;
    return pair + " pass into or through each other within the step: take h <= " + h.str() + " s";
}

}  // namespace nscdd
