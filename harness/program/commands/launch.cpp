#include "commands/launch.hpp"

#include <fcntl.h>

#include <array>
#include <csignal>
#include <cstdlib>

#include "commands/session.hpp"

namespace nscdd {

// SLURM_NTASKS says nothing: a batch script has it too, and srun starts MPI programs by PMI or PMIx.
bool launched() {
    if (simulated) return true;
    for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"})
        if (std::getenv(name)) return true;
    return false;
}

std::string mpi_library() {
    std::array<char, MPI_MAX_LIBRARY_VERSION_STRING> text{};
    int length = 0;
    MPI_Get_library_version(text.data(), &length);  // may be asked before MPI_Init; one line or more
    const std::string all(text.data());
    return all.substr(0, all.find_first_of(",\n"));
}

int begin_together(std::span<char*> words, bool with_mpi, const std::function<void(int)>& check,
                   const std::function<int(const Session&, int)>& part) {
    std::string line;
    for (const char* word : words.subspan(1)) (line += word) += '\0';  // the program's own name may differ
    const Session session(with_mpi || launched());
    if (!session.together([&] { check(session.size()); }) ||
        !session.together([&] { session.require_same("scenes or options", line); }))
        return 1;
    return part(session, session.rank());
}

void survive_streams_and_limits() {
    for (const int stream : {0, 1, 2})  // open() takes the lowest number that is free
        if (::fcntl(stream, F_GETFD) < 0 && ::open("/dev/null", O_RDWR) < 0) return;
    for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
}

}  // namespace nscdd
