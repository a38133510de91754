// What a run leaves out of the physics without being asked to, in lines that are said at its start.
#pragma once

#include <string>
#include <vector>

#include "model/run_request.hpp"

namespace nscdd {

// A line each: materials that can touch and have no [[pair]], gravity without a wall that faces it, one subdomain of a
// scheme for several. `grains_of`: number of grains of each material.
std::vector<std::string> notes(const RunRequest& request, const std::vector<double>& grains_of);

}  // namespace nscdd
