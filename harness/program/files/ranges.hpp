// Ranges of the numbers that users give, and how messages put them.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>

#include "nscdd/iterate/options.hpp"

namespace nscdd {

inline constexpr double infinite = std::numeric_limits<double>::infinity();
inline constexpr detail::OptionRange any_number{-infinite, infinite}, positive{0, infinite, true},
    non_negative{0, infinite}, unit_interval{0, 1};

// What files and the command line take of an option: a solver can do with a tolerance of 0 and bounds without an end,
// which no user means.
inline detail::OptionRange in_files(detail::OptionRange range, double) {
    return {range.low, range.high, range.open || std::isinf(range.high)};
}
inline detail::OptionRange in_files(detail::OptionRange range, int) { return range; }

// "> 0", ">= 0", "in [0, 1]", "in (0, 2)", of any number "finite".
inline std::string told(const detail::OptionRange& range) {
    if (std::isinf(range.low)) return "finite";
    if (std::isinf(range.high)) return fmt::format("{} {}", range.open ? ">" : ">=", range.low);
    return fmt::format("in {}{}, {}{}", range.open ? '(' : '[', range.low, range.high, range.open ? ')' : ']');
}

}  // namespace nscdd
