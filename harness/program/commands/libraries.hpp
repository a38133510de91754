// The libraries that the program's times depend on.
#pragma once

#include <map>
#include <string>

namespace nscdd {

// Versions by name: those of the program's build, but for MPI's, which is asked of the library itself.
std::map<std::string, std::string> libraries();

}  // namespace nscdd
