// The log of a run: a line every so many steps, on standard error and in a file.
#pragma once

#include <chrono>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>

namespace nscdd {

struct LogLine {
    std::int64_t step = 0;
    double time = 0;            // [s]
    int iterations = 0;         // of the step
    double eta = 0;             // of the step
    double contacts = 0;        // detected in the step
    double kinetic_energy = 0;  // of the grains [J]
    double stress = 0;          // mean normal stress from contacts, NaN where the scene has no box [Pa]
    int done = 0, total = 0;    // steps of this run
};

class RunLog {
  public:
    // Appends to the file, behind what earlier runs have left; if there is one. Throws OutputError.
    RunLog(const std::optional<std::string>& path, bool console);
    void add(const LogLine& line);

  private:
    void write(const std::string& text);

    using Clock = std::chrono::steady_clock;
    std::optional<std::string> path_;
    bool console_, begun_ = false;
    std::ofstream file_;
    Clock::time_point began_ = Clock::now();
};

}  // namespace nscdd
