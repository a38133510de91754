#include "model/checkpoint.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <csignal>

#include "files/error.hpp"

namespace nscdd {
namespace {

volatile std::sig_atomic_t asked_to_stop = 0;

}  // namespace

CheckpointEvery read_checkpoint_every(const std::string& text) {
    const bool timed = text.ends_with('s');
    const char *begin = text.data(), *end = begin + text.size() - (timed ? 1 : 0);
    CheckpointEvery every;
    const auto [read, error] =
        timed ? std::from_chars(begin, end, every.seconds) : std::from_chars(begin, end, every.steps);
    const bool positive = timed ? every.seconds > 0 && std::isfinite(every.seconds) : every.steps > 0;
    if (error != std::errc{} || read != end || !positive)
        throw InputError(fmt::format("--every {}: expected steps, such as 50, or seconds, such as 60s", text));
    return every;
}

void listen_for_checkpoint_signal() {
    struct sigaction action {};
    action.sa_handler = [](int) { asked_to_stop = 1; };
    action.sa_flags = SA_RESTART;
    sigaction(SIGUSR1, &action, nullptr);
}

Checkpoints::Due Checkpoints::after(std::int64_t steps) {
    const bool late = every_.seconds > 0 && comm_.ranks()[0] == 0 && comm_.now() - last_ >= every_.seconds;
    const Buffer mine{double(asked_to_stop), double(late)};
    const std::span<const double> any = reduce(comm_, 0, [&mine](std::size_t) { return mine; });
    if (any[0] > 0) return Due::write_and_stop;
    if (any[1] == 0 && (every_.steps == 0 || steps % every_.steps != 0)) return Due::no;
    last_ = comm_.now();
    return Due::write;
}

}  // namespace nscdd
