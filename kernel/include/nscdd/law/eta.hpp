/// @file
/// The energy residual eta, computed from sums over the contacts (METHOD.md, section 5.1).
#pragma once

#include <algorithm>
#include <cmath>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// sqrt(change over the larger energy), with r' the impulses that the law asks for where all others stay:
///   change       sum of (r'-r)^T W (r'-r) [J]
///   energy, next_energy   sum of r^T W r, r'^T W r' [J]; the larger one, so that r = 0 is no answer for free
///   round_off    sum of |v|^2/W_n [J]: no change can be below its round-off squared
inline double energy_residual(double change, double energy, double next_energy, double round_off) {
    if (!std::isfinite(round_off)) return round_off;  // without friction the law takes a NaN for an open contact
    if (change < 1e-28 * round_off) return 0;
    return change > 0 ? std::sqrt(change / (std::max)(energy, next_energy)) : change;  // NaN stays NaN
}

}}}  // namespace nscdd::NSCDD_ABI::detail
