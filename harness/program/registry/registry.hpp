// What the program offers by name: ways to solve a step, and to deal space to subdomains. The lines are in
// schemes.hpp and partitions.hpp; command line, factories and what may be combined follow from them.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace nscdd {

struct SchemeInfo {
    const char* name;
    const char* help;  // of --scheme
    bool decomposed;   // works on several subdomains
    bool sweeps;       // takes options of sweeps (OptionInfo), the others do not sweep
};

struct PartitionInfo {
    const char* name;
    const char* help;  // of --partition
};

std::span<const SchemeInfo> offered_schemes();
std::span<const PartitionInfo> offered_partitions();

// Names, and "name: help; name: help", of the entries for which wanted(entry) is true.
std::vector<std::string> names_of(auto offered, auto&& wanted) {
    std::vector<std::string> names;
    for (const auto& entry : offered)
        if (wanted(entry)) names.emplace_back(entry.name);
    return names;
}
std::string help_of(auto offered, auto&& wanted) {
    std::string text;
    for (const auto& entry : offered)
        if (wanted(entry)) text += (text.empty() ? "" : "; ") + std::string(entry.name) + ": " + entry.help;
    return text;
}

// Of a name that the command line has let pass.
const SchemeInfo& offered_scheme(const std::string& name);
inline bool sequential(const std::string& scheme) { return !offered_scheme(scheme).decomposed; }
inline bool sweeps(const std::string& scheme) { return offered_scheme(scheme).sweeps; }

}  // namespace nscdd
