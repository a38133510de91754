// What somebody may have meant.
#pragma once

#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

namespace nscdd {

// Single characters to insert, delete or replace between two words (Levenshtein's distance).
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t before = row[0]++;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t replaced = before + (a[i] != b[j]);
            before = row[j + 1];
            row[j + 1] = std::min({replaced, before + 1, row[j] + 1});
        }
    }
    return row.back();
}

// A suggestion in brackets with the nearest word after `before`, or "" where more than about half of its letters
// differ.
inline std::string did_you_mean(std::string_view word, const std::vector<std::string>& known,
                                const std::string& before = "") {
    const auto distance = [&](const std::string& other) { return edit_distance(word, other); };
    const auto nearest = std::ranges::min_element(known, {}, distance);
    if (nearest == known.end() || nearest->size() < 3 || 2 * distance(*nearest) > nearest->size() + 1) return "";
    return " (did you mean '" + before + *nearest + "'?)";
}

}  // namespace nscdd
