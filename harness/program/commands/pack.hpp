// `nscdd pack`: a packing from nothing but numbers, by LAMMPS or by our own contact dynamics.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "files/report_json.hpp"

namespace nscdd {

struct PackArguments {
    std::string specification, output;
    std::optional<std::string> generator;  // auto, lammps or own; else as the specification says
    bool quiet = false;
};

CLI::App* add_pack(CLI::App& app, PackArguments& arguments);

// Grains are thrown at random into a large box and brought together until they jam, or have the solid fraction asked
// for. Whichever generator does it, a common shrink of the radii takes the overlaps away, and the packing is checked
// before it is written. Returns the exit code; throws InputError and OutputError.
int pack(const PackArguments& arguments, const Provenance& provenance);

}  // namespace nscdd
