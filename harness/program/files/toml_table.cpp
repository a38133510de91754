#include "files/toml_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "files/closest.hpp"
#include "files/replace_file.hpp"

namespace nscdd {
namespace {

std::string describe(const toml::node& node) {
    if (const auto* v = node.as_string()) return fmt::format("'{}'", v->get());
    if (const auto* v = node.as_floating_point()) return fmt::format("{}", v->get());
    if (const auto* v = node.as_integer()) return fmt::format("{}", v->get());
    if (const auto* v = node.as_boolean()) return v->get() ? "true" : "false";
    if (node.is_array()) return "an array";
    if (node.is_table()) return "a table";
    return "a date or time";
}

constexpr int most_dots = 8;  // in a key; scenes have keys with one at most

// The end of the string that begins at `at`, of any of TOML's four kinds.
std::size_t skip_string(std::string_view text, std::size_t at) {
    const char quote = text[at];
    const bool long_one = text.substr(at, 3) == std::string(3, quote);
    const std::string end(long_one ? 3 : 1, quote);
    for (at += end.size(); at < text.size(); ++at) {
        if (quote == '"' && text[at] == '\\')
            ++at;
        else if (!long_one && text[at] == '\n')
            return at;
        else if (text.substr(at, end.size()) == end)
            break;
    }
    at = std::min(at + end.size(), text.size());
    for (int more = 0; long_one && more < 2 && at < text.size() && text[at] == quote; ++more)
        ++at;  // """it says "yes""""
    return at;
}

// Line of the first key with more than most_dots dots, 0 if there is none. The parser makes a table of each part and
// destroys the tables one in another: 200,000 parts overflow the stack. (It bounds the nesting of values itself.)
int line_of_long_key(std::string_view text) {
    int line = 1, dots = 0;
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        if (c == '"' || c == '\'') {
            const std::size_t end = skip_string(text, at);
            line += static_cast<int>(std::ranges::count(text.substr(at, end - at), '\n'));
            at = end;
            continue;
        }
        if (c == '#') {
            at = std::min(text.find('\n', at), text.size());
            continue;
        }
        if (c == '.' && ++dots > most_dots) return line;
        if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) dots = 0;
        line += c == '\n';
        ++at;
    }
    return 0;
}

// Whether a text has control characters, which a terminal obeys: C0, DEL, and C1 as UTF-8 has them.
bool has_control_characters(std::string_view text) {
    for (std::size_t k = 0; k < text.size(); ++k) {
        const auto c = static_cast<unsigned char>(text[k]);
        if (std::iscntrl(c)) return true;
        if (c == 0xc2 && k + 1 < text.size() && static_cast<unsigned char>(text[k + 1]) < 0xa0) return true;
    }
    return false;
}

}  // namespace

toml::table parse_toml(const std::string& path) {
    const std::string content = read_file(path);
    if (content.starts_with("\x89HDF")) throw InputError(path + ": is an HDF5 file, and no text (TOML)");
    if (const int line = line_of_long_key(content))
        throw InputError(fmt::format("{}:{}: a key has more than {} dots", path, line, most_dots));
    try {
        return toml::parse(content, path);
    } catch (const toml::parse_error& error) {
        throw InputError(fmt::format("{}:{}: {}", path, error.source().begin.line, error.description()));
    }
}

void TomlTable::fail_at(const toml::source_region& where, std::string_view key, const std::string& problem) const {
    // a table that was made in memory has no lines
    std::string line = where.begin.line > 0 ? fmt::format("{}:{}: ", file_, where.begin.line) : file_ + ": ";
    if (!thing_.empty()) line += thing_ + ": ";
    line += key.empty() ? problem : fmt::format("{} {}", key, problem);
    throw InputError(line);
}

void TomlTable::fail(std::string_view key, const std::string& problem) const {
    const toml::node* node = table_.get(key);
    fail_at(node ? node->source() : table_.source(), key, problem);
}

const toml::node* TomlTable::find(std::string_view key) {
    if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) asked_.emplace_back(key);
    return table_.get(key);
}

const toml::node& TomlTable::require(std::string_view key) {
    const toml::node* node = find(key);
    if (!node) {
        for (const auto& [other, value] :
             table_)  // a slip of two letters at most is named rather than what it left out
            if (key.size() > 3 && std::ranges::find(asked_, other.str()) == asked_.end() &&
                edit_distance(other.str(), key) <= 2)
                fail_at(other.source(), "", fmt::format("unknown key '{}' (did you mean '{}'?)", other.str(), key));
        fail_at(table_.source(), key, "is missing");
    }
    return *node;
}

std::string_view TomlTable::key_of(const char* name, const char* earlier) {
    const bool known = has(name);
    if (!earlier || !table_.get(earlier)) return name;
    if (known) fail(earlier, fmt::format("is the earlier name of {}, which is given too", name));
    return earlier;
}

double TomlTable::number(const toml::node& node, std::string_view what, const detail::OptionRange& range) const {
    if (!node.is_number()) fail_at(node.source(), what, fmt::format("must be a number, found {}", describe(node)));
    const auto number = node.value<double>();  // none of an integer beyond 2^53
    if (!number)
        fail_at(node.source(), what, fmt::format("must be a number that a double holds, found {}", describe(node)));
    const double value = *number;
    if (!std::isfinite(value)) fail_at(node.source(), what, fmt::format("must be finite, found {}", value));
    if (!range.holds(value)) fail_at(node.source(), what, fmt::format("must be {}, found {}", told(range), value));
    return value;
}

double TomlTable::number(std::string_view key, const detail::OptionRange& range, std::optional<double> fallback) {
    if (fallback && !has(key)) return *fallback;
    return number(require(key), key, range);
}

int TomlTable::integer(std::string_view key, const detail::OptionRange& range, std::optional<int> fallback) {
    if (fallback && !has(key)) return *fallback;
    const toml::node& node = require(key);
    const auto* value = node.as_integer();
    if (!value) fail(key, fmt::format("must be an integer, found {}", describe(node)));
    const double highest = std::min<double>(range.high, std::numeric_limits<int>::max());
    if (static_cast<double>(value->get()) < range.low)
        fail(key, fmt::format("must be >= {}, found {}", range.low, value->get()));
    if (static_cast<double>(value->get()) > highest)
        fail(key, fmt::format("must be <= {:.0f}, found {}", highest, value->get()));
    return static_cast<int>(value->get());
}

bool TomlTable::is_text(std::string_view key) {
    const toml::node* node = find(key);
    return node && node->is_string();
}

bool TomlTable::flag(std::string_view key) {
    const toml::node* node = find(key);
    if (!node) return false;
    if (!node->is_boolean()) fail(key, fmt::format("must be true or false, found {}", describe(*node)));
    return node->as_boolean()->get();
}

std::string TomlTable::text(std::string_view key) {
    const toml::node& node = require(key);
    if (!node.is_string()) fail(key, fmt::format("must be a string, found {}", describe(node)));
    if (node.as_string()->get().empty()) fail(key, "must not be empty");
    if (has_control_characters(node.as_string()->get())) fail(key, "must have no control characters");
    return node.as_string()->get();
}

int TomlTable::choice(std::string_view key, const std::vector<std::string>& names) {
    const std::string value = text(key);
    const auto found = std::find(names.begin(), names.end(), value);
    if (found == names.end()) fail(key, fmt::format("must be one of {}, found '{}'", fmt::join(names, ", "), value));
    return static_cast<int>(found - names.begin());
}

Eigen::VectorXd TomlTable::vector(std::string_view key, int size) {
    const toml::node& node = require(key);
    Eigen::VectorXd values(size);
    if (size == 1 && node.is_number()) {
        values[0] = number(node, key, any_number);
        return values;
    }
    const toml::array* array = node.as_array();
    const std::string wanted = size == 1 ? "must be 1 number" : fmt::format("must be {} numbers", size);
    if (!array) fail(key, fmt::format("{}, found {}", wanted, describe(node)));
    if (array->size() != static_cast<std::size_t>(size)) fail(key, fmt::format("{}, found {}", wanted, array->size()));
    for (int k = 0; k < size; ++k)
        values[k] = number((*array)[static_cast<std::size_t>(k)], fmt::format("{}[{}]", key, k), any_number);
    return values;
}

Eigen::VectorXd TomlTable::vector(std::string_view key, int size, const Eigen::VectorXd& fallback) {
    if (!has(key)) return fallback;
    return vector(key, size);
}

std::vector<int> TomlTable::axes(std::string_view key, int dimension) {
    std::vector<int> axes;
    for (const std::string& name : texts(key, 1, dimension)) {
        const int axis = name.size() == 1 ? name[0] - 'x' : -1;
        if (axis < 0 || axis >= dimension)
            fail(key, fmt::format("must name axes from x to {}, found '{}'", "xyz"[dimension - 1], name));
        if (std::ranges::count(axes, axis) > 0) fail(key, fmt::format("names axis {} twice", name));
        axes.push_back(axis);
    }
    return axes;
}

int TomlTable::length(std::string_view key) {
    const toml::array* array = require(key).as_array();
    if (!array || array->empty()) fail(key, "must be a list");
    return static_cast<int>(array->size());
}

std::vector<Eigen::VectorXd> TomlTable::rows(std::string_view key, int count, int size) {
    const toml::array* array = require(key).as_array();
    const auto row = [size](const toml::node& node) {
        return node.is_array() && node.as_array()->size() == static_cast<std::size_t>(size);
    };
    if (!array || array->size() != static_cast<std::size_t>(count) || !std::all_of(array->begin(), array->end(), row))
        fail(key, fmt::format("must be {} lists of {} numbers", count, size));
    std::vector<Eigen::VectorXd> rows;
    for (const toml::node& node : *array) {
        Eigen::VectorXd& values = rows.emplace_back(size);
        for (int d = 0; d < size; ++d)
            values[d] = number((*node.as_array())[static_cast<std::size_t>(d)], key, any_number);
    }
    return rows;
}

std::vector<Eigen::VectorXd> TomlTable::points(std::string_view key, int size, int least) {
    const toml::array* array = require(key).as_array();
    const int count = array ? static_cast<int>(array->size()) : 0;
    if (count < least) fail(key, fmt::format("must be at least {} lists of {} numbers", least, size));
    return rows(key, count, size);
}

std::vector<std::vector<int>> TomlTable::index_lists(std::string_view key, int least, int count) {
    const toml::array* array = require(key).as_array();
    if (!array || array->empty()) fail(key, "must be a list of lists of integers");
    std::vector<std::vector<int>> lists;
    for (const toml::node& node : *array) {
        std::vector<int>& list = lists.emplace_back();
        const toml::array* entries = node.as_array();
        if (entries)
            for (const toml::node& entry : *entries) {
                const std::int64_t index = entry.is_integer() ? entry.as_integer()->get() : -1;
                if (index < 0 || index >= count || std::ranges::count(list, static_cast<int>(index)) > 0) {
                    list.clear();
                    break;
                }
                list.push_back(static_cast<int>(index));
            }
        if (static_cast<int>(list.size()) < least)
            fail_at(node.source(), key,
                    fmt::format("must be lists of at least {} different integers from 0 to {}", least, count - 1));
    }
    return lists;
}

bool TomlTable::flag(std::string_view key, bool fallback) {
    const toml::node* node = find(key);
    if (!node) return fallback;
    if (!node->is_boolean()) fail(key, fmt::format("must be true or false, found {}", describe(*node)));
    return node->as_boolean()->get();
}

std::vector<std::string> TomlTable::texts(std::string_view key, int least, int most) {
    const toml::array* array = require(key).as_array();
    const int size = array && array->is_homogeneous<std::string>() ? static_cast<int>(array->size()) : -1;
    if (size < least || size > most)
        fail(key, least == most ? fmt::format("must be {} strings", least)
                                : fmt::format("must be a list of {} to {} strings", least, most));
    std::vector<std::string> values;
    for (const toml::node& node : *array) values.push_back(node.as_string()->get());
    return values;
}

std::optional<TomlTable> TomlTable::table(std::string_view key) {
    const toml::node* node = find(key);
    if (!node) return {};
    if (!node->is_table()) fail(key, fmt::format("must be a table, [{}], found {}", key, describe(*node)));
    return TomlTable(*node->as_table(), file_, std::string(key));
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) {
    const toml::node* node = find(key);
    if (!node) return {};
    const toml::array* array = node->as_array();
    if (!array || !std::all_of(array->begin(), array->end(), [](const toml::node& n) { return n.is_table(); }))
        fail(key, fmt::format("must be tables, [[{}]]", key));
    std::vector<TomlTable> tables;
    for (const toml::node& item : *array) {
        const toml::table& table = *item.as_table();
        const auto name = table["name"].value<std::string>();
        const std::string thing =
            name ? fmt::format("{} '{}'", key, *name) : fmt::format("[[{}]] {}", key, tables.size());
        tables.emplace_back(table, file_, thing);
    }
    return tables;
}

void TomlTable::finish(const std::function<std::string(std::string_view)>& place_of) const {
    for (const auto& [key, node] : table_) {
        if (std::find(asked_.begin(), asked_.end(), key.str()) != asked_.end()) continue;
        const std::string place = place_of ? place_of(key.str()) : "";
        fail_at(key.source(), "",
                place.empty() ? fmt::format("unknown key '{}' (known here: {}){}", key.str(), fmt::join(asked_, ", "),
                                            did_you_mean(key.str(), asked_))
                              : fmt::format("unknown key '{}': it is of {}", key.str(), place));
    }
}

}  // namespace nscdd
