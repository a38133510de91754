// The communicator contract over MPI, on any number of ranks:  mpirun -np 4 test_communicator_mpi
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <memory>
#include <new>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "../catch.hpp"
#include "../communicator_pattern.hpp"
#include "nscdd/comm/in_process.hpp"
#include "nscdd/comm/mpi.hpp"

using nscdd::Buffer;
using nscdd::Communicator;
using nscdd::InProcess;
using nscdd::Mpi;
using nscdd::WithinNode;

static long allocations = 0;  // by C++; those inside MPI are its own affair

void* operator new(std::size_t n, const std::nothrow_t&) noexcept {
    ++allocations;
    return std::malloc(n > 0 ? n : 1);
}
void* operator new(std::size_t n) {
    if (void* p = operator new(n, std::nothrow)) return p;
    throw std::bad_alloc();
}
// Inlined, GCC takes them for a free() of memory from new.
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace {

double total(double mine) {
    double sum = 0;
    MPI_Allreduce(&mine, &sum, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    return sum;
}

// The least and the most this rank waited in `call`, of a few tries with `late` entering 50 ms after the others.
struct Waited {
    double least = std::numeric_limits<double>::infinity(), most = 0;
};

template <class Call>
Waited waited(Mpi& comm, int late, Call call) {
    Waited waited;
    for (int attempt = 0; attempt < 4; ++attempt) {
        MPI_Barrier(MPI_COMM_WORLD);
        if (comm.ranks()[0] == late) std::this_thread::sleep_for(std::chrono::milliseconds(50));
        const Communicator::Seconds before = comm.seconds();
        const double start = comm.now();
        call();
        const double elapsed = comm.now() - start, wait = comm.seconds().wait - before.wait;
        const double transfer = comm.seconds().transfer - before.transfer;
        CHECK(wait >= 0);
        CHECK(transfer >= -1e-9);
        CHECK(wait + transfer <= elapsed + 1e-9);
        waited.least = std::min(waited.least, wait);
        waited.most = std::max(waited.most, wait);
    }
    return waited;
}

}  // namespace

TEST_CASE("MPI ranks receive what was sent, the same as in-process ranks") {
    const int processes = Mpi().size();
    for (const auto& [size, within] : {std::pair{0, WithinNode::memory},
                                       {0, WithinNode::messages},
                                       {0, WithinNode::modelled},
                                       {processes + 1, WithinNode::memory},
                                       {2 * processes, WithinNode::memory},
                                       {3 * processes + 1, WithinNode::memory},
                                       {3 * processes + 1, WithinNode::messages}}) {
        Mpi comm(MPI_COMM_WORLD, {}, size, within);
        CHECK(comm.size() == (size == 0 ? processes : size));
        CHECK(total(double(comm.ranks().size())) == comm.size());
        InProcess reference(comm.size());
        for (int round = 0; round < 2; ++round) {
            const pattern::Received over_mpi = pattern::everything(comm, round);
            pattern::check_received(over_mpi, comm.ranks(), comm.size(), round);

            const pattern::Received in_process = pattern::everything(reference, round);
            for (std::size_t k = 0; k < comm.ranks().size(); ++k) {
                CHECK(over_mpi.exchanged[k] == in_process.exchanged[comm.ranks()[k]]);
                CHECK(over_mpi.routed[k] == in_process.routed[comm.ranks()[k]]);
            }
            CHECK(over_mpi.all_gathered == in_process.all_gathered);
            CHECK(over_mpi.reduced == in_process.reduced);
        }
        CHECK(total(comm.traffic().messages) == reference.traffic().messages);
        CHECK(total(comm.traffic().bytes) == reference.traffic().bytes);
        for (std::size_t o = 0; o < nscdd::detail::operation_names.size(); ++o)
            CHECK(total(comm.traffic().messages_of[o]) == reference.traffic().messages_of[o]);
    }
    if (processes > 1) CHECK_THROWS_AS(Mpi(MPI_COMM_WORLD, {}, processes - 1), std::invalid_argument);
    if (Mpi two(MPI_COMM_WORLD, {}, 2 * processes, WithinNode::memory, 2); true) {
        std::array<std::thread::id, 2> by;
        two.each_rank([&by](std::size_t k) { by[k] = std::this_thread::get_id(); });
        CHECK(by[0] == std::this_thread::get_id());
        CHECK(by[1] != by[0]);
    }
    const auto charged = [](nscdd::Work, double, double) {};
    CHECK_THROWS_AS(Mpi(MPI_COMM_WORLD, {}, 0, WithinNode::memory, 0), std::invalid_argument);
    CHECK_THROWS_AS(Mpi(MPI_COMM_WORLD, charged, 0, WithinNode::memory, 2), std::invalid_argument);
    MPI_Barrier(MPI_COMM_WORLD);
}

TEST_CASE(
    "messages of any size and several channels under way at once arrive, whether they fit into shared memory or not") {
    Mpi comm;
    const int rank = comm.ranks()[0], size = comm.size();
    const auto doubles = [](int channel, int from, int to) {
        return std::array<std::size_t, 4>{7, 4'000, 60'000, 1}[static_cast<std::size_t>(channel + from + to) % 4];
    };
    for (int opened = 0; opened < 6; ++opened) {  // what was in use is used again
        std::vector<std::unique_ptr<Communicator::Channel>> channels;
        for (int c = 0; c < 3; ++c) {
            Communicator::Links links;
            for (int peer = 0; peer < size; ++peer)
                if (peer != rank) links.push_back({peer, doubles(c, rank, peer), doubles(c, peer, rank)});
            channels.push_back(comm.open({links}));
        }
        for (int round = 0; round < 3; ++round) {
            for (int c = 0; c < 3; ++c)
                for (std::size_t l = 0; l < static_cast<std::size_t>(size - 1); ++l) {
                    const std::span<double> out = channels[static_cast<std::size_t>(c)]->send(0, l);
                    std::iota(out.begin(), out.end(), rank + 1000.0 * c + 1e6 * round + 1e7 * opened);
                }
            for (const auto& channel : channels) channel->start();
            for (int c = 2; c >= 0; --c) {
                Communicator::Channel& channel = *channels[static_cast<std::size_t>(c)];
                channel.finish();
                std::size_t wrong = 0, l = 0;
                for (int peer = 0; peer < size; ++peer) {
                    if (peer == rank) continue;
                    const std::span<const double> in = channel.recv(0, l++);
                    CHECK(in.size() == doubles(c, peer, rank));
                    for (std::size_t k = 0; k < in.size(); ++k)
                        wrong += in[k] != peer + 1000.0 * c + 1e6 * round + 1e7 * opened + static_cast<double>(k);
                }
                CHECK(wrong == 0);
            }
        }
    }
}

TEST_CASE("ranks of one node use the memory that they share, and MPI where they are told to") {
    for (const auto within : {WithinNode::memory, WithinNode::messages}) {
        std::array<double, nscdd::detail::work_names.size()> charged{};
        const auto count = [&charged](nscdd::Work kind, double units, double) {
            charged[static_cast<std::size_t>(kind)] += units;
        };
        Mpi comm(MPI_COMM_WORLD, count, 0, within);
        const int rank = comm.ranks()[0], size = comm.size();
        const auto channel = comm.open({pattern::links(rank, size, 0)});
        channel->start();
        channel->finish();
        comm.reduce(std::vector<Buffer>{Buffer(3)}, 3);
        if (size == 1) continue;  // alone, a rank has no memory to share
        const bool memory = within == WithinNode::memory;
        const double messages = charged[static_cast<std::size_t>(nscdd::Work::message)],
                     copies = charged[static_cast<std::size_t>(nscdd::Work::shared_message)];
        CHECK((memory ? copies : messages) > 1);
        if (memory) CHECK(messages == 0);
        if (!memory) CHECK(copies <= 1);  // of what a rank sends itself
    }
}

TEST_CASE("a row of a reduction may be longer than those that go through shared memory") {
    Mpi comm;
    for (const std::size_t n : {3, 63, 64, 1000, 5}) {
        comm.start_reduce({Buffer(n, 1 + comm.ranks()[0])}, n);
        const std::span<const double> sum = comm.finish_reduce();
        CHECK(std::ranges::count(sum, comm.size() * (comm.size() + 1) / 2) == static_cast<long>(n));
    }
}

TEST_CASE("a communicator of MPI works beside others and on a part of the ranks") {
    Mpi whole;
    const int rank = whole.ranks()[0];
    MPI_Comm half = MPI_COMM_NULL;
    MPI_Comm_split(MPI_COMM_WORLD, rank % 2, -rank, &half);
    {
        Mpi part(half);
        pattern::check_received(pattern::everything(part, 0), part.ranks(), part.size(), 0);
        pattern::check_received(pattern::everything(whole, 1), whole.ranks(), whole.size(), 1);
    }
    MPI_Comm_free(&half);
}

TEST_CASE("nothing is allocated in the iteration") {
    Mpi comm;
    const int rank = comm.ranks()[0], size = comm.size();
    const auto channel = comm.open({pattern::links(rank, size, 0)});
    const std::vector<Buffer> mine{Buffer(4, rank)};
    const auto iterate = [&] {
        channel->start();
        channel->finish();
        comm.all_gather(mine);
        comm.reduce(mine, 2);
    };
    iterate();
    const long before = allocations;
    for (int k = 0; k < 10; ++k) iterate();
    CHECK(allocations == before);
}

TEST_CASE("time is attributed to waiting where a partner is late") {
    Mpi comm;
    const int size = comm.size(), rank = comm.ranks()[0];
    if (size == 1) return;
    const auto channel = comm.open({pattern::links(rank, size, 0)});
    std::vector<Communicator::Outbox> out(1);
    for (int to = 0; to < size; ++to) out[0][to] = Buffer(3);
    const std::vector<Buffer> mine{Buffer(3)};

    const auto waits = [](Waited w) { CHECK(w.most >= 0.04); };
    const auto waits_not = [](Waited w) { CHECK(w.least <= 0.02); };

    const Waited exchange = waited(comm, 0, [&] { channel->start(), channel->finish(); });
    rank != 0 && pattern::linked(rank, 0) ? waits(exchange) : waits_not(exchange);

    channel->count_as(Communicator::Operation::scatter);
    const Communicator::Seconds before = comm.seconds();
    const Waited scatter = waited(comm, 0, [&] { channel->start(), channel->finish(); });
    rank != 0 && pattern::linked(rank, 0) ? waits(scatter) : waits_not(scatter);
    for (std::size_t o = 0; o < nscdd::detail::operation_names.size(); ++o) {
        const bool counted = o == static_cast<std::size_t>(Communicator::Operation::scatter);
        const Communicator::Seconds after = comm.seconds();
        CHECK(after.wait_of[o] - before.wait_of[o] == (counted ? Approx(after.wait - before.wait) : Approx(0)));
        CHECK((after.transfer_of[o] > before.transfer_of[o]) == counted);
    }

    const Waited route = waited(comm, 0, [&] { comm.route(out); });
    rank != 0 ? waits(route) : waits_not(route);

    const Waited all_gather = waited(comm, 0, [&] { comm.all_gather(mine); });
    rank != 0 ? waits(all_gather) : waits_not(all_gather);

    const Waited reduce = waited(comm, 0, [&] { comm.reduce(mine, 3); });
    rank != 0 ? waits(reduce) : waits_not(reduce);
}

TEST_CASE("wrong shapes and disagreeing sizes are errors") {
    Mpi comm;
    const int size = comm.size(), rank = comm.ranks()[0];
    CHECK_THROWS_AS(comm.open({}), std::logic_error);
    CHECK_THROWS_AS(comm.open({{{size, 0, 0}}}), std::logic_error);
    CHECK_THROWS_AS(comm.route({}), std::logic_error);
    CHECK_THROWS_AS(comm.route({{{size, {1}}}}), std::logic_error);
    CHECK_THROWS_AS(comm.meter().charge(1, nscdd::Work::sweep, 1, 0), std::out_of_range);
    if (size > 1) {
        comm.start_reduce({{1}}, 1);
        CHECK_THROWS_AS(comm.start_reduce({{1}}, 1), std::logic_error);  // one is under way
        CHECK(comm.finish_reduce()[0] == size);
    }
    comm.meter().charge(0, nscdd::Work::sweep, 3, 1e3);
    CHECK(comm.meter().swept()[0] == 3.0);

    // Everyone to everyone, so that every rank meets the error and none is left waiting.
    std::vector<Communicator::Links> shorter(1), longer(1);
    for (int peer = 0; peer < size; ++peer)
        if (peer != rank) {
            shorter[0].push_back({peer, 2, 3});
            longer[0].push_back({peer, 3, 2});
        }
    const auto use = [](Mpi& with, const std::vector<Communicator::Links>& links) {
        const auto channel = with.open(links);
        channel->start();
        channel->finish();
    };
    if (size > 1) {
        CHECK_THROWS_AS(use(comm, shorter), std::logic_error);
        CHECK_THROWS_AS(use(comm, longer), std::logic_error);
        Mpi by_messages(MPI_COMM_WORLD, {}, 0, WithinNode::messages);
        CHECK_THROWS_AS(use(by_messages, shorter), std::logic_error);
        CHECK_THROWS_AS(use(by_messages, longer), std::runtime_error);
    }
    MPI_Barrier(MPI_COMM_WORLD);
}
