// Whether all ranks of a run read the same: ranks of different scenes or states would wait for each other.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "commands/session.hpp"
#include "files/replace_file.hpp"

namespace nscdd {

// What tells the contents of each file apart, for require_same_files(); "" for no file: a run that goes on from a state
// needs no packing. Simulated ranks are of one process and read one file. Throws InputError.
inline std::vector<std::string> sums_of_files(const Session& session, const std::vector<NamedFile>& files) {
    std::vector<std::string> sums(files.size());
    for (std::size_t k = 0; k < files.size() && session.size() > 1 && !simulated; ++k)
        if (const auto& path = files[k].path; path && std::filesystem::exists(*path)) sums[k] = checksum_of_file(*path);
    return sums;
}

// Throws InputError, on all ranks, unless they all have the same contents. Collective.
inline void require_same_files(const Session& session, const std::vector<NamedFile>& files,
                               const std::vector<std::string>& sums) {
    for (std::size_t k = 0; k < files.size(); ++k)
        session.require_same(fmt::format("contents of {}, {}", files[k].name, files[k].path.value_or("none")), sums[k]);
}

}  // namespace nscdd
