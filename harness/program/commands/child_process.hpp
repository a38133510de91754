// Another program, started and waited for.
#pragma once

#include <string>
#include <vector>

namespace nscdd {

// Runs words[0], found on PATH, with the other words as its arguments, and what it prints into the file `log`. Throws
// std::runtime_error, with the last words of the log, unless it ends with exit code 0. It runs in `folder`, which its
// caller removes with the log, or in the current folder.
void run_program(const std::vector<std::string>& words, const std::string& log, const std::string& folder = "");

// Whether PATH has a program of this name.
bool on_path(const std::string& name);

}  // namespace nscdd
