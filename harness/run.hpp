// `nscdd run`: one scene, stepped by NLGS, Newton or NSCDD, with its results as JSON and HDF5.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "checkpoint.hpp"
#include "fclib.hpp"
#include "nscdd/comm/communicator.hpp"
#include "nscdd/iterate/options.hpp"
#include "registry/registry.hpp"
#include "replace_file.hpp"
#include "report_json.hpp"
#include "scene.hpp"
#include "state.hpp"

namespace nscdd {

using WorkDone = std::array<double, work_names.size()>;  // by Work

// Asks to time some iterations of the next step, after `skip` others, and to make no step (window.hpp).
struct WindowRequest {
    int skip = 0, iterations = 0, repeat = 1;
    std::function<WorkDone()> done;  // so far by this rank
};

// Asks to measure what the next step's work costs, and to make no step (calibrate.hpp).
struct CalibrationRequest {
    double least_seconds = 0;  // of a measurement
    int cores = 1;             // that may be busy at once
};

// What a run is asked to do. Of packing and state each process has its share.
struct RunRequest {
    Share share;
    Scene scene;              // with what the command line changed
    Packing packing;          // empty if the scene has none
    State from;               // to go on from
    std::string from_file;    // empty to start from the packing
    std::vector<double> box;  // of the packing or the state; empty if there is none
    std::int64_t start_step = 0;
    double start_time = 0;        // [s]
    std::string scheme = "nlgs";  // of offered_schemes()
    std::string interface;        // closed-form, factorised; empty: the scheme's default
    int subdomains = 1, threads = 1;
    bool undivided = false;                // one subdomain by default, though the scheme glues several
    std::string partition = "bisection";   // of offered_partitions()
    std::vector<int> grid;                 // cells per axis; empty: chosen
    double imbalance = 1.1;                // of a partition that is kept (Partitioner)
    std::string multiplicity = "minimal";  // or predicted
    bool over_mpi = false;
    bool progress = true, says_notes = true;
    std::string json, state, checkpoint;  // files to write, may be empty
    CheckpointEvery every;
    std::vector<std::string> series;  // files to write a row a step into
    std::string frames;               // file to write a frame into after steps that are multiples of frame_every
    int frame_every = 1;
    Provenance provenance;
    std::optional<SolveOptions> export_options;  // nlgs alone: solve the last step on to these and keep its problem
    std::optional<WindowRequest> window;
    std::optional<CalibrationRequest> calibration;

    bool goes_on() const { return !from_file.empty(); }
};

// The problem of the last step in local form, whole masses.
struct ExportedProblem {
    LocalProblem problem;
    FclibSolution solution;
    SolveReport report;  // of solving on
};

// What a run of any model does with its result on the process that hosts rank 0.
struct RunResult {
    nlohmann::json json;
    std::int64_t last_step = 0;
    bool stopped = false;  // before its end, by a signal, with a checkpoint; there is no JSON then
    int unconverged_steps = 0;
    std::optional<ExportedProblem> exported;
};

// Collective. Frees the rows of packing and state once they are in the simulation. On the process that hosts rank 0 the
// state, series and frames that are asked for are written into `files`.
using RunFunction = RunResult (*)(RunRequest&, Communicator&, FileSet& files);

// The run of the model that the scene needs and no more.
RunFunction choose_model(const Scene& scene);

// The run of the law of this name; each dimension is compiled by itself, run_model.cpp.in.
template <int dim>
RunFunction choose_law(const std::string& law);

// The subcommand: reads, runs, writes. Returns the exit code.
struct RunArguments {
    std::string scene, packing, from, scheme = "nlgs", interface, partition, grid, json, state, checkpoint, every,
                                      transport = "auto", within_node = "memory", frames, multiplicity = "minimal";
    std::vector<std::string> series;
    int subdomains = 0, threads = 0, steps = 0, check_every = 0, max_iterations = 0, sweeps = 0, repeat = 1,
        frame_every = 0;
    double tolerance = 0, velocity_error = 0, energy_made = 0, penetration = 0, gap_error = 0, distance = 0,
           relaxation = 0, imbalance = 0;
    std::string method;
    std::optional<int> window, newton_contacts;
    bool adopt = false;  // `from` may be of another scene

    std::string chosen_partition() const {
        return !partition.empty() ? partition : grid.empty() ? "bisection" : "grid";
    }
    bool quiet = false;
};

// Reads what the arguments name, of packing and state the share of this MPI rank. Throws InputError for what cannot be
// run, each rank what it finds.
RunRequest prepare_run(const RunArguments& arguments, const Provenance& provenance, Share share, bool over_mpi);

// The files that a run reads.
std::vector<NamedFile> inputs_of(const RunArguments& arguments, const Scene& scene);

class Session;
int run(const RunArguments& arguments, const Provenance& provenance, const Session& session);

}  // namespace nscdd
