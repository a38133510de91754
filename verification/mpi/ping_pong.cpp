// Half the time of a round trip between rank 0 and the last, the bandwidth of large messages, the time of a look at the
// clock, and the time that MPI's calls take for a message that is under way while both ranks compute; then the same of
// messages through memory that the ranks share, if they do. On real ranks or on those of a simulated machine:
//
//   mpirun -np 2 build/bin/ping_pong
//   smpirun -np 9 -platform cases/platforms/cluster.xml -hostfile cases/platforms/cluster.hosts
//   build/bin/ping_pong_simulated
#include <mpi.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <vector>

#include "nscdd/comm/mpi.hpp"

namespace {

// The best of five samples [s]. ends: the communicator of rank 0 and the last, which alone call this.
double half_round_trip(MPI_Comm ends, int rank, int last, int bytes, int rounds) {
    std::vector<char> message(static_cast<std::size_t>(bytes));
    double best = 1e9;
    for (int sample = 0; sample < 5; ++sample) {
        MPI_Barrier(ends);
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

// Time in calls [s] for each message that a rank sends or receives, when it has long been there: the median of samples.
// Both ranks send and receive, and compute for 20 us meanwhile.
double call(int rank, int last, int bytes, double look) {
    constexpr int rounds = 200, samples = 25;
    std::vector<char> out(static_cast<std::size_t>(bytes)), in(static_cast<std::size_t>(bytes));
    std::array<MPI_Request, 2> requests;
    std::array<double, samples> inside{};
    for (double& seconds : inside) {
        for (int round = 0; round < rounds; ++round) {
            const double began = MPI_Wtime();
            MPI_Irecv(in.data(), bytes, MPI_CHAR, last - rank, 0, MPI_COMM_WORLD, requests.data());
            MPI_Isend(out.data(), bytes, MPI_CHAR, last - rank, 0, MPI_COMM_WORLD, requests.data() + 1);
            const double started = MPI_Wtime();
            double now = started;
            while (now < started + 20e-6) now = MPI_Wtime();
            MPI_Wait(requests.data(), MPI_STATUS_IGNORE);
            MPI_Wait(requests.data() + 1, MPI_STATUS_IGNORE);
            seconds += (MPI_Wtime() - now + started - began) / (2 * rounds);
        }
    }
    std::sort(inside.begin(), inside.end());
    return inside[samples / 2] - look;  // two looks at the clock and two messages
}

// Through memory [s], a message from each to the other by nscdd::Channel, without its four looks at the clock; medians.
struct Shared {
    double exchange;  // of messages that both send at once and wait for
    double copy;      // for each message sent or received, when it has long been there
};
Shared shared(nscdd::Mpi& comm, int bytes, double look) {
    constexpr int rounds = 1000, samples = 25;
    const int rank = comm.ranks()[0], last = comm.size() - 1;
    const auto doubles = static_cast<std::size_t>(bytes) / sizeof(double);
    std::vector<nscdd::Communicator::Links> links(1);
    if (rank == 0 || rank == last) links[0].push_back({last - rank, doubles, doubles});
    const auto channel = comm.open(links);
    std::array<double, samples> exchange{}, copy{};
    for (std::size_t s = 0; !links[0].empty() && s < samples; ++s) {
        const double began = MPI_Wtime();
        for (int round = 0; round < rounds; ++round) channel->start(), channel->finish();
        exchange[s] = (MPI_Wtime() - began) / rounds - 4 * look;
        for (int round = 0; round < rounds / 5; ++round) {
            const double before = MPI_Wtime();
            channel->start();
            const double started = MPI_Wtime();
            double now = started;
            while (now < started + 20e-6) now = MPI_Wtime();
            channel->finish();
            copy[s] += ((MPI_Wtime() - now + started - before) - 6 * look) / (2 * (rounds / 5));
        }
    }
    for (auto* samples_of : {&exchange, &copy}) std::sort(samples_of->begin(), samples_of->end());
    return {exchange[samples / 2], copy[samples / 2]};
}

// What a platform's file of SimGrid says of such a machine (cases/platforms/two-cores.xml), as pairs of name and value.
// The link is what the copies of both sides leave of an exchange through memory, if anything. Up to 256 B Open MPI
// sends a message within the call that is told of it.
void tell_platform(const std::map<int, double>& calls, const std::map<int, Shared>& shared, double look) {
    constexpr int small = 8, middle = 1 << 10, large = 1 << 14;
    // On a busy machine a short message may seem to take longer.
    const auto slope = [](double at_large, double at_small, int bytes) {
        return std::max(at_large - at_small, 0.0) / bytes;
    };
    const auto copy = [&shared](int bytes) { return shared.at(bytes).copy; };
    const double call = slope(calls.at(large), calls.at(middle), large - middle),
                 few = slope(copy(middle), copy(small), middle - small),
                 many = slope(copy(large), copy(middle), large - middle),
                 latency = std::max(shared.at(small).exchange - 2 * copy(small), 1e-8),
                 passed = slope(shared.at(large).exchange, shared.at(middle).exchange, large - middle),
                 sent = std::max({passed - 2 * many, 0.01 * passed, 1e-12});
    std::printf("platform: latency %.3gus bandwidth %.3gGBps call 0:%.3g:0;257:%.3g:%.3g", 1e6 * latency, 1e-9 / sent,
                calls.at(small), std::max(calls.at(middle) - middle * call, 0.0), call);
    std::printf(" shared 0:%.3g:%.3g;%d:%.3g:%.3g clock %.3g\n", copy(small), few, middle + 1,
                std::max(copy(middle) - middle * many, 0.0), many, look);
}

}  // namespace

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    int rank = 0, size = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    // The other ranks wait: on a simulated machine of 1,024 what all do takes minutes.
    const bool at_end = rank == 0 || rank == size - 1;
    MPI_Comm ends;
    MPI_Comm_split(MPI_COMM_WORLD, at_end ? 0 : MPI_UNDEFINED, rank, &ends);
    std::map<int, double> trip, calls;  // by bytes
    std::map<int, Shared> through_memory;
    for (const int bytes : {8, 1 << 10, 1 << 14, 1 << 20}) {
        if (!at_end) break;
        trip[bytes] = half_round_trip(ends, rank, size - 1, bytes, bytes < (1 << 15) ? 1000 : 100);
        if (rank == 0) std::printf("%d B: %.4f us, %.4f GB/s\n", bytes, 1e6 * trip[bytes], 1e-9 * bytes / trip[bytes]);
    }
    double look = rank == 0 ? clock_read() : 0;
    MPI_Bcast(&look, 1, MPI_DOUBLE, 0, MPI_COMM_WORLD);
    if (rank == 0) std::printf("clock read: %.4f us\n", 1e6 * look);
    if (look > 0 && size > 1 && at_end) {  // a simulated clock may stand still
        for (const int bytes : {8, 1 << 10, 1 << 14}) {
            calls[bytes] = call(rank, size - 1, bytes, look);
            if (rank == 0) std::printf("calls for a message of %d B: %.4f us\n", bytes, 1e6 * calls[bytes]);
        }
    }
    if (look > 0 && size > 1) {
        nscdd::Mpi comm;
        for (const int bytes : {8, 1 << 10, 1 << 14, 1 << 17}) {
            through_memory[bytes] = shared(comm, bytes, look);
            if (rank == 0)
                std::printf("through memory, %d B: exchange %.4f us, copy %.4f us\n", bytes,
                            1e6 * through_memory[bytes].exchange, 1e6 * through_memory[bytes].copy);
        }
        if (rank == 0) tell_platform(calls, through_memory, look);
    }
    if (at_end) MPI_Comm_free(&ends);
    MPI_Finalize();
    return 0;
}
