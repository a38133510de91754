#include "files/report_json.hpp"

#include <fmt/chrono.h>
#include <sched.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <Eigen/Core>
#include <algorithm>
#include <cctype>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <thread>

#include "files/load.hpp"
#include "nscdd/core/packet.hpp"

#ifndef NSCDD_COMMIT
#define NSCDD_COMMIT "unknown"
#endif

namespace nscdd {
namespace {

// What follows `separator` on the first line of `path` that starts with `key`, unquoted; "" if there is none.
std::string look_up(const char* path, std::string_view key, char separator) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        const auto at = line.find(separator);
        if (!line.starts_with(key) || at == std::string::npos) continue;
        const auto first = line.find_first_not_of(" \"", at + 1);
        const auto last = line.find_last_not_of(" \"");
        return first == std::string::npos ? "" : line.substr(first, last - first + 1);
    }
    return "";
}

// mpirun may bind each rank to one core but stays free itself, so the launcher is asked too.
int usable_cores() {
    int cores = 0;
    for (const pid_t process : {pid_t{0}, getppid()}) {
        cpu_set_t set;
        if (sched_getaffinity(process, sizeof set, &set) == 0) cores = std::max(cores, CPU_COUNT(&set));
    }
    return cores > 0 ? cores : static_cast<int>(std::thread::hardware_concurrency());
}

Machine this_machine() {
    utsname kernel{};
    uname(&kernel);
    Machine machine{.cpu = look_up("/proc/cpuinfo", "model name", ':'),
                    .cores = usable_cores(),
                    .os = look_up("/etc/os-release", "PRETTY_NAME", '='),
                    .compiler = {},
                    .lanes = Packet::width,
                    .fused = Packet::fuses,
                    .governor = clock_governor(),
                    .libraries = {}};
    if (machine.cpu.empty()) machine.cpu = kernel.machine;
    machine.os += fmt::format("{}{} {}", machine.os.empty() ? "" : ", ", kernel.sysname, kernel.machine);
#if defined(__clang__)
    machine.compiler = fmt::format("clang {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#elif defined(__GNUC__)
    machine.compiler = fmt::format("g++ {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#else
    machine.compiler = "unknown";
#endif
    return machine;
}

std::string quoted(const std::string& argument) {
    const auto plain = [](unsigned char c) {
        return std::isalnum(c) || std::string_view("_@%+=:,./-").find(static_cast<char>(c)) != std::string_view::npos;
    };
    if (!argument.empty() && std::all_of(argument.begin(), argument.end(), plain)) return argument;
    std::string out = "'";
    for (const char c : argument) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

}  // namespace

std::string command_line(int argc, const char* const* argv) {
    std::string line;
    for (int k = 0; k < argc; ++k) {
        if (k > 0) line += ' ';
        line += quoted(k == 0 ? std::filesystem::path(argv[0]).filename().string() : argv[k]);
    }
    return line;
}

Provenance provenance(int argc, const char* const* argv) {
    return {.command = command_line(argc, argv),
            .machine = this_machine(),
            .commit = NSCDD_COMMIT,
            .date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))};
}

void to_json(nlohmann::json& json, const Provenance& provenance) {
    const Machine& m = provenance.machine;
    json = {{"command", provenance.command},
            {"machine",
             {{"cpu", m.cpu},
              {"cores", m.cores},
              {"os", m.os},
              {"compiler", m.compiler},
              {"lanes", m.lanes},
              {"fused", m.fused},
              {"governor", m.governor},
              {"libraries", m.libraries}}},
            {"commit", provenance.commit},
            {"date", provenance.date}};
}

void write_json(FileSet& files, const std::string& path, const nlohmann::json& json) {
    files.add(path, json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

void write_json(const std::string& path, const nlohmann::json& json) {
    FileSet files;
    write_json(files, path, json);
    files.commit();
}

}  // namespace nscdd
