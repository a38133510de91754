#include "replace_file.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "error.hpp"

namespace nscdd {
namespace {

[[noreturn]] void fail(const std::string& path, int error) {
    throw OutputError(fmt::format("{}: cannot write: {}", path, std::strerror(error)));
}

}  // namespace

void replace_file(const std::string& path, std::string_view bytes) {
    const std::string part = path + ".part";
    std::FILE* file = std::fopen(part.c_str(), "wb");
    if (!file) fail(path, errno);

    errno = 0;
    bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    written = written && std::fflush(file) == 0;
    int error = errno;
    if (std::fclose(file) != 0 && written) {
        written = false;
        error = errno;
    }
    if (written && std::rename(part.c_str(), path.c_str()) == 0) return;

    if (written) error = errno;
    std::remove(part.c_str());
    fail(path, error);
}

void require_folder(const std::string& path) {
    const auto folder = std::filesystem::path(path).parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder))
        throw InputError(fmt::format("{}: the folder {} does not exist", path, folder.string()));
}

}  // namespace nscdd
