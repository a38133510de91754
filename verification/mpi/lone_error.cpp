// One rank has an error while the others wait in a call for it: all end, with one line.
#include "commands/session.hpp"

int main() {
    const nscdd::Session session(true);
    session.together([&session] {
        if (session.rank() == 1) throw std::runtime_error("what no other rank knows");
        MPI_Barrier(MPI_COMM_WORLD);
    });
    fmt::print("not stopped\n");
}
