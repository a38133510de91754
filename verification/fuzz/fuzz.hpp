// What the fuzz targets share: files in memory, and what a reader may do with a bad one.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "files/error.hpp"

namespace nscdd::fuzz {

// Readers take paths; this one needs no disk.
class MemoryFile {
  public:
    MemoryFile() : descriptor_(memfd_create("fuzz", 0)) {}
    ~MemoryFile() { close(descriptor_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;

    void fill(const void* bytes, std::size_t size) const {
        if (ftruncate(descriptor_, 0) != 0 || pwrite(descriptor_, bytes, size, 0) != static_cast<ssize_t>(size))
            abort();
    }
    std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

  private:
    int descriptor_;
};

// Refusals are in order when they are one line; any other exception ends the target.
void refuses_in_one_line(auto&& read) {
    try {
        read();
    } catch (const InputError& error) {
        const std::string line = error.what();
        if (line.find('\n') == std::string::npos && !line.empty()) return;
        std::fprintf(stderr, "not one line: %s\n", line.c_str());
        std::abort();
    }
}

}  // namespace nscdd::fuzz
