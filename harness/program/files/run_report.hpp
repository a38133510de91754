// A run as `nscdd run` has written it, read by those who judge it: nothing in its files is taken on trust.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "files/state.hpp"

namespace nscdd {

// What `nscdd compare` needs of a run's JSON (reports/run.schema.json).
struct RunReport {
    std::string file;  // it was read from
    std::string scene, scheme, transport, state, state_checksum;
    std::string problem;  // its checksum; empty in files of earlier programs
    std::int64_t dimension = 0, steps = 0, start_step = 0, subdomains = 0, unconverged_steps = 0;
    std::int64_t grains = 0, grains_left = 0;  // at the start of the scene, at the end of the run
    double h = 0, tolerance = 0, kinetic_energy = 0, free_velocity_norm = 0;
    double max_velocity_error = 0;                                           // its bound, of a step
    std::vector<double> residual, velocity_error, energy_gain, penetration;  // per step; NaN where they were not finite
    std::vector<double> contacts;                                            // per step
    std::vector<double> densities, wall_masses;
    std::vector<std::vector<double>> stress;  // or the virial: dimension x dimension
    bool boxed = false;                       // stress
    bool friction = false;

    std::int64_t last_step() const { return start_step + steps; }
};

// Throws InputError, "file: key: problem", for what is no such JSON: a key that is missing, of another type or length,
// or out of its range.
RunReport read_run_report(const std::string& file, const std::string& text);

// Throws InputError, naming both files, where the state is not one that this run can have written.
void require_state_of(const RunReport& run, const State& state, const std::string& state_file);

}  // namespace nscdd
