// Files that no process has whole: read by shares, written by pieces.
#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "../catch.hpp"
#include "../small_scenes.hpp"
#include "made_up_state.hpp"
#include "model/simulation_state.hpp"
#include "scratch.hpp"

using namespace nscdd;
using nscdd::test::check_equal;
using nscdd::test::complaint;
using nscdd::test::made_up_state;
using nscdd::test::Scratch;

namespace {

void append(auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); }

void append_rows(State& to, const State& rows) {
    append(to.packing.x, rows.packing.x), append(to.packing.radius, rows.packing.radius);
    append(to.velocity, rows.velocity), append(to.spin, rows.spin), append(to.material, rows.material);
    append(to.subdomain, rows.subdomain), append(to.multiplicity, rows.multiplicity),
        append(to.broad_phase.x, rows.broad_phase.x);
    append(to.contacts.i, rows.contacts.i), append(to.contacts.j, rows.contacts.j);
    append(to.contacts.impulse, rows.contacts.impulse), append(to.contacts.normal, rows.contacts.normal);
    append(to.contacts.gap, rows.contacts.gap), append(to.contacts.subdomain, rows.contacts.subdomain);
    append(to.contacts.normal_impulse, rows.contacts.normal_impulse);
}

// Counts the doubles that come to rank 0 in one call.
class Watched final : public Communicator {
  public:
    explicit Watched(int ranks) : comm_(ranks) {}
    std::size_t largest_route = 0;

    int size() const override { return comm_.size(); }
    std::span<const int> ranks() const override { return comm_.ranks(); }
    std::unique_ptr<Channel> open(const std::vector<Links>& links) override { return comm_.open(links); }
    std::vector<Buffer> route(const std::vector<Outbox>& out) override {
        std::vector<Buffer> in = comm_.route(out);
        largest_route = std::max(largest_route, in[0].size());
        return in;
    }
    std::span<const double> all_gather(const std::vector<Buffer>& mine) override { return comm_.all_gather(mine); }
    void start_reduce(const std::vector<Buffer>& mine, std::size_t added) override { comm_.start_reduce(mine, added); }
    std::span<const double> finish_reduce() override { return comm_.finish_reduce(); }
    void advance() override { comm_.advance(); }
    double now() const override { return comm_.now(); }
    Meter& meter() override { return comm_.meter(); }
    Traffic traffic() const override { return comm_.traffic(); }
    Seconds seconds() const override { return comm_.seconds(); }

  private:
    InProcess comm_;
};

// A request that names the walls and the material of a small scene.
RunRequest request_of(std::size_t walls) {
    RunRequest request;
    request.scene.walls.resize(walls);
    request.scene.materials.push_back({"glass", 1.0});
    return request;
}

}  // namespace

TEST_CASE("shares of a file are all of its rows, each once", "[state][shares]") {
    const Scratch scratch;
    const int grains = GENERATE(1, 3, 20000), processes = GENERATE(1, 2, 5);
    const std::string path = scratch.path("whole.h5");
    const State whole = made_up_state(3, std::max(grains, 2));
    write_state(path, whole);
    State read;
    Packing packing;
    for (int part = 0; part < processes; ++part) {
        const State rows = read_state(path, {part, processes});
        CHECK(rows.packing.total() == whole.packing.size());
        CHECK(rows.packing.before == read.packing.size());
        CHECK(rows.packing.size() <= whole.packing.size() / static_cast<std::size_t>(processes) + 1);
        CHECK(rows.contacts.i.size() <= 3 / static_cast<std::size_t>(processes) + 1);
        State before = part == 0 ? State{} : read;
        read = rows;  // all that is not rows
        read.packing.x = before.packing.x, read.packing.radius = before.packing.radius;
        read.velocity = before.velocity, read.spin = before.spin, read.material = before.material;
        read.subdomain = before.subdomain, read.multiplicity = before.multiplicity,
        read.broad_phase.x = before.broad_phase.x;
        read.contacts = before.contacts;
        append_rows(read, rows);
        append(packing.radius, read_packing(path, {part, processes}).radius);
    }
    read.packing.before = 0;
    check_equal(read, whole);
    CHECK(packing.radius == whole.packing.radius);
}

TEST_CASE("a share of another file's rows is those rows, as far as there are any", "[packing][shares]") {
    const Scratch scratch;
    const std::string path = scratch.path("three.h5");
    write_packing(path, {.dim = 2, .x = {1, 2, 3, 4, 5, 6}, .radius = {1, 2, 3}, .box = {4, 4}});
    CHECK(read_packing(path, {0, 2, 4}).radius == std::vector<double>{1, 2});
    CHECK(read_packing(path, {1, 2, 4}).radius == std::vector<double>{3});
    const Packing beyond = read_packing(path, {2, 3, 30});
    CHECK((beyond.size() == 0 && beyond.total() == 3 && beyond.box.size() == 2));
}

TEST_CASE("a bad row is named by its number in the file, by whoever reads it", "[packing][state][shares][bad-input]") {
    const Scratch scratch;
    const std::string path = scratch.path("bad.h5");
    State state = made_up_state(2, 100);
    const auto complaints = [&] {
        write_state(path, state);
        std::vector<std::string> all;
        for (int part = 0; part < 4; ++part) all.push_back(complaint<InputError>([&] { read_state(path, {part, 4}); }));
        return all;
    };
    const auto of_part = [&](int part, const std::string& problem) {
        std::vector<std::string> all(4);
        all[static_cast<std::size_t>(part)] = path + ": dataset " + problem;
        return all;
    };
    CHECK(complaints() == std::vector<std::string>(4));
    state.packing.radius[77] = -1;
    CHECK(complaints() == of_part(3, "'radius': row 77 must be > 0, found -1"));
    state = made_up_state(2, 100);
    state.velocity[2 * 30 + 1] = NAN;
    CHECK(complaints() == of_part(1, "'velocity': row 30 is not finite, found nan"));
    state = made_up_state(2, 100);
    state.material[99] = 2;
    CHECK(complaints() == of_part(3, "'material': row 99 must lie in [0, 1], found 2"));
    state = made_up_state(2, 100);
    state.contacts.i[2] = 100;
    CHECK(complaints() == of_part(3, "'contacts/i': row 2 must lie in [0, 99], found 100"));
}

TEST_CASE("a state written by pieces is the state, and says what it lacks", "[state][shares]") {
    const Scratch scratch;
    const State whole = made_up_state(3, 20000);
    write_state(scratch.path("once.h5"), whole);
    const auto write = [&](int pieces, std::size_t grains) {
        FileSet files;
        StateWriter writer(files, scratch.path("pieces.h5"), whole, grains, 3);
        for (int part = 0; part < pieces; ++part) writer.append(read_state(scratch.path("once.h5"), {part, pieces}));
        writer.save();
        files.commit();
    };
    write(7, 20000);
    check_equal(read_state(scratch.path("pieces.h5")), whole);

    CHECK_THROWS_WITH(write(7, 20001),
                      Catch::Contains("pieces.h5: dataset '") && Catch::Contains("20000 of 20001 rows were written"));
    CHECK_THROWS_WITH(write(7, 19999),
                      Catch::Contains("pieces.h5: dataset 'x': 8574 values are no rows of it, or more"));
}

TEST_CASE("rank 0 never has more than a piece of a state that it writes", "[state][shares]") {
    using M = scenes::Disks;
    const Scratch scratch;
    const auto scene = scenes::settled(scenes::heap<M>(true), 200);
    const auto largest = [&](int at_once, const std::string& name) {
        Watched comm(3);
        Simulation<M> simulation(comm, scene.settings, scene.grains, scene.impulses);
        simulation.step(by_nscdd<Dcs<M>>({}));
        comm.largest_route = 0;
        FileSet files;
        const State head = state_head(simulation, request_of(scene.settings.walls.size()));
        write_state(simulation, head, files, scratch.path(name), at_once);
        files.commit();
        return comm.largest_route;
    };
    const std::size_t all = largest(64, "once.h5"), piece = largest(4, "pieces.h5");
    CHECK(all >= 64 * 17);  // doubles of a disk
    CHECK(4 * piece < all);
    check_equal(read_state(scratch.path("pieces.h5")), read_state(scratch.path("once.h5")));
    CHECK(read_state(scratch.path("once.h5")).contacts.i.size() > 60);
}

TEST_CASE("a state that cannot be written is an error told when all have left", "[state][shares][bad-input]") {
    using M = scenes::SmoothDisks;
    const Scratch scratch;
    const auto scene = scenes::heap<M>(false);
    InProcess comm(2);
    Simulation<M> simulation(comm, scene.settings, scene.grains);
    simulation.step(by_nscdd<Dcs<M>>({}));
    FileSet files;
    CHECK_THROWS_WITH(write_state(simulation, state_head(simulation, request_of(scene.settings.walls.size())), files,
                                  scratch.path("none/state.h5"), 4),
                      Catch::Contains("none/state.h5: cannot write: the folder"));
}

TEST_CASE("a sum does not depend on the order of its numbers", "[shares]") {
    InProcess comm(1);
    std::mt19937 random(3);
    std::vector<double> numbers;
    for (int k = 0; k < 1000; ++k) numbers.push_back(std::ldexp(static_cast<double>(random()), -(k % 90)));
    const double sum = sum_in_any_order(comm, numbers);
    long double exact = 0;
    std::ranges::sort(numbers);
    for (const double x : numbers) exact += x;
    CHECK(sum == Approx(static_cast<double>(exact)).epsilon(1e-15));
    int plain_differs = 0;
    for (int k = 0; k < 20; ++k) {
        std::ranges::shuffle(numbers, random);
        CHECK(sum_in_any_order(comm, numbers) == sum);
        double plain = 0;
        for (const double x : numbers) plain += x;
        plain_differs += plain != sum;
    }
    CHECK(plain_differs > 0);
    CHECK(sum_in_any_order(comm, std::vector<double>{0.1, 0.2}) == 0.1 + 0.2);
    CHECK(sum_in_any_order(comm, std::vector{5e-324, 5e-324}) == 1e-323);
    CHECK(sum_in_any_order(comm, std::vector<double>{}) == 0);
    CHECK(std::isinf(sum_in_any_order(comm, std::vector{1.0, std::numeric_limits<double>::infinity()})));
}
