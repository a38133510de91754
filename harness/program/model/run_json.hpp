// Results as JSON: reports/run.schema.json, and what `nscdd window` and `nscdd calibrate` write.
#pragma once

#include <nlohmann/json.hpp>

#include "model/run_request.hpp"

namespace nscdd {

nlohmann::json run_json(const RunRequest& request, const RunResult& result);

// Of `nscdd window`. The result has a window.
nlohmann::json window_json(const RunRequest& request, const RunResult& result);

}  // namespace nscdd
