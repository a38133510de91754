#include "files/run_log.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "files/error.hpp"
#include "files/say.hpp"

namespace nscdd {

RunLog::RunLog(const std::optional<std::string>& path, bool console) : path_(path), console_(console) {
    if (!path_) return;
    file_.open(*path_, std::ios::app);
    if (!file_) throw OutputError(fmt::format("{}: cannot write: {}", *path_, std::strerror(errno)));
}

void RunLog::add(const LogLine& line) {
    if (!begun_)
        write(fmt::format("{:>10} {:>12} {:>10} {:>9} {:>9} {:>14} {:>11} {:>8}\n", "step", "time", "iterations", "eta",
                          "contacts", "kinetic energy", "stress", "left"));
    begun_ = true;
    const double elapsed = std::chrono::duration<double>(Clock::now() - began_).count();
    const auto left = static_cast<std::int64_t>(elapsed * (line.total - line.done) / std::max(line.done, 1));
    const std::string stress = std::isnan(line.stress) ? "-" : fmt::format("{:.4g}", line.stress);
    write(fmt::format("{:>10} {:>12.6g} {:>10} {:>9.2g} {:>9.0f} {:>14.6g} {:>11} {:>5}:{:02}\n", line.step, line.time,
                      line.iterations, line.eta, line.contacts, line.kinetic_energy, stress, left / 60, left % 60));
}

void RunLog::write(const std::string& text) {
    if (console_) say(stderr, "{}{}", isatty(STDERR_FILENO) ? "\r\033[K" : "", text);
    if (!path_) return;
    file_ << text << std::flush;
    if (!file_) throw OutputError(fmt::format("{}: cannot write: {}", *path_, std::strerror(errno)));
}

}  // namespace nscdd
