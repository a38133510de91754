// Half the time of a round trip between rank 0 and the last, the bandwidth of large messages, and the time of a look at
// the clock, on real ranks or on those of a simulated machine:
//
//   mpirun -np 2 build/bin/ping_pong
//   smpirun -np 9 -platform cases/platforms/cluster.xml -hostfile cases/platforms/cluster.hosts
//   build/bin/ping_pong_simulated
#include <mpi.h>

#include <algorithm>
#include <cstdio>
#include <vector>

namespace {

// The best of five samples [s].
double half_round_trip(int rank, int last, int bytes, int rounds) {
    std::vector<char> message(static_cast<std::size_t>(bytes));
    double best = 1e9;
    for (int sample = 0; sample < 5; ++sample) {
        MPI_Barrier(MPI_COMM_WORLD);
        const double began = MPI_Wtime();
        for (int round = 0; round < rounds; ++round)
            for (const int sender : {0, last}) {
                if (rank == sender) MPI_Send(message.data(), bytes, MPI_CHAR, last - sender, 0, MPI_COMM_WORLD);
                if (rank == last - sender)
                    MPI_Recv(message.data(), bytes, MPI_CHAR, sender, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
            }
        best = std::min(best, (MPI_Wtime() - began) / (2 * rounds));
    }
    return best;
}

double clock_read() {
    constexpr int reads = 100000;
    const double began = MPI_Wtime();
    double last = began;
    for (int read = 0; read < reads; ++read) last = MPI_Wtime();
    return (last - began) / reads;
}

}  // namespace

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    int rank = 0, size = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    for (const int bytes : {8, 1 << 10, 1 << 14, 1 << 20}) {
        const double seconds = half_round_trip(rank, size - 1, bytes, bytes < (1 << 15) ? 1000 : 100);
        if (rank == 0) std::printf("%d B: %.4f us, %.4f GB/s\n", bytes, 1e6 * seconds, 1e-9 * bytes / seconds);
    }
    if (rank == 0) std::printf("clock read: %.4f us\n", 1e6 * clock_read());
    MPI_Finalize();
    return 0;
}
