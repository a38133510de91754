// `nscdd compare`: tells whether a run agrees with its reference.
#pragma once

#include <string>

#include "report_json.hpp"

namespace nscdd {

// Both arguments are JSON files of `nscdd run` whose states were written. Prints a table, writes it as JSON if asked,
// and returns 0 when every row is within its bound, 5 when the runs are two answers of one problem, 2 otherwise. Throws
// InputError for files that are not of such runs, or of runs of two scenes, and OutputError.
int compare(const std::string& reference, const std::string& candidate, const std::string& json,
            const Provenance& provenance);

}  // namespace nscdd
