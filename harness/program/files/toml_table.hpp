// A checked view of a TOML table: typed reads that complain with file and line, and a memory of the keys that were
// read, so that what is left over can be named as a mistake.
#pragma once

#include <toml++/toml.h>
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files/error.hpp"
#include "files/ranges.hpp"

namespace nscdd {

// The file as TOML. Throws InputError, "file:line: problem".
toml::table parse_toml(const std::string& path);

// Every read throws InputError, "file:line: thing: problem". With a fallback the key is optional.
class TomlTable {
  public:
    // `thing` is what messages call the table, "" for the whole file.
    TomlTable(const toml::table& table, std::string file, std::string thing)
        : table_(table), file_(std::move(file)), thing_(std::move(thing)) {}

    bool has(std::string_view key) { return find(key) != nullptr; }
    // Of a key that had an earlier name (null: it had none) the one that the table uses. Throws where it has both.
    std::string_view key_of(const char* name, const char* earlier);
    void name_thing(std::string thing) { thing_ = std::move(thing); }

    double number(std::string_view key, const detail::OptionRange& range, std::optional<double> fallback = {});
    int integer(std::string_view key, const detail::OptionRange& range, std::optional<int> fallback = {});
    bool is_text(std::string_view key);      // whether the key has a string
    bool flag(std::string_view key);         // true or false; false where the key is absent
    std::string text(std::string_view key);  // not empty, no control characters
    int choice(std::string_view key, const std::vector<std::string>& names);  // index into names
    Eigen::VectorXd vector(std::string_view key, int size);                   // size 1: a bare number too
    Eigen::VectorXd vector(std::string_view key, int size, const Eigen::VectorXd& fallback);
    int length(std::string_view key);  // of a list, at least 1
    std::vector<Eigen::VectorXd> rows(std::string_view key, int count, int size);
    std::vector<Eigen::VectorXd> points(std::string_view key, int size, int least);  // at least so many of this size
    // Lists of at least `least` different numbers from 0 to count - 1.
    std::vector<std::vector<int>> index_lists(std::string_view key, int least, int count);
    bool flag(std::string_view key, bool fallback);
    std::vector<int> axes(std::string_view key, int dimension);  // some of "x" to "z", from 0 on
    std::vector<std::string> texts(std::string_view key, int least, int most);

    // [key], called by its key; nothing if it is absent.
    std::optional<TomlTable> table(std::string_view key);
    // All [[key]], called "key 'name'" where they have a name, else "[[key]] 2", counted from 0.
    std::vector<TomlTable> tables(std::string_view key);

    // To be called after the last read: names a key that nothing asked for.
    void finish(const std::function<std::string(std::string_view)>& place_of = {}) const;

    // Problem at the line of `key`, or of the table's head where the key is absent.
    [[noreturn]] void fail(std::string_view key, const std::string& problem) const;

  private:
    const toml::node* find(std::string_view key);
    const toml::node& require(std::string_view key);
    [[noreturn]] void fail_at(const toml::source_region& where, std::string_view key, const std::string& problem) const;
    double number(const toml::node& node, std::string_view what, const detail::OptionRange& range) const;

    const toml::table& table_;
    std::string file_, thing_;
    std::vector<std::string> asked_;
};

}  // namespace nscdd
