// "step 12/50, 34 iterations, 0:08 left" while a run goes on: in one line on a terminal, else a line a minute.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>

#include "files/say.hpp"

namespace nscdd {

class Progress {
  public:
    // Silent when not wanted.
    Progress(bool wanted, int total, std::string_view of = "step")
        : active_(wanted), terminal_(isatty(STDERR_FILENO)), total_(total), of_(of), began_(Clock::now()) {}
    ~Progress() {
        if (active_ && terminal_) std::fputs("\r\033[K", stderr);
    }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void show(int done, const std::string& what) {
        if (!active_) return;
        const double elapsed = std::chrono::duration<double>(Clock::now() - began_).count();
        if (terminal_ ? done < total_ && elapsed - shown_ < 0.2 : elapsed - shown_ < 60) return;
        shown_ = elapsed;
        const int left = static_cast<int>(elapsed * (total_ - done) / std::max(done, 1));
        say(stderr, "{}{} {}/{}, {}, {}:{:02} left{}", terminal_ ? "\r\033[K" : "", of_, done, total_, what, left / 60,
            left % 60, terminal_ ? "" : "\n");
        std::fflush(stderr);
    }

  private:
    using Clock = std::chrono::steady_clock;
    bool active_, terminal_;
    int total_;
    std::string_view of_;
    Clock::time_point began_;
    double shown_ = 0;  // [s] since it began
};

}  // namespace nscdd
