// Results as JSON, with where they come from.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "files/replace_file.hpp"

namespace nscdd {

struct Machine {
    std::string cpu;       // model name
    int cores = 0;         // that this process and its launcher may use
    std::string os;        // distribution, kernel and architecture
    std::string compiler;  // that built this program
    int lanes = 0;         // doubles in the vectors that it was compiled for
    bool fused = false;    // whether it rounds a product and sum once, as it must for the bits of other machines
    std::string governor;  // "performance" and the like, what sets the clock; "unknown" where the system hides it
    std::map<std::string, std::string> libraries;  // versions, of those that times depend on
};

struct Provenance {
    std::string command;  // as a shell takes it, without the program's folder
    Machine machine;
    std::string commit;  // of the source, "unknown" outside a repository
    std::string date;    // UTC, 2026-01-31T12:00:00Z
};

Provenance provenance(int argc, const char* const* argv);

// The keys command, machine {cpu, cores, os, compiler, lanes, fused, governor, libraries}, commit and date.
void to_json(nlohmann::json& json, const Provenance& provenance);

// Arguments joined as a POSIX shell reads them back; those with special characters in single quotes.
std::string command_line(int argc, const char* const* argv);

// Indented, with a final newline; numbers that are not finite become null.
// Throws OutputError; an old file is then left as it was.
void write_json(FileSet& files, const std::string& path, const nlohmann::json& json);
void write_json(const std::string& path, const nlohmann::json& json);

}  // namespace nscdd
