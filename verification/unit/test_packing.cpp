// Packings, states and reports on disk: they come back as they went, and damage is named.
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "../catch.hpp"
#include "files/packing.hpp"
#include "files/replace_file.hpp"
#include "files/report_json.hpp"
#include "made_up_state.hpp"
#include "scratch.hpp"

using namespace nscdd;
using nscdd::test::check_equal;
using nscdd::test::complaint;
using nscdd::test::made_up_state;
using nscdd::test::Scratch;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

Packing two_spheres() { return {.dim = 3, .x = {1, 1, 1, 3, 1, 1}, .radius = {1, 0.5}, .box = {4, 2, 2}}; }

// A disk that is full after `bytes`, as far as this process can tell.
class FullDisk {
  public:
    explicit FullDisk(rlim_t bytes) {
        getrlimit(RLIMIT_FSIZE, &old_);
        handler_ = std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{bytes, old_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FullDisk() {
        setrlimit(RLIMIT_FSIZE, &old_);
        std::signal(SIGXFSZ, handler_);
    }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

  private:
    rlimit old_{};
    void (*handler_)(int);
};

}  // namespace

TEST_CASE("a packing comes back as it went", "[packing]") {
    const Scratch scratch;
    const std::string path = scratch.path("two.h5");
    write_packing(path, two_spheres(), {{"source", "by hand"}, {"seed", "7"}});
    const Packing packing = read_packing(path);
    CHECK(packing.dim == 3);
    CHECK(packing.x == two_spheres().x);
    CHECK(packing.radius == two_spheres().radius);
    CHECK(packing.box == two_spheres().box);

    const hdf5::Reader file(path);
    CHECK(file.attribute<std::string>("source") == "by hand");
    CHECK(file.attribute<std::int64_t>("dim") == 3);
    CHECK_FALSE(scratch.has("two.h5.part"));
}

TEST_CASE("a state comes back as it went, small or deflated, in 2D and 3D", "[packing][state]") {
    const Scratch scratch;
    const int dim = GENERATE(2, 3);
    const int grains = GENERATE(2, 20000);
    const State state = made_up_state(dim, grains);
    write_state(scratch.path("end.h5"), state);
    check_equal(read_state(scratch.path("end.h5")), state);
    CHECK(read_packing(scratch.path("end.h5")).x == state.packing.x);

    const std::string xdmf = scratch.read("end.xdmf");
    CHECK_THAT(xdmf, Catch::Contains(">end.h5:/x<") && Catch::Contains("drop &amp; &lt;roll> \xc3\xa9"));
    CHECK_THAT(xdmf, Catch::Contains("Name=\"velocity\" AttributeType=\"Vector\"") &&
                         Catch::Contains(dim == 3 ? ">end.h5:/velocity<" : ">end.h5:/paraview/velocity<"));
}

TEST_CASE("a state may have no walls and no contacts", "[packing][state]") {
    const Scratch scratch;
    State state = made_up_state(2, 2);
    state.walls = {};
    state.contacts = {};
    state.broad_phase.offset = {};
    write_state(scratch.path("free.h5"), state);
    check_equal(read_state(scratch.path("free.h5")), state);
}

TEST_CASE("a bad packing is refused in one line that names the dataset", "[packing][bad-input]") {
    struct Bad {
        Packing packing;
        std::string problem;
    };
    const std::vector<Bad> cases{
        {{3, {0, not_a_number, 0, 1, 1, 1}, {1, 1}, {4, 4, 4}}, "dataset 'x': row 0 is not finite, found nan"},
        {{3, {0, 0, 0, 1, 1, 1}, {1, 0}, {4, 4, 4}}, "dataset 'radius': row 1 must be > 0, found 0"},
        {{3, {0, 0, 0}, {1}, {4, -4, 4}}, "dataset 'box': row 1 must be > 0, found -4"},
        {{3, {}, {}, {4, 4, 4}}, "dataset 'x': is empty: a packing needs at least one grain"},
        {{4, {0, 0, 0, 0}, {1}, {4, 4, 4, 4}}, "dataset 'x': must have shape (n, 2) or (n, 3), found (1, 4)"},
    };
    const Scratch scratch;
    const std::string path = scratch.path("bad.h5");
    for (const Bad& bad : cases) {
        write_packing(path, bad.packing);
        CHECK(complaint<InputError>([&] { read_packing(path); }) == path + ": " + bad.problem);
    }

    const auto refused = [&](auto&& fill) {
        hdf5::Writer file(path);
        fill(file);
        file.save();
        return complaint<InputError>([&] { read_packing(path); }).substr(path.size());
    };
    CHECK(refused([](hdf5::Writer&) {}) == ": dataset 'x': is missing");
    CHECK(refused([](auto& f) { f.write("x/in", std::vector<int>{1}, {1}); }) == ": dataset 'x': is missing");
    CHECK(refused([](auto& f) {
              f.write("x", std::vector<double>{1, 2}, {2});
          }) == ": dataset 'x': must have shape (n, 2) or (n, 3), found (2)");
    CHECK(refused([](auto& f) {
              f.write("x", std::vector<double>{1, 2}, {1, 2});
              f.write("radius", std::vector<double>{1, 2}, {2});
          }) == ": dataset 'radius': must have shape (1), found (2)");
}

TEST_CASE("a bad state is refused in one line that names the dataset", "[packing][state][bad-input]") {
    const Scratch scratch;
    const std::string path = scratch.path("bad.h5");
    State state = made_up_state(2, 2);
    state.contacts.j[1] = -3;
    write_state(path, state);
    CHECK_THROWS_WITH(read_state(path), path + ": dataset 'contacts/j': row 1 must lie in [-2, 1], found -3");

    write_packing(path, state.packing);
    CHECK_THROWS_WITH(read_state(path), path + ": dataset 'velocity': is missing");

    hdf5::Writer file(path);
    write_packing(file, state.packing);
    file.write("velocity", state.velocity, {2, 2});
    file.write("spin", state.spin, {2, 1});
    file.write("material", std::vector<double>{0, 0.5}, {2});
    file.save();
    CHECK_THROWS_WITH(read_state(path), path + ": dataset 'material': must hold integers");

    state.velocity.pop_back();
    CHECK_THROWS_AS(write_state(path, state), OutputError);
    CHECK_THROWS_AS(write_state(scratch.path("end.xdmf"), made_up_state(2, 2)), OutputError);
}

TEST_CASE("a dataset that declares far more than is stored is refused, not made room for", "[packing][bad-input]") {
    const Scratch scratch;
    const std::string path = scratch.path("vast.h5");
    const auto declared = [&](const hdf5::Shape& shape, const hdf5::Shape& chunk) {
        const hdf5::Shape unlimited(shape.size(), H5S_UNLIMITED);  // else no chunk may be larger than the dataset
        const hdf5::Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose),
            creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose),
            space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), unlimited.data()), H5Sclose);
        H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
        const hdf5::Handle made(H5Dcreate2(file, "x", H5T_NATIVE_FLOAT, space, H5P_DEFAULT, creation, H5P_DEFAULT),
                                H5Dclose);
        REQUIRE(made.valid());
    };
    declared({1u << 30, 3}, {1024, 3});
    CHECK_THROWS_WITH(read_packing(path),
                      path + ": dataset 'x': declares shape (1073741824, 3), but only 0 bytes are stored");
    declared({4, 3}, {1u << 28, 3});  // one chunk of 3 GB
    CHECK_THROWS_WITH(read_packing(path), path + ": dataset 'x': declares shape (4, 3), but only 0 bytes are stored");
    declared({4, 3}, {4, 3});  // never written, but small: zeros
    CHECK_THROWS_WITH(read_packing(path), path + ": dataset 'radius': is missing");
}

TEST_CASE("a file that is missing, not HDF5 or cut short is named", "[packing][bad-input]") {
    const Scratch scratch;
    const std::string path = scratch.path("cut.h5");
    const auto complaint_about = [](const std::string& file) {
        return complaint<InputError>([&] { read_packing(file); }).substr(file.size());
    };
    CHECK(complaint_about(scratch.path("none.h5")) == ": cannot open: No such file or directory");
    CHECK(complaint_about(scratch.path("")) == ": is a folder, not a file");
    CHECK(complaint_about(scratch.write("text.h5", "x y z r\n")) == ": is not an HDF5 file");
    CHECK(complaint_about(scratch.write("empty.h5", "")) == ": is not an HDF5 file");

    write_state(path, made_up_state(3, 20000));
    std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
    CHECK(complaint_about(path) == ": is a truncated or damaged HDF5 file");
    CHECK_THROWS_AS(read_state(path), InputError);
}

TEST_CASE("an interrupted write leaves the old file and no part of the new one", "[packing]") {
    const Scratch scratch;
    const std::string path = scratch.path("end.h5");
    write_packing(path, two_spheres());
    const std::string before = scratch.read("end.h5");

    std::string line;
    {
        const FullDisk full(4096);
        line = complaint<OutputError>([&] { write_state(path, made_up_state(3, 20000)); });
    }
    CHECK(line == path + ": cannot write: File too large");
    CHECK(scratch.read("end.h5") == before);
    CHECK(scratch.files() == std::vector<std::string>{"end.h5"});

    CHECK_THROWS_WITH(replace_file(scratch.path("no/folder"), "text"),
                      Catch::Contains("no/folder: cannot write: the folder ") && Catch::Contains("does not exist"));
    std::filesystem::create_directory(scratch.path("folder"));
    CHECK_THROWS_WITH(replace_file(scratch.path("folder"), "text"),
                      Catch::Contains("is a folder, only regular files are replaced"));
}

TEST_CASE("files of a set take their places together or not at all", "[files]") {
    const Scratch scratch;
    scratch.write("a", "old a");
    {
        FileSet files;
        files.add(scratch.path("a"), "new a");
        files.add(scratch.path("b"), "new b");
        CHECK(scratch.read("a") == "old a");
        CHECK_FALSE(scratch.has("b"));
        CHECK_THROWS_AS(files.add(scratch.path("none/c"), "new c"), OutputError);
    }
    CHECK(scratch.files() == std::vector<std::string>{"a"});
    FileSet files, others;  // of two runs
    files.add(scratch.path("a"), "ours");
    others.add(scratch.path("a"), "theirs");
    others.commit();
    CHECK(scratch.read("a") == "theirs");
    files.commit();
    CHECK(scratch.read("a") == "ours");
    CHECK(scratch.files() == std::vector<std::string>{"a"});
}

TEST_CASE("a file that is written on is whole in its place all the while", "[files]") {
    const Scratch scratch;
    const std::string path = scratch.path("a.h5");
    scratch.write("a.h5", "old");
    const auto more = [&path](FileSet& files, int number) {
        hdf5::Writer file(files, path);
        file.write("part" + std::to_string(number), std::vector<int>(20'000, number), {20'000});
        file.save();
        files.place(path, &file.written());
    };
    const auto numbers = [](const std::string& name) {
        const hdf5::Reader file(name);
        int found = 0;
        while (file.has("part" + std::to_string(found))) {
            CHECK(file.read<int>("part" + std::to_string(found), {20'000}) == std::vector<int>(20'000, found));
            ++found;
        }
        return found;
    };
    {
        FileSet files;
        files.begin(path);
        std::filesystem::remove(files.part(path));
    }
    CHECK(scratch.read("a.h5") == "old");
    {
        FileSet files;
        std::unique_ptr<hdf5::Reader> reader;
        hdf5::Writer(files, path).save();
        for (int k = 0; k < 12; ++k) {
            more(files, k);
            CHECK(numbers(path) == k + 1);
            CHECK(std::filesystem::file_size(files.part(path)) == std::filesystem::file_size(path));
            if (k == 4) std::filesystem::rename(path, scratch.path("kept"));  // what others do with it is theirs
            if (k == 6) scratch.write("a.h5", "another");
            if (k == 8) reader = std::make_unique<hdf5::Reader>(path);  // and reads on while it is written on
            if (reader) CHECK(reader->read<int>("part8", {20'000}) == std::vector<int>(20'000, 8));
        }
        CHECK(numbers(scratch.path("kept")) == 5);
    }
    CHECK(numbers(path) == 12);
    CHECK(scratch.files() == std::vector<std::string>{"a.h5", "kept"});
}

TEST_CASE("checksums are those of FNV-1a", "[files]") {
    CHECK(checksum("") == "cbf29ce484222325");
    CHECK(checksum("foobar") == "85944171f73967e8");
}

TEST_CASE("a report says where it comes from", "[report]") {
    const Scratch scratch;
    const std::vector<const char*> arguments{"/some/where/nscdd", "run", "my case.toml", "--note", "it's", ""};
    const Provenance origin = provenance(static_cast<int>(arguments.size()), arguments.data());
    CHECK(origin.command == R"(nscdd run 'my case.toml' --note 'it'\''s' '')");
    CHECK(origin.machine.cores >= 1);
    CHECK_FALSE(origin.machine.cpu.empty());
    CHECK(origin.date.size() == std::string("2026-01-31T12:00:00Z").size());

    nlohmann::json report = origin;
    report["residual"] = {1e-5, not_a_number};
    write_json(scratch.path("run.json"), report);
    const auto back = nlohmann::json::parse(scratch.read("run.json"));
    CHECK(back["machine"]["compiler"] == origin.machine.compiler);
    CHECK(back["commit"] == origin.commit);
    CHECK(back["residual"][0] == 1e-5);
    CHECK(back["residual"][1].is_null());
}
