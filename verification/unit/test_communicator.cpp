// The communicator contract, by in-process ranks. The same pattern over MPI: mpi/test_communicator_mpi.cpp.
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "../catch.hpp"
#include "../communicator_pattern.hpp"
#include "nscdd/comm/in_process.hpp"
#include "nscdd/comm/reduction_rounds.hpp"
#include "nscdd/comm/route_by_square.hpp"

using nscdd::Buffer;
using nscdd::Communicator;
using nscdd::InProcess;
using nscdd::detail::RankMap;
using nscdd::detail::ReducedRows;

TEST_CASE("in-process ranks receive what was sent, by source", "[communicator]") {
    const int size = GENERATE(1, 2, 5);
    INFO("ranks: " << size);
    InProcess comm(size);
    REQUIRE(comm.size() == size);
    REQUIRE(comm.ranks().size() == static_cast<std::size_t>(size));
    for (int round = 0; round < 2; ++round)
        pattern::check_received(pattern::everything(comm, round), comm.ranks(), size, round);

    const Communicator::Traffic once = pattern::expected_traffic(size);
    CHECK(comm.traffic().messages == 2 * once.messages);
    CHECK(comm.traffic().bytes == 2 * once.bytes);
    CHECK(comm.seconds().wait == 0);
    CHECK(comm.seconds().transfer == 0);
}

TEST_CASE("traffic is counted as defined, by operation", "[communicator]") {
    InProcess comm(3);
    const auto messages_of = [&comm](Communicator::Operation operation) {
        return comm.traffic().messages_of[static_cast<std::size_t>(operation)];
    };
    SECTION("a link to oneself is no message, an empty message to another is") {
        const auto channel = comm.open({{{0, 2, 2}, {2, 1, 0}}, {}, {{0, 0, 1}}});
        channel->send(0, 0)[1] = 2;
        channel->send(0, 1)[0] = 3;
        channel->start();
        channel->finish();
        CHECK(channel->recv(0, 0)[1] == 2);
        CHECK(channel->recv(2, 0)[0] == 3);
        CHECK(comm.traffic().messages == 2);
        CHECK(comm.traffic().bytes == 8);
        CHECK(messages_of(Communicator::Operation::exchange) == 2);
        channel->count_as(Communicator::Operation::gather);
        channel->start();
        channel->finish();
        CHECK(messages_of(Communicator::Operation::exchange) == 2);
        CHECK(messages_of(Communicator::Operation::gather) == 2);
        CHECK(comm.traffic().messages == 4);
    }
    SECTION("a route counts what is not empty and not for oneself") {
        const auto in = comm.route({{{0, {7}}, {1, {1, 2}}, {2, {}}}, {{2, {3}}}, {{0, {4}}, {1, {5}}, {2, {6}}}});
        CHECK(in == std::vector<Buffer>{{7, 4}, {1, 2, 5}, {3, 6}});
        CHECK(comm.traffic().messages == 4);
        CHECK(comm.traffic().bytes == 5 * 8);
        CHECK(messages_of(Communicator::Operation::route) == 4);
    }
    SECTION("an all-gather counts twice size-1, a reduction its rounds") {
        comm.all_gather({{1, 2}, {3, 4}, {5, 6}});
        CHECK(comm.traffic().messages == 4);
        CHECK(comm.traffic().bytes == (2 * 2 + 2 * 6) * 8);
        comm.reduce({{1, 2}, {3, 4}, {5, 6}}, 2);
        CHECK(comm.traffic().messages == 4 + 6);  // one round of all three
        CHECK(comm.traffic().bytes == (2 * 2 + 2 * 6 + 6 * 2) * 8);
        CHECK(messages_of(Communicator::Operation::all_gather) == 4);
        CHECK(messages_of(Communicator::Operation::reduction) == 6);
    }
}

TEST_CASE("a route by the square of the ranks brings what a route does, with fewer messages", "[communicator]") {
    for (const int size : {1, 2, 3, 5, 7, 8, 12, 16, 21}) {
        INFO(size << " ranks");
        InProcess comm(size);
        std::vector<Communicator::Outbox> out(static_cast<std::size_t>(size));
        for (int from = 0; from < size; ++from)
            for (int to = 0; to < size; ++to) out[from][to] = pattern::message(from, to, 1);
        const double before = comm.traffic().messages;
        const std::vector<Buffer> direct = comm.route(out);
        const double directly = comm.traffic().messages - before;
        CHECK(nscdd::detail::route_by_square(comm, out) == direct);
        const double by_square = comm.traffic().messages - before - directly;
        if (size == 21) CHECK(by_square < 0.6 * directly);
    }
}

TEST_CASE("ranks that add nothing to a reduction need no row", "[communicator]") {
    const Buffer nothing{0, -std::numeric_limits<double>::infinity()};
    for (const int size : {1, 2, 3, 7, 48}) {
        INFO(size << " ranks");
        std::vector<Buffer> some(static_cast<std::size_t>(size)), all;
        for (std::size_t rank = 0; rank < some.size(); ++rank) {
            if (rank % 5 == 0)
                some[rank] = {rank == 0 ? -0.0 : std::sin(double(rank)), rank < 5 ? -0.0 : -double(rank)};
            all.push_back(some[rank].empty() ? nothing : some[rank]);
        }
        InProcess comm(size);
        const std::span<const double> found = comm.reduce(all, 1);
        const Buffer expected(found.begin(), found.end());
        const auto same = [&expected](std::span<const double> row) {
            CHECK(std::ranges::equal(row, expected));
            for (std::size_t n = 0; n < row.size(); ++n) CHECK(std::signbit(row[n]) == std::signbit(expected[n]));
        };
        same(comm.reduce(some, 1));
        const nscdd::detail::RankMap hosted(0, 1, size);
        nscdd::detail::ReducedRows rows(hosted);
        rows.start(some, 1, 0);
        while (rows.under_way()) {
            rows.trade([](int, Buffer&) {}, [](int, Buffer&) {}, [](std::span<const double>) {});
            rows.finish_round();
        }
        same(rows.row(0));
    }
}

TEST_CASE("the rounds of a reduction give all ranks the bits of the tree", "[communicator]") {
    for (const int size : {1, 2, 3, 4, 5, 7, 8, 13, 31, 48, 64, 100})
        for (const int processes : {size, (size + 2) / 3}) {
            INFO(size << " ranks on " << processes << " processes");
            InProcess comm(size);
            std::vector<Buffer> all;
            for (int rank = 0; rank < size; ++rank)
                all.push_back({std::sin(rank + 1.0) * std::pow(10, rank % 17), std::cos(rank)});
            const std::span<const double> expected = comm.reduce(all, 1);

            std::vector<std::unique_ptr<nscdd::detail::RankMap>> hosted;
            std::vector<nscdd::detail::ReducedRows> rows;
            for (int p = 0; p < processes; ++p) {
                hosted.push_back(std::make_unique<nscdd::detail::RankMap>(p, processes, size));
                const auto& ranks = hosted.back()->ranks();
                const std::vector<Buffer> mine(all.begin() + ranks.front(), all.begin() + ranks.back() + 1);
                rows.emplace_back(*hosted.back()).start(mine, 1, p);
            }
            int rounds = 0;
            for (; rows[0].under_way(); ++rounds) {
                std::map<std::pair<int, int>, std::vector<Buffer>> sent;  // from, to: in order
                std::map<std::pair<int, int>, std::vector<Buffer*>> awaited;
                for (int p = 0; p < processes; ++p)
                    rows[static_cast<std::size_t>(p)].trade(
                        [&](int from, Buffer& row) {
                            awaited[{from, p}].push_back(&row);
                        },
                        [&](int to, Buffer& row) {
                            sent[{p, to}].push_back(row);
                        },
                        [](std::span<const double>) {});
                REQUIRE(sent.size() == awaited.size());
                for (const auto& [between, messages] : sent) {
                    REQUIRE(awaited[between].size() == messages.size());
                    for (std::size_t m = 0; m < messages.size(); ++m) *awaited[between][m] = messages[m];
                }
                for (nscdd::detail::ReducedRows& of : rows) of.finish_round();
            }
            CHECK(rounds == static_cast<int>(std::ceil(std::log2(Communicator::tree_size(size)) / 2)));
            for (std::size_t p = 0; p < rows.size(); ++p) {
                for (std::size_t k = 0; k < hosted[p]->count(); ++k)
                    CHECK(std::ranges::equal(rows[p].row(k), expected));
                CHECK(rows[p].stamp() == processes - 1);
            }
        }
}

TEST_CASE("sums are taken in the order of the tree, and a NaN is the largest", "[communicator]") {
    InProcess comm(4);
    const std::span<const double> all =
        comm.reduce({{1e16, 1, 2, 5, -0.0}, {1, 2, 9, NAN, 0.0}, {-1e16, 4, 1, 7, -0.0}, {1, 8, 3, 9, -0.0}}, 2);
    CHECK(all[0] == 0);  // (1e16 + 1) + (-1e16 + 1): any other order gives 1 or 2
    CHECK(all[1] == 15);
    CHECK(all[2] == 9);
    CHECK(std::isnan(all[3]));
    CHECK(!std::signbit(all[4]));
}

TEST_CASE("work is charged to a rank, of which swept() tells the contacts", "[communicator]") {
    InProcess comm(2);
    comm.meter().charge(1, nscdd::Work::sweep, 10, 1e3);
    comm.meter().charge(1, nscdd::Work::accelerated, 5, 1e3);
    for (const nscdd::Work other : {nscdd::Work::residual, nscdd::Work::pack, nscdd::Work::glue})
        comm.meter().charge(1, other, 7, 1e3);
    CHECK(comm.meter().swept()[0] == 0);
    CHECK(comm.meter().swept()[1] == 15);
    CHECK_THROWS_AS(comm.meter().charge(2, nscdd::Work::sweep, 1, 0), std::out_of_range);
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
    std::vector<std::thread::id> reducing(5);  // the tasks of a reduction too
    const double sum = nscdd::reduce(comm, 1, [&](std::size_t k) {
        reducing[k] = std::this_thread::get_id();
        return Buffer{double(k)};
    })[0];
    CHECK(sum == 10);
    CHECK(reducing == by);

    const auto throw_from_two = [](std::size_t k) {
        if (k == 1 || k == 4) throw std::runtime_error("rank " + std::to_string(k));
    };
    CHECK_THROWS_WITH(comm.each_rank(throw_from_two), "rank 1");
    comm.each_rank([&](std::size_t k) { ++calls[k]; });
    CHECK(calls == std::vector<int>(5, 101));
}

TEST_CASE("a communicator is called by one thread at a time, and not by tasks", "[communicator]") {
    const int threads = GENERATE(1, 3);
    InProcess comm(3, threads);
    const std::vector<Buffer> numbers(3, Buffer{1});
    const std::map<std::string, std::function<void()>> calls{
        {"each_rank", [&] { comm.each_rank([](std::size_t) {}); }},
        {"open", [&] { comm.open(std::vector<Communicator::Links>(3)); }},
        {"route", [&] { comm.route(std::vector<Communicator::Outbox>(3)); }},
        {"all_gather", [&] { comm.all_gather(numbers); }},
        {"reduce", [&] { comm.reduce(numbers, 1); }},
    };
    for (const auto& [name, call] : calls) {
        const std::string why =
            name + ": a communicator is called by one thread at a time, and not by tasks of each_rank()";
        for (const std::size_t rank : {0U, 2U})
            CHECK_THROWS_WITH(comm.each_rank([&, rank](std::size_t k) {
                if (k == rank) call();
            }),
                              why);
        std::string said;
        {
            const nscdd::Turn::Hold hold(comm.turn(), "several calls");
            CHECK_NOTHROW(call());
            std::thread([&] {
                try {
                    call();
                } catch (const std::logic_error& error) {
                    said = error.what();
                }
            }).join();
        }
        CHECK(said == why);
        std::thread(call).join();  // whoever comes when the turn is free
        CHECK_NOTHROW(call());
    }
}

TEST_CASE("disagreeing ranks are an error that names them", "[communicator]") {
    CHECK_THROWS_AS(InProcess(0), std::invalid_argument);
    CHECK_THROWS_AS(InProcess(-1), std::invalid_argument);
    CHECK_THROWS_AS(InProcess(2, 0), std::invalid_argument);
    CHECK_THROWS_AS(InProcess(2, 3), std::invalid_argument);

    InProcess comm(2);
    CHECK_THROWS_WITH(comm.open({{{1, 1, 0}}, {}}), "open: rank 0 has a link to rank 1, which has none back");
    CHECK_THROWS_AS(comm.open({{{2, 0, 0}}, {}}), std::logic_error);
    CHECK_THROWS_WITH(comm.open({{{1, 2, 0}}, {{0, 0, 3}}}), "open: rank 0 sends 2 doubles, rank 1 expects 3");
    CHECK_THROWS_WITH(comm.open({{}}), "open: 1 buffers for 2 ranks");

    CHECK_THROWS_AS(comm.all_gather({{1}, {2, 3}}), std::logic_error);
    CHECK_THROWS_AS(comm.reduce({{1}, {2, 3}}, 1), std::logic_error);
    CHECK_THROWS_AS(comm.reduce({{1}, {2}}, 2), std::logic_error);
    CHECK_THROWS_AS(comm.route({{}}), std::logic_error);
    CHECK_THROWS_WITH(comm.route({{{2, {1}}}, {}}), "route: rank 0 sends to rank 2, which is none");
}
