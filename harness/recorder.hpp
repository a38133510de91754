// What a run writes step by step: time series and frames. Where none are asked for it does nothing.
#pragma once

#include <memory>

#include "simulation_frames.hpp"
#include "simulation_series.hpp"

namespace nscdd {

template <class M>
class Recorder {
  public:
    // On the process that hosts rank 0 the files are of the set `files`, which the caller commits. Throws OutputError.
    Recorder(const Simulation<M>& simulation, const RunRequest& request, FileSet& files)
        : simulation_(simulation), request_(request), writes_(simulation.comm().ranks()[0] == 0) {
        if (!request.series.empty()) rows_.emplace(simulation, request.scene);
        if (!writes_) return;
        for (const auto& path : request.series)
            series_.push_back(std::make_unique<SeriesWriter>(files, path, rows_->head(simulation, request.scene.name)));
        if (!request.frames.empty()) frames_.emplace(files, request.frames, request.scene.name);
    }

    // Collective, after each step. Throws as write_state does.
    void after(const StepReport& report) {
        const std::int64_t step = request_.start_step + simulation_.steps();
        if (rows_) {
            const SeriesRow row = rows_->next(simulation_, report, step, time_now(simulation_, request_));
            Writing writing(simulation_.comm());
            writing.write([&] {
                for (auto& series : series_) series->add(row);
            });
            writing.end();
        }
        if (!request_.frames.empty() && step % request_.frame_every == 0) write_frame(simulation_, request_, frames_);
    }

    // After the last step, not collective. Throws OutputError.
    void save() {
        for (auto& series : series_) series->save();
        if (frames_) frames_->save();
    }

  private:
    const Simulation<M>& simulation_;
    const RunRequest& request_;
    bool writes_;
    std::optional<SeriesRows<M>> rows_;
    std::vector<std::unique_ptr<SeriesWriter>> series_;
    std::optional<FrameWriter> frames_;
};

}  // namespace nscdd
