// What a user can get wrong, or a disk can: one line that names the thing and the place, printed as it is.
#pragma once

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <string>

namespace nscdd {

// The text with control characters, which names, paths and quotations may have, made visible.
inline std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c); }, '?');
    return text;
}

// A scene, packing, state or option that cannot be used as given.
class InputError : public std::runtime_error {
  public:
    explicit InputError(const std::string& text) : std::runtime_error(one_line(text)) {}
};

// A file that could not be written; whatever stood there before still does.
class OutputError : public std::runtime_error {
  public:
    explicit OutputError(const std::string& text) : std::runtime_error(one_line(text)) {}
};

}  // namespace nscdd
