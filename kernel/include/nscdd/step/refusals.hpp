/// @file
/// The reason why a step is refused, as data and in one line.
#pragma once

#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/core/two_digits.hpp"
#include "nscdd/detect/narrow_phase.hpp"
#include "nscdd/detect/tunnelling.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The exception that Simulation::step() throws, the same on every rank. what() is describe(refusal).
class StepRefused : public std::runtime_error {
  public:
    /// Why a step is impossible: the worst of all pairs, or a reason that is no pair.
    struct Refusal {
        int step = 0;  ///< counted from 1, as the simulation has made them
        int i = -1;    ///< id
        int j = -1;    ///< id; j < 0: wall -1-j
        /// When detected, over the smaller radius [1]; 0: they pass into or through each other unseen.
        double overlap = 0;
        double allowed = 0;  ///< the largest overlap that is allowed, over the smaller radius [1]
        double h = 0;        ///< a step that would do for all pairs of the scene as they move now [s]; 0: none is known
        std::string reason{};  ///< that is no pair; empty where a pair is the reason
    };

    /// Makes the exception for this reason.
    explicit StepRefused(const Refusal& why) : std::runtime_error(describe(why)), refusal(why) {}

    /// The reason in one line, such as "step 12: grain 3 and wall 'floor' overlap by 12 % of a radius (at most 10 %)".
    /// `walls` are their names, empty for their numbers.
    static std::string describe(const Refusal& refusal, std::span<const std::string> walls = {}) {
        const std::string step = "step " + std::to_string(refusal.step) + ": ";
        if (!refusal.reason.empty()) return step + refusal.reason;
        std::string text = step + "grain " + std::to_string(refusal.i) + " and ";
        const auto wall = static_cast<std::size_t>(-1 - refusal.j);
        if (refusal.j >= 0)
            text += "grain " + std::to_string(refusal.j);
        else
            text += "wall " + (wall < walls.size() ? "'" + walls[wall] + "'" : std::to_string(wall));
        const std::string allowed = detail::two_digits(100 * refusal.allowed) + " %";
        if (refusal.overlap > 0)
            return text + " overlap by " + detail::two_digits(100 * refusal.overlap, std::ceil) +
                   " % of a radius (at most " + allowed + ")" +
                   (refusal.j < 0 && refusal.overlap > 1
                        ? ": it is behind the wall, whose normal points into the sample"
                        : "");
        if (refusal.h <= 0) return text + " overlap by more than " + allowed + " of a radius, and come nearer";
        // rounded down; with the step itself round-off would decide
        return text + " pass into or through each other within the step: take h <= " +
               detail::two_digits(0.999 * refusal.h, std::floor) + " s";
    }

    Refusal refusal;  ///< the reason
};

namespace detail {

/// The worst that the ranks have found, Overlap or Tunnelling; found[k]: by the k-th hosted rank. Collective.
template <class Found>
Found worst_of_all(Communicator& comm, const std::vector<Found>& found) {
    std::vector<Buffer> mine;
    for (const auto& [amount, i, j] : found) mine.push_back({amount, double(i), double(j)});
    const std::span<const double> all = comm.all_gather(mine);
    Found worst;
    for (std::size_t p = 0; p < all.size(); p += mine[0].size())
        worst.note({all[p], static_cast<int>(all[p + 1]), static_cast<int>(all[p + 2])});
    return worst;
}

/// Throws StepRefused with the worst that the ranks have found. Collective.
[[noreturn]] inline void refuse(Communicator& comm, int step, const std::vector<Overlap>& found, double allowed) {
    const Overlap worst = worst_of_all(comm, found);
    throw StepRefused({.step = step, .i = worst.i, .j = worst.j, .overlap = worst.ratio, .allowed = allowed});
}

/// Throws StepRefused with the worst tunnelling. within[k] is the step that would do for all pairs of the k-th hosted
/// rank [s]. Collective.
[[noreturn]] inline void refuse(Communicator& comm, int step, const std::vector<Tunnelling>& found,
                                const std::vector<double>& within, double allowed) {
    const Tunnelling worst = worst_of_all(comm, found);
    const double others = -reduce(comm, 0, [&within](std::size_t k) { return Buffer{-within[k]}; })[0];
    throw StepRefused({.step = step, .i = worst.i, .j = worst.j, .allowed = allowed, .h = (std::min)(worst.h, others)});
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
