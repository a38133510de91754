// Why a step is refused, in one line.
#pragma once

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"
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

// Throws std::runtime_error with the worst that the ranks have found, Overlap or Passage; found[k]: by the k-th hosted
// rank. Collective.
template <class Found>
[[noreturn]] void refuse(Communicator& comm, int step, const std::vector<Found>& found, double largest_overlap) {
    std::vector<Buffer> mine;
    for (const auto& [amount, i, j] : found) mine.push_back({amount, double(i), double(j)});
    const std::span<const double> all = comm.all_gather(mine);
    Found worst;
    for (std::size_t p = 0; p < all.size(); p += mine[0].size())
        worst.note({all[p], static_cast<int>(all[p + 1]), static_cast<int>(all[p + 2])});
    throw std::runtime_error(refusal(step, worst, largest_overlap));
}

}  // namespace nscdd
