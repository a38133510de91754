// What was judged, as a table and as a record.
#pragma once

#include <nlohmann/json.hpp>

#include "attempt.hpp"

namespace wild {

// `worst`: number of accepted steps to list, the farthest from the answer first.
void print_table(const std::vector<Judged>& judged, const Tally& tally, std::size_t worst);
// Rows by solver and by family, and the worst steps (reports/wild.schema.json).
nlohmann::json to_json(const std::vector<Judged>& judged, const Tally& tally, std::size_t worst);

}  // namespace wild
