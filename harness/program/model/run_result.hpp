// What a run has come to, on the process that hosts rank 0. run_json.hpp writes it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "files/fclib.hpp"
#include "files/state.hpp"
#include "model/stop.hpp"
#include "nscdd/comm/communicator.hpp"
#include "nscdd/iterate/options.hpp"
#include "nscdd/step/report.hpp"

namespace nscdd {

// Numbers of all ranks or processes: rows of `columns` numbers, in one buffer.
struct Rows {
    std::vector<double> values;
    std::size_t columns = 1;
    std::size_t count() const { return values.size() / columns; }
    double sum(std::size_t column) const {
        double total = 0;
        for (std::size_t at = column; at < values.size(); at += columns) total += values[at];
        return total;
    }
};

// What a process has sent and spent inside the communicator, as a row has it: messages and bytes; then messages,
// seconds of waiting and of transferring, of each operation.
inline constexpr std::size_t communicated_columns = 2 + 3 * detail::operation_names.size();

// A row of what a rank has done and spent: these, then communicated while contacts were solved, then own time, wait and
// transfer of each phase.
namespace cost_column {
enum : std::size_t { work, neighbours, speaks, total, solver_cpu, messages, bytes };  // speaks: first of its process
}
inline constexpr std::array phase_names{"detect", "load", "sweep", "test", "interface", "advance"};
inline constexpr std::size_t first_phase_column = cost_column::messages + communicated_columns;

// A row of a window: these, the last two the first of communicated, whose others follow, then the work done by Work.
inline constexpr std::array window_names{"seconds", "sweep", "interface", "wait", "transfer", "messages", "bytes"};
inline constexpr std::size_t first_communicated = window_names.size() - 2,
                             first_work = first_communicated + communicated_columns;

struct WindowResult {
    double contacts = 0;
    std::vector<double> repeats;  // of the slowest rank an iteration, ascending [s]
    Rows rows;                    // of the median, an iteration
    std::vector<double> load;     // rows of load_json()
    double median() const { return repeats[(repeats.size() - 1) / 2]; }
};

struct MeasuredCost {
    Work kind;
    double bytes, ns;
};

struct CalibrationResult {
    double contacts = 0;
    std::vector<MeasuredCost> costs;
};

// The problem of the last step in the form asked for, whole masses.
struct ExportedProblem {
    FclibProblem problem;
    FclibSolution solution;
    SolveReport report;  // of solving on
};

// Of the last state.
struct FinalMeasures {
    double kinetic_energy = 0, free_velocity_norm = 0, velocity_change_norm = 0, coordination = 0;
    double overlap = 0;  // largest, over the least radius
    std::vector<double> momentum, angular_momentum;
    std::vector<std::vector<double>> stress;  // or the virial, where there is no box
    double volume = 0, grains_volume = 0;     // of the box, 0 where there is none
};

struct RunResult {
    std::string model, interface, partition;
    std::string problem, answer;     // checksums
    std::vector<std::string> notes;  // said at the start
    int dimension = 0, ranks = 0;
    bool friction = false;
    std::int64_t grains = 0;
    double least_radius = 0;
    SolveOptions options;
    std::vector<StepReport> steps;
    FinalMeasures final;
    Rows costs;                                        // of each rank
    std::vector<double> load;                          // rows of load_json()
    double memory = 0, most_memory = 0;                // peak, of all processes and of one [bytes]
    std::map<std::string, std::int64_t> multiplicity;  // grains by it, in the last step
    std::vector<double> densities, wall_masses;
    std::int64_t last_step = 0;
    int repeats = 1;
    bool stopped = false;  // before its end, by a signal, with a checkpoint; there are no results then
    State::SoFar so_far;   // of the scene at the end
    std::int64_t grains_left = 0;
    std::optional<Stopped> stopped_by;  // the condition of [stop] that ended it
    std::optional<ExportedProblem> exported;
    std::optional<WindowResult> window;
    std::optional<CalibrationResult> calibration;

    // The figure that the bound is on, as the bound is meant: penetrations over the least radius.
    double figure(const detail::BoundOption& bound, const SolveReport& step) const {
        return step.*bound.figure / (bound.limit == &SolveOptions::Bounds::max_penetration ? least_radius : 1);
    }
    int unconverged_steps() const;
    double iterations() const;        // of all steps
    Rows costs_of_processes() const;  // each speaks through its first rank
    double solver_cpu() const;        // mean over processes [s]
    double seconds() const;           // of the slowest process
};

}  // namespace nscdd
