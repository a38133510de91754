/// @file
/// Numbers in messages, with two significant digits.
#pragma once

#include <cmath>
#include <sstream>
#include <string>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The number rounded by `round`, such as std::round or std::floor, to two significant digits: 203.4 is "200". For
/// numbers that are not finite or 0 what a stream prints.
inline std::string two_digits(double x, double (*round)(double) = std::round) {
    std::ostringstream text;
    if (x == 0 || !std::isfinite(x)) {
        text << x;
        return text.str();
    }
    const double digit = std::pow(10, std::floor(std::log10(std::abs(x))) - 1);
    text << round(x / digit) * digit;
    return text.str();
}

}}}  // namespace nscdd::NSCDD_ABI::detail
