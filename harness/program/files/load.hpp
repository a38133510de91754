// Whether processes had their cores while a time was measured: a time on a busy machine says nothing about a solver.
#pragma once

#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace nscdd {

// CPU time of this process, all its threads [s]. std::clock() counts microseconds, in which small scenes are solved.
double cpu_seconds();

// A process that had less of a core than this on average was kept waiting, and its times are not believed.
inline constexpr double cores_to_believe = 0.95;

// How often a measurement is made at most until it is believed.
inline constexpr int most_tries = 3;

inline constexpr std::size_t load_columns = 4;

// Measures this process, from its construction on.
class LoadMeter {
  public:
    LoadMeter();
    // CPU over wall time, involuntary context switches, processes that run on the machine now, cores this may run on.
    std::vector<double> row() const;

  private:
    std::chrono::steady_clock::time_point began_;
    double cpu_;
    long switches_;
};

// The key `load` of a result, from the rows of its processes. Processes of several threads wait for each other without
// their cores, so that `believed` is null there.
nlohmann::json load_json(std::span<const double> rows, int threads);

// "performance" and the like, what sets the clock of this machine's first core; "unknown" where the system hides it.
std::string clock_governor();

}  // namespace nscdd
