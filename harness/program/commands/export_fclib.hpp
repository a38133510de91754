// `nscdd export-fclib`: the contact problem of one step of a scene, solved, for other codes.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "commands/run.hpp"

namespace nscdd {

struct ExportFclibArguments {
    RunArguments run;
    std::string output, form = "local";
    int step = 1, max_iterations = 200000;
    double tolerance = 1e-8;
};

CLI::App* add_export_fclib(CLI::App& app, ExportFclibArguments& arguments);

// Steps the scene by sequential NLGS to its own tolerance, solves the last step on to that of the export, and writes
// its problem and solution. Returns 0, or 3 when the tolerance was not reached. Throws InputError and OutputError.
int export_fclib(const ExportFclibArguments& arguments, const Provenance& provenance);

}  // namespace nscdd
