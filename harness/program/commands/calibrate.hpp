// `nscdd calibrate`: what counted work costs on this core, for the simulated machines (costs.hpp).
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "commands/run.hpp"

namespace nscdd {

struct CalibrateArguments {
    RunArguments run;
    std::vector<int> subdomains{1, 2, 4, 8, 16, 32, 64, 128, 256, 512};
    double seconds = 0.05;  // of a sample; the median of five counts
    std::string output;
};

CLI::App* add_calibrate(CLI::App& app, CalibrateArguments& arguments);

// Returns 0. Throws InputError and OutputError.
int calibrate(const CalibrateArguments& arguments, const Provenance& provenance);

}  // namespace nscdd
