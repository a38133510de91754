#include "commands/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "files/error.hpp"

namespace nscdd {

namespace {

// The line by which a program says why it failed: the first of ours or of LAMMPS' errors, else the last.
std::string last_words(const std::string& log) {
    std::ifstream in(log);
    std::string last;
    for (std::string line; std::getline(in, line);) {
        if (line.starts_with("nscdd: ")) return line.substr(7);
        if (line.starts_with("ERROR")) return line;
        if (!line.empty()) last = line;
    }
    return last.empty() ? "it printed nothing" : last;
}

}  // namespace

void run_program(const std::vector<std::string>& words, const std::string& log, const std::string& folder) {
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
    if (!folder.empty()) posix_spawn_file_actions_addchdir_np(&files, folder.c_str());
    pid_t child = 0;
    const int failed = posix_spawnp(&child, arguments[0], &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    if (failed) throw std::runtime_error(fmt::format("{}: cannot be started: {}", words[0], std::strerror(failed)));
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
    throw std::runtime_error(
        fmt::format("{} ended with {} {}: {}{}", words[0], WIFEXITED(status) ? "exit code" : "signal",
                    WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status), one_line(last_words(log)),
                    folder.empty() ? fmt::format(" (all it printed: {})", log) : ""));
}

bool on_path(const std::string& name) {
    const char* const path = std::getenv("PATH");
    std::istringstream folders(path ? path : "/bin:/usr/bin");
    for (std::string folder; std::getline(folders, folder, ':');) {
        const std::string file = (folder.empty() ? "." : folder) + "/" + name;
        if (std::filesystem::is_regular_file(file) && ::access(file.c_str(), X_OK) == 0) return true;
    }
    return false;
}

}  // namespace nscdd
