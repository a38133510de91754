// What a run writes step by step: time series and frames. Where none are asked for it does nothing.
#pragma once

#include <memory>

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
            if (!request.outputs.frames.empty()) frames_.emplace(files, request.outputs.frames, request.scene.name);
        });
    }

    // After each step.
    void after(const StepReport& report) {
        const std::int64_t step = request_.start_step + simulation_.steps();
        if (rows_) {
            const SeriesRow row =
                rows_->next(simulation_, report, step, time_now(simulation_, request_), request_.so_far);
            write_on_first(simulation_.comm(), [&] {
                for (auto& series : series_) series->add(row);
            });
        }
        if (!request_.outputs.frames.empty() && step % request_.frame_every() == 0)
            write_frame(simulation_, request_, frames_);
    }

    // After the last step.
    void save() {
        if (!records()) return;
        write_on_first(simulation_.comm(), [this] {
            for (auto& series : series_) series->save();
            if (frames_) frames_->save();
        });
    }

  private:
    bool records() const { return !request_.outputs.series.empty() || !request_.outputs.frames.empty(); }

    const Simulation<M>& simulation_;
    const RunRequest& request_;
    std::optional<SeriesRows<M>> rows_;
    std::vector<std::unique_ptr<SeriesWriter>> series_;
    std::optional<FrameWriter> frames_;
};

}  // namespace nscdd
