// `nscdd window`: the time of some iterations of one step, on real ranks or on simulated ones (`nscdd_simulated`).
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "commands/run.hpp"

namespace nscdd {

struct WindowArguments {
    RunArguments run;
    int skip = 20, iterations = 100;
    // Of a simulated machine:
    std::string costs;                  // file
    double slower = 1, noise = 0;       // factor on the time of work; standard deviation over the mean of every charge
    double latency = 1, bandwidth = 1;  // factor on the time of MPI's calls for a message, divisor of it for a byte
    unsigned seed = 1;
};

CLI::App* add_window(CLI::App& app, WindowArguments& arguments);

// Collective over all MPI ranks. Returns the exit code.
int window(const WindowArguments& arguments, const Provenance& provenance, const Session& session);

}  // namespace nscdd
