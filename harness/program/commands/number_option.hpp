// Checks of numbers on the command line. CLI11's own checks let NaN pass.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "files/error.hpp"
#include "files/ranges.hpp"
#include "registry/choices.hpp"

namespace nscdd {

// Checks that a number is finite and in the range.
inline CLI::Validator number_in(const detail::OptionRange& range) {
    return CLI::Validator(
        [=](std::string& text) -> std::string {
            double value = NAN;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            const bool number = error == std::errc{} && end == text.data() + text.size();
            if (number && std::isfinite(value) && range.holds(value)) return {};
            return fmt::format("must be a {}number {}, found {}", std::isinf(range.high) ? "finite " : "", told(range),
                               text);
        },
        "NUMBER");
}

// Checks that a number is whole and within [low, high].
inline CLI::Validator whole_number(int low = 1, int high = std::numeric_limits<int>::max()) {
    return CLI::Validator(
        [=](std::string& text) -> std::string {
            int value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            const bool whole = end == text.data() + text.size() && !text.empty();
            // CLI11 would read 010 as 8
            if (whole && error == std::errc{} && text != std::to_string(value))
                return fmt::format("must be written as {}, found {}", value, text);
            if (whole && error == std::errc{} && value >= low && value <= high) return {};
            const bool bounded = high < std::numeric_limits<int>::max() || error == std::errc::result_out_of_range;
            return fmt::format("must be a whole number, at least {}{}, found {}", low,
                               bounded ? fmt::format(" and at most {}", high) : "", text);
        },
        "NUMBER");
}

inline CLI::Validator positive_number() { return number_in(positive); }

// Checks that a file is named: an empty variable of the shell is no choice.
inline CLI::Validator file_name() {
    return CLI::Validator([](std::string& text) { return text.empty() ? "is empty, give a file" : ""; }, "FILE");
}

// --NAME of an option of a table (OptionInfo), with its help and its check. `otherwise`: what holds if it is not given,
// empty if that is not told.
template <class Value>
CLI::Option* add_table_option(CLI::App& command, const detail::OptionInfo& info, const std::string& otherwise,
                              std::function<void(const Value&)> take) {
    const std::string unit = *info.unit ? fmt::format(" [{}]", info.unit) : "";
    CLI::Option* option = command.add_option_function<Value>(
        dashed(info.name), std::move(take),
        otherwise.empty() ? info.meaning : fmt::format("{}{} (default: {})", info.meaning, unit, otherwise));
    const detail::OptionRange range = in_files(info.range, Value{});
    if constexpr (std::is_same_v<Value, int>)
        return option->check(whole_number(static_cast<int>(range.low), static_cast<int>(range.high)));
    else
        return option->check(number_in(range));
}

// --NAME, whose text `take` reads; it may throw InputError.
inline CLI::Option* add_text(CLI::App& command, const std::string& option, const std::string& help, auto take) {
    return command.add_option_function<std::string>(
        option,
        [take](const std::string& text) {
            try {
                take(text);
            } catch (const InputError& error) {
                throw CLI::ValidationError(error.what());
            }
        },
        help);
}

// --NAME, one of the names of choices.hpp. `take` gets its value.
template <class Names>
CLI::Option* add_choice(CLI::App& command, const std::string& option, const Names& names, const std::string& help,
                        auto take) {
    return command
        .add_option_function<std::string>(
            option, [&names, take](const std::string& name) { take(value_of(names, name)); }, help)
        ->check(CLI::IsMember(names_in(names)));
}

}  // namespace nscdd
