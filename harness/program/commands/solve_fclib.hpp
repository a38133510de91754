// `nscdd solve-fclib`: solves a contact problem of any code and says how well.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "files/report_json.hpp"

namespace nscdd {

struct SolveFclibArguments {
    std::string file, solver = "auto";
    std::optional<std::string> output, json;  // files to write
    double tolerance = 1e-8;
    int max_sweeps = 200000, check_every = 10;
};

CLI::App* add_solve_fclib(CLI::App& app, SolveFclibArguments& arguments);

// Prints one line of measures, writes what is asked for, and returns 0, or 3 when the tolerance was not reached. Throws
// InputError and OutputError.
int solve_fclib(const SolveFclibArguments& arguments, const Provenance& provenance);

}  // namespace nscdd
