// Options that several subcommands share: what a run starts from, and how it is solved.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "run.hpp"

namespace nscdd {

// The scene, --packing, --from (`going_on`: what it says to this subcommand), --adopt.
void add_source_options(CLI::App& command, RunArguments& run, const std::string& going_on);

// --scheme, one of these with what `help` says of them, --interface, --partition, --method.
void add_scheme_options(CLI::App& command, RunArguments& run, const std::vector<std::string>& schemes,
                        const std::string& help);

CLI::App* add_run(CLI::App& app, RunArguments& arguments);

}  // namespace nscdd
