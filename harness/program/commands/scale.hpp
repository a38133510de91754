// `nscdd scale`: how a case would scale on a machine that is not there. Iterations are counted in process; the time of
// an iteration is simulated by SMPI, on windows of one step (window.hpp).
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "commands/run.hpp"

namespace nscdd {

struct ScaleArguments {
    RunArguments run;
    std::vector<int> ranks;
    std::string platform, costs, simulator, output;
    double slower = 1;
    int skip = 20, iterations = 100;
    bool bands = false, measure = false;
};

CLI::App* add_scale(CLI::App& app, ScaleArguments& arguments);

// Goes on from the output of an interrupted call. Returns 0. Throws InputError and OutputError, and std::runtime_error
// where a program that it starts fails.
int scale(const ScaleArguments& arguments, const Provenance& provenance);

}  // namespace nscdd
