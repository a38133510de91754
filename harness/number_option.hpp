// Checks of numbers on the command line. CLI11's own checks let NaN pass.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
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

inline CLI::Validator positive_number() { return between(0, INFINITY); }

}  // namespace nscdd
