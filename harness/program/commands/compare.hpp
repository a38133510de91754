// `nscdd compare`: tells whether a run agrees with its reference.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "files/report_json.hpp"

namespace nscdd {

struct CompareArguments {
    std::string reference, candidate;  // files
    std::optional<std::string> json;   // file to write
};

CLI::App* add_compare(CLI::App& app, CompareArguments& arguments);

// Reference and candidate are JSON files of `nscdd run` whose states were written. Prints a table, writes it as JSON if
// asked, and returns 0 when every row is within its bound, 5 when the runs are two answers of one problem, 2 otherwise.
// Throws InputError for files that are not of such runs, or of runs of two scenes, and OutputError.
int compare(const CompareArguments& arguments, const Provenance& provenance);

}  // namespace nscdd
