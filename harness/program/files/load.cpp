#include "files/load.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <fstream>

#include "files/over_ranks.hpp"
#include "nscdd/comm/allowed_cores.hpp"

namespace nscdd {

namespace {

long involuntary_switches() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_nivcsw;
}

// /proc/loadavg: three averages, then RUNNING/ALL; 0 where there is none.
double running_processes() {
    std::ifstream file("/proc/loadavg");
    double average = 0, running = 0;
    return file >> average >> average >> average >> running ? running : 0;
}

}  // namespace

double cpu_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

LoadMeter::LoadMeter()
    : began_(std::chrono::steady_clock::now()), cpu_(cpu_seconds()), switches_(involuntary_switches()) {}

std::vector<double> LoadMeter::row() const {
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - began_;
    const double cores = wall.count() > 0 ? (cpu_seconds() - cpu_) / wall.count() : 0;
    return {cores, static_cast<double>(involuntary_switches() - switches_), running_processes(),
            static_cast<double>(detail::allowed_cores())};
}

nlohmann::json load_json(std::span<const double> rows, int threads) {
    nlohmann::json json;
    for (const auto& [name, column] : {std::pair("cores", 0), {"switches", 1}, {"running", 2}, {"cores_allowed", 3}})
        json[name] = over_ranks(rows, load_columns, static_cast<std::size_t>(column));
    json["believed"] = nullptr;
    if (threads == 1) json["believed"] = json["cores"]["least"].get<double>() >= cores_to_believe;
    return json;
}

std::string clock_governor() {
    std::ifstream file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
    std::string name;
    return file >> name ? name : "unknown";
}

}  // namespace nscdd
