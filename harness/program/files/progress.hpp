// "step 12/50, 34 iterations, 0:08 left" on the terminal while a run goes on.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>

#include "files/say.hpp"

namespace nscdd {

class Progress {
  public:
    // Silent when not wanted or when standard error is no terminal.
    Progress(bool wanted, int total, std::string_view of = "step")
        : active_(wanted && isatty(STDERR_FILENO)), total_(total), of_(of), began_(Clock::now()) {}
    ~Progress() {
        if (active_) std::fputs("\r\033[K", stderr);
    }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void show(int done, const std::string& what) {
        if (!active_) return;
        const double elapsed = std::chrono::duration<double>(Clock::now() - began_).count();
        if (done < total_ && elapsed - shown_ < 0.2) return;
        shown_ = elapsed;
        const int left = static_cast<int>(elapsed * (total_ - done) / std::max(done, 1));
        say(stderr, "\r\033[K{} {}/{}, {}, {}:{:02} left", of_, done, total_, what, left / 60, left % 60);
        std::fflush(stderr);
    }

  private:
    using Clock = std::chrono::steady_clock;
    bool active_;
    int total_;
    std::string_view of_;
    Clock::time_point began_;
    double shown_ = -1;
};

}  // namespace nscdd
