// The communicator contract, by in-process ranks. The same pattern over MPI: mpi/test_communicator_mpi.cpp.
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "../catch.hpp"
#include "../communicator_pattern.hpp"
#include "nscdd/comm/in_process.hpp"

using nscdd::Buffer;
using nscdd::InProcess;
using nscdd::Links;

TEST_CASE("in-process ranks receive what was sent, by source", "[communicator]") {
    const int size = GENERATE(1, 2, 5);
    INFO("ranks: " << size);
    InProcess comm(size);
    REQUIRE(comm.size() == size);
    REQUIRE(comm.ranks().size() == static_cast<std::size_t>(size));
    for (int round = 0; round < 2; ++round)
        pattern::check_received(pattern::everything(comm, round), comm.ranks(), size, round);

    const nscdd::Traffic once = pattern::expected_traffic(size);
    CHECK(comm.traffic().messages == 2 * once.messages);
    CHECK(comm.traffic().bytes == 2 * once.bytes);
    CHECK(comm.seconds().wait == 0);
    CHECK(comm.seconds().transfer == 0);
}

TEST_CASE("traffic is counted as defined", "[communicator]") {
    InProcess comm(3);
    SECTION("a link to oneself is no message, an empty message to another is") {
        std::vector<Links> links(3);
        links[0] = {{0, {1, 2}, Buffer(2)}, {2, {3}, {}}};
        links[2] = {{0, {}, Buffer(1)}};
        comm.exchange(links);
        CHECK(links[0][0].recv == Buffer{1, 2});
        CHECK(links[2][0].recv == Buffer{3});
        CHECK(comm.traffic().messages == 2);
        CHECK(comm.traffic().bytes == 8);
    }
    SECTION("a route counts what is not empty and not for oneself") {
        const auto in = comm.route({{{7}, {1, 2}, {}}, {{}, {}, {3}}, {{4}, {5}, {6}}});
        CHECK(in == std::vector<Buffer>{{7, 4}, {1, 2, 5}, {3, 6}});
        CHECK(comm.traffic().messages == 4);
        CHECK(comm.traffic().bytes == 5 * 8);
    }
    SECTION("a gather and a scatter count size-1, an all-gather twice that") {
        std::vector<Buffer> all{Buffer(1), Buffer(2), Buffer(3)};
        comm.gather({{1}, {2, 3}, {4, 5, 6}}, all);
        CHECK(all == std::vector<Buffer>{{1}, {2, 3}, {4, 5, 6}});
        CHECK(comm.traffic().messages == 2);
        CHECK(comm.traffic().bytes == 5 * 8);
        comm.scatter({{1}, {2, 3}, {4, 5, 6}}, all);
        CHECK(comm.traffic().messages == 4);
        CHECK(comm.traffic().bytes == 10 * 8);
        comm.all_gather({{1, 2}, {3, 4}, {5, 6}});
        CHECK(comm.traffic().messages == 8);
        CHECK(comm.traffic().bytes == (10 + 2 * 2 + 2 * 6) * 8);
    }
}

TEST_CASE("sums are taken in rank order", "[communicator]") {
    InProcess comm(3);
    Buffer sum(2);
    nscdd::sum_in_rank_order(comm.all_gather({{1e16, 1}, {1, 2}, {-1e16, 4}}), sum);
    CHECK(sum == Buffer{0, 7});  // any other order gives 1 or 2
}

TEST_CASE("work is charged to a rank", "[communicator]") {
    InProcess comm(2);
    comm.charge(1, 10);
    comm.charge(1, 5);
    CHECK(comm.work()[0] == 0);
    CHECK(comm.work()[1] == 15);
    CHECK_THROWS_AS(comm.charge(2, 1), std::out_of_range);
    const double before = comm.now();
    CHECK(comm.now() >= before);
}

TEST_CASE("threads share the ranks", "[communicator]") {
    const int threads = GENERATE(1, 2, 3, 5);
    INFO("threads: " << threads);
    InProcess comm(5, threads);
    std::vector<int> calls(5, 0);
    std::vector<std::thread::id> by(5);
    for (int round = 1; round <= 100; ++round) {
        comm.each_rank([&](std::size_t k) { ++calls[k], by[k] = std::this_thread::get_id(); });
        REQUIRE(calls == std::vector<int>(5, round));
    }
    CHECK(std::set<std::thread::id>(by.begin(), by.end()).size() == static_cast<std::size_t>(threads));

    const auto throw_from_two = [](std::size_t k) {
        if (k == 1 || k == 4) throw std::runtime_error("rank " + std::to_string(k));
    };
    CHECK_THROWS_WITH(comm.each_rank(throw_from_two), "rank 1");
    comm.each_rank([&](std::size_t k) { ++calls[k]; });
    CHECK(calls == std::vector<int>(5, 101));
}

TEST_CASE("disagreeing ranks are an error that names them", "[communicator]") {
    CHECK_THROWS_AS(InProcess(0), std::invalid_argument);
    CHECK_THROWS_AS(InProcess(-1), std::invalid_argument);
    CHECK_THROWS_AS(InProcess(2, 0), std::invalid_argument);
    CHECK_THROWS_AS(InProcess(2, 3), std::invalid_argument);

    InProcess comm(2);
    std::vector<Links> one_sided{{{1, {1}, {}}}, {}};
    CHECK_THROWS_WITH(comm.exchange(one_sided), "exchange: rank 0 has a link to rank 1, which has none back");
    std::vector<Links> nobody{{{2, {}, {}}}, {}};
    CHECK_THROWS_AS(comm.exchange(nobody), std::logic_error);
    std::vector<Links> unequal{{{1, {1, 2}, {}}}, {{0, {}, Buffer(3)}}};
    CHECK_THROWS_WITH(comm.exchange(unequal), "exchange: rank 0 sends 2 doubles, rank 1 expects 3");
    std::vector<Links> too_few(1);
    CHECK_THROWS_WITH(comm.exchange(too_few), "exchange: 1 buffers for 2 ranks");

    std::vector<Buffer> all{Buffer(1), Buffer(1)};
    CHECK_THROWS_AS(comm.gather({{1}, {2, 3}}, all), std::logic_error);
    CHECK_THROWS_AS(comm.scatter({{1, 2}, {3}}, all), std::logic_error);
    CHECK_THROWS_AS(comm.all_gather({{1}, {2, 3}}), std::logic_error);
    CHECK_THROWS_AS(comm.route({{{1}, {2}}, {{3}}}), std::logic_error);
}
