// What a run writes step by step: time series, frames and log. Where none are asked for it does nothing.
#pragma once

#include <memory>

#include "files/run_log.hpp"
#include "model/simulation_frames.hpp"
#include "model/simulation_series.hpp"

namespace nscdd {

template <class M>
class Recorder {
  public:
    // The process that hosts rank 0 writes the files, of the set `files`, which the caller commits. Collective, as all
    // members are; each throws as write_state does.
    Recorder(const Simulation<M>& simulation, const RunRequest& request, FileSet& files)
        : simulation_(simulation), request_(request) {
        if (!request.outputs.series.empty()) rows_.emplace(simulation, request.scene, request.so_far);
        if (!records()) return;
        write_on_first(simulation.comm(), [&] {
            for (const auto& path : request.outputs.series)
                series_.push_back(
                    std::make_unique<SeriesWriter>(files, path, rows_->head(simulation, request.scene.name)));
            for (const auto& path : request.outputs.frames)
                frames_.push_back(make_frame_writer(files, path, request.scene.name));
            if (log_every() > 0) log_.emplace(request.outputs.log, !request.quiet);
        });
    }

    // After each step. The last one of a run has a line in the log, and a frame where [stop] has ended the run.
    void after(const StepReport& report, bool stopped) {
        const std::int64_t step = request_.start_step + simulation_.steps();
        if (rows_) {
            const SeriesRow row =
                rows_->next(simulation_, report, step, time_now(simulation_, request_), request_.so_far);
            write_on_first(simulation_.comm(), [&] {
                for (auto& series : series_) series->add(row);
            });
        }
        if (!request_.outputs.frames.empty() && (stopped || step % request_.frame_every() == 0))
            write_frame(simulation_, request_, frames_);
        const int done = simulation_.steps(), total = request_.scene.step.count;
        if (const int every = log_every(); every > 0 && (stopped || step % every == 0 || done == total))
            log(report, step, done, stopped ? done : total);
    }

    // After the last step.
    void save() {
        if (!records()) return;
        write_on_first(simulation_.comm(), [this] {
            for (auto& series : series_) series->save();
            for (auto& frames : frames_) frames->save();
        });
    }

  private:
    bool records() const {
        return !request_.outputs.series.empty() || !request_.outputs.frames.empty() || log_every() > 0;
    }
    // Steps between lines of the log, 0: no log.
    int log_every() const {
        if (request_.outputs.log_every) return *request_.outputs.log_every;
        return request_.outputs.log ? (request_.scene.step.count + 99) / 100 : 0;
    }
    void log(const StepReport& report, std::int64_t step, int done, int total) {
        const Measures<M> m = measure(simulation_);
        const double volume = box_edges<M>(simulation_.settings()).prod();
        write_on_first(simulation_.comm(), [&] {
            log_->add({step, time_now(simulation_, request_), report.solve.iterations, report.solve.residual,
                       report.contacts, m.kinetic_energy, volume > 0 ? m.virial.trace() / M::dim / volume : NAN, done,
                       total});
        });
    }

    const Simulation<M>& simulation_;
    const RunRequest& request_;
    std::optional<SeriesRows<M>> rows_;
    std::vector<std::unique_ptr<SeriesWriter>> series_;
    std::vector<std::unique_ptr<FrameWriter>> frames_;
    std::optional<RunLog> log_;
};

}  // namespace nscdd
