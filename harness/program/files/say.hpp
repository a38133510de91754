// What the program says on its standard streams.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

namespace nscdd {

// As fmt::print, which throws where a stream is full or its reader has gone: results are in files, and the exit code
// tells how the command ended.
template <class... T>
void say(std::FILE* to, fmt::format_string<T...> text, T&&... values) {
    const std::string line = fmt::format(text, std::forward<T>(values)...);
    std::fwrite(line.data(), 1, line.size(), to);
}

template <class... T>
void say(fmt::format_string<T...> text, T&&... values) {
    say(stdout, text, std::forward<T>(values)...);
}

}  // namespace nscdd
