// Checks of numbers on the command line. CLI11's own checks let NaN pass.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

namespace nscdd {

// Checks that a number is within (low, high), or [low, high] where `closed`.
inline CLI::Validator between(double low, double high, bool closed = false) {
    return CLI::Validator(
        [=](std::string& text) -> std::string {
            double value = NAN;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            const bool number = error == std::errc{} && end == text.data() + text.size();
            if (number && ((value > low && value < high) || (closed && (value == low || value == high)))) return {};
            return std::isinf(high) ? fmt::format("must be a finite number > {}, found {}", low, text)
                                    : fmt::format("must be a number in {}{}, {}{}, found {}", closed ? '[' : '(', low,
                                                  high, closed ? ']' : ')', text);
        },
        "NUMBER");
}

// Checks that a number is whole and within [low, high].
inline CLI::Validator whole_number(int low = 1, int high = std::numeric_limits<int>::max()) {
    return CLI::Validator(
        [=](std::string& text) -> std::string {
            int value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            const bool whole = end == text.data() + text.size() && !text.empty();
            if (whole && error == std::errc{} && value >= low && value <= high) return {};
            const bool bounded = high < std::numeric_limits<int>::max() || error == std::errc::result_out_of_range;
            return fmt::format("must be a whole number, at least {}{}, found {}", low,
                               bounded ? fmt::format(" and at most {}", high) : "", text);
        },
        "NUMBER");
}

inline CLI::Validator positive_number() { return between(0, INFINITY); }

}  // namespace nscdd
