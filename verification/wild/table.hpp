// What was judged, as a table and as JSON.
#pragma once

#include <nlohmann/json.hpp>

#include "attempt.hpp"

namespace wild {

void print_table(const std::vector<Judged>& judged, const Tally& tally, int worst);
nlohmann::json to_json(const std::vector<Judged>& judged, const Tally& tally);

}  // namespace wild
