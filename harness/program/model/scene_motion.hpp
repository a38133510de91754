// Motions of walls and obstacles as the user writes them: functions of time.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "files/toml_table.hpp"

namespace nscdd {

// The way since time 0.
struct ScenePath {
    enum class Kind { None, Steady, Oscillating, Table } kind = Kind::None;
    Eigen::VectorXd velocity;             // (dim) [m/s] for Steady
    Eigen::VectorXd amplitude;            // (dim) [m] for Oscillating
    double frequency = 0, phase = 0;      // [1/s], [rad]
    std::string file;                     // for Table: it was read from
    std::vector<double> times;            // for Table [s], ascending, one at least
    std::vector<Eigen::VectorXd> places;  // of each time, (dim) [m]
};

// The keys of "oscillating": amplitude, frequency, and those that may be left out, phase and direction (`along`, unless
// that is empty: then it must be given).
ScenePath read_oscillation(TomlTable& table, int dim, const Eigen::VectorXd& along);

// The key `file` of "table": a text file, in the folder of the scene unless its path is absolute. A line has a time and
// `dim` coordinates, by blanks or commas; what follows a # is not read. Throws InputError, "file:line: problem".
ScenePath read_path_table(TomlTable& table, int dim, const std::string& scene_file);

}  // namespace nscdd
