// main() of the programs of tests that all ranks run:  mpirun -np 4 test_...
#define CATCH_CONFIG_RUNNER
#include <mpi.h>

#include <iostream>
#include <sstream>

#include "../catch.hpp"

// The report of rank 0 is printed, and of any rank that fails; a failure ends all ranks at once, as the others may
// be waiting for this one.
int main(int argc, char** argv) {
    int provided = 0;
    MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    std::ostringstream report;
    std::streambuf* const terminal = std::cout.rdbuf();
    if (rank != 0) std::cout.rdbuf(report.rdbuf());
    int failed = 0;
    {
        Catch::Session session;
        session.configData().abortAfter = 1;
        failed = session.applyCommandLine(argc, argv);
        if (failed == 0) failed = session.run();
    }
    std::cout.rdbuf(terminal);
    if (failed != 0) {
        std::cout << "rank " << rank << " failed\n" << report.str() << std::flush;
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    MPI_Finalize();
    return 0;
}
