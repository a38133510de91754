// Options that several subcommands share: what a run starts from, and how it is solved.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "commands/run.hpp"

namespace nscdd {

// The most subdomains of one process: each takes some KB, whether there is a grain in it or not.
inline constexpr int largest_subdomains = 65536;

// The scene, --packing, --from (`going_on`: what it says to this subcommand), --adopt.
void add_source_options(CLI::App& command, RunArguments& run, const std::string& going_on);

// --scheme, one of those that `wanted` says, --interface, --multiplicity, --partition, --method.
void add_scheme_options(CLI::App& command, RunArguments& run, bool (*wanted)(const SchemeInfo&));

// --grid.
void add_grid_option(CLI::App& command, RunArguments& run);

// --within-node, read by within_node() of session.hpp.
void add_within_node_option(CLI::App& command, RunArguments& run);

CLI::App* add_run(CLI::App& app, RunArguments& arguments);

}  // namespace nscdd
