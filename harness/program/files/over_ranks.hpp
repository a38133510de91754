// How a number spreads over ranks, as results tell it.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

namespace nscdd {

// Least, mean and largest value of one column of rows, one a rank: {least, mean, largest}.
inline nlohmann::json over_ranks(std::span<const double> rows, std::size_t columns, std::size_t column) {
    double least = rows[column], sum = 0, largest = least;
    for (std::size_t at = column; at < rows.size(); at += columns) {
        least = std::min(least, rows[at]);
        largest = std::max(largest, rows[at]);
        sum += rows[at];
    }
    return {{"least", least}, {"mean", sum * double(columns) / double(rows.size())}, {"largest", largest}};
}

}  // namespace nscdd
