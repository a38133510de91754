// When a run ends before all its steps are made: [stop] of a scene.
#pragma once

#include <optional>
#include <string>

#include "files/toml_table.hpp"

namespace nscdd {

// Each ends the run after the first step for which it holds.
struct StopSettings {
    std::optional<double> time;                      // of the scene, at least [s]
    std::optional<double> strain;                    // the largest of the box or the cell, at least [1]
    std::optional<double> kinetic_energy_over_work;  // at most [1]
    std::optional<double> largest_unbalanced_force;  // over the mean force of contacts, at most [1]
    bool nothing_left = false;                       // all that can move have been removed
    double after = 0;  // time of the scene from which the two of a sample at rest count [s]

    bool of_rest() const { return kinetic_energy_over_work || largest_unbalanced_force; }
    bool any() const { return time || strain || of_rest() || nothing_left; }
};

// Throws InputError as TomlTable does. The whole table is read.
StopSettings read_stop(TomlTable& table);

// The condition that ended a run.
struct Stopped {
    std::string condition;        // the key of [stop]
    double value = 0, bound = 0;  // measured, and asked for; 0 grains for nothing_left
    std::string unit;

    std::string text() const;  // "time 0.5 s, asked for 0.5 s"
};

}  // namespace nscdd
