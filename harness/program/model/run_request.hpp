// What a run is asked to do, and the run of each model.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "files/replace_file.hpp"
#include "files/report_json.hpp"
#include "files/state.hpp"
#include "model/checkpoint.hpp"
#include "model/run_result.hpp"
#include "model/scene.hpp"
#include "registry/choices.hpp"
#include "registry/registry.hpp"

namespace nscdd {

using WorkDone = std::array<double, detail::work_names.size()>;  // by Work

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

// What a run is asked to do, as the command line says it. What is not given follows from the scene or the rest.
struct RunArguments {
    struct Start {
        std::string scene;                         // file
        std::optional<std::string> packing, from;  // files
        bool adopt = false;                        // `from` may be of another scene
    } start;
    std::optional<std::string> scheme;   // of offered_schemes(); else nlgs, and dcs of several subdomains
    std::optional<Interface> interface;  // else the scheme's own
    Multiplicity multiplicity = Multiplicity::minimal;
    PartitionChoice partition;
    SolveSettings solver;
    std::optional<int> steps, subdomains, threads;
    bool thread_a_core = false;  // as many threads as cores, where subdomains suffice
    int repeat = 1;
    Transport transport = Transport::automatic;
    NodeTransport within_node = NodeTransport::memory;
    struct Outputs {
        std::optional<std::string> json, state, checkpoint;  // files to write
        std::vector<std::string> series, frames;             // files to write a row a step into, and frames
        std::optional<int> frame_every;                      // steps between frames
        std::optional<CheckpointEvery> every;                // between checkpoints
        std::optional<std::string> log;                      // file to append lines to
        std::optional<int> log_every;                        // steps between lines
    } outputs;
    bool quiet = false;
    bool caller_counts = false;  // steps are made one by one: neither steps nor the scene's count need be given
};

// Of nlgs alone: solve the last step on to these options and keep its problem, in local or global form.
struct ExportRequest {
    SolveOptions options;
    bool global = false;
};

// The same, decided, with what it starts from. Of packing and state each process has its share.
struct RunRequest : RunArguments {
    Share share;
    Scene scene;                 // with what the command line changed
    Packing packing;             // empty if the scene has none
    State from;                  // to go on from
    std::vector<double> masses;  // of the grains that packing or state has here [kg]; empty: by their densities
    std::vector<double> box;     // of the packing or the state; empty if there is none
    State::SoFar so_far;         // of the scene; the run keeps it up to date
    bool has_fixed = false;      // some grains may be fixed
    std::int64_t start_step = 0;
    double start_time = 0;  // [s]
    bool over_mpi = false;
    bool undivided = false;  // one subdomain by default, though the scheme glues several
    bool says_notes = true;
    Provenance provenance;
    std::optional<ExportRequest> export_request;
    std::optional<WindowRequest> window;
    std::optional<CalibrationRequest> calibration;

    bool goes_on() const { return start.from.has_value(); }
    int frame_every() const { return outputs.frame_every.value_or(1); }
};

// Collective. Frees the rows of packing and state once they are in the simulation. On the process that hosts rank 0 the
// state, series and frames that are asked for are written into `files`.
using RunFunction = RunResult (*)(RunRequest&, Communicator&, FileSet& files);

// The run of the model that the scene needs and no more.
RunFunction choose_model(const Scene& scene);

// The run of the law that has this line in registry/laws.hpp; each is compiled by itself, run_model.cpp.in.
template <int dim, int law>
RunResult run_law(RunRequest& request, Communicator& comm, FileSet& files);

}  // namespace nscdd
