// One rank per process against all ranks in one process: the same numbers to the last bit.
#include <functional>
#include <map>
#include <set>

#include "../catch.hpp"
#include "../small_scenes.hpp"
#include "../unit/described_scenes.hpp"
#include "nscdd/comm/mpi.hpp"
#include "nscdd/partition/metis.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace scenes;

namespace {

// What the run in process leaves, which is the same on every process; ranks 0: one a process. Several have two threads.
template <template <class, class> class Scheme, class Gluing, class M>
Outcome<M> compare_bits(const Scene<M>& scene, int steps, const SolveOptions& options, int ranks = 0) {
    Mpi comm(MPI_COMM_WORLD, {}, ranks, WithinNode::memory, ranks == 0 ? 1 : 2);
    using Chosen = Scheme<M, Gluing>;
    INFO(scene.name << ", " << Chosen::name << ", " << Chosen::interface_name);
    const auto ours = run(scene, comm, steps, by_nscdd<Chosen>(options));
    const auto theirs = run_nscdd<Scheme, Gluing>(scene, comm.size(), steps, options);

    CHECK(ours.iterations() == theirs.iterations());
    CHECK(first_difference(ours.history(), theirs.history()) == -1);
    if (comm.ranks()[0] == 0)
        CHECK(first_difference(ours.state(), theirs.state()) == -1);
    else
        CHECK(ours.state().empty());

    double sent[] = {ours.traffic.messages, ours.traffic.bytes};
    MPI_Allreduce(MPI_IN_PLACE, sent, 2, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    CHECK(sent[0] == theirs.traffic.messages);
    CHECK(sent[1] == theirs.traffic.bytes);
    return theirs;
}

template <template <class, class> class Scheme, class Gluing, class M>
void compare(const Scene<M>& scene, const SolveOptions& options = {.check_every = 3}, int ranks = 0,
             double least_contacts = 60) {
    const auto theirs = compare_bits<Scheme, Gluing>(scene, 5, options, ranks);  // steps with a broad phase
    CHECK(theirs.last().contacts > least_contacts);
    if (std::max(ranks, Mpi().size()) > 1) CHECK(theirs.last().interface_grains > 0);
}

// By DCS, to the tolerance and with the answer that test_any_ranks asks of runs in process.
template <class M>
Outcome<M> compare_described(const char* name, const test::Described<M>& described, int ranks = 0) {
    Scene<M> scene{name, described.settings, described.grains, {}};
    const SolveOptions options = SolveOptions{.tolerance = 1e-8}.accelerated();
    const auto theirs = compare_bits<Dcs, ClosedForm>(scene, described.steps, options, ranks);
    scene.settings.partition = by_grid<M>();
    const auto reference = run_nlgs(scene, described.steps, options);
    double worst = 0;
    for (std::size_t g = 0; g < scene.grains.size(); ++g)
        worst = std::max(worst, (theirs.grains[g].grain.velocity - reference.grains[g].grain.velocity).norm());
    CHECK(worst < 1e-5);
    return theirs;
}

std::string error_of(auto&& call) {
    try {
        call();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "nothing was thrown";
}

}  // namespace

TEMPLATE_TEST_CASE("a run over MPI is the run in process, bit for bit", "", SmoothDisks, Spheres) {
    for (const auto& scene : dense_scenes<TestType>()) {
        compare<Ccs, Factorised<>>(scene);
        compare<Ccs, ClosedForm>(scene);
        compare<Dcs, ClosedForm>(scene);
        compare<Dcs, Factorised<>>(scene);
        compare<Dcs, ClosedForm>(scene, SolveOptions{.check_every = 3, .sweeps = 2}.accelerated());
    }
}

TEMPLATE_TEST_CASE("a run over MPI in a cell that repeats is the run in process", "", SmoothDisks, Spheres) {
    auto scene = repeating_cell<TestType>();
    for (auto& grain : scene.grains) grain.velocity += 0.5 * grain.load;  // they meet
    for (const auto& partitioner : {by_grid<TestType>(), by_bisection<TestType>(1.0), by_metis<TestType>(1.0)}) {
        scene.settings.partition = partitioner;
        scene.settings.broad_phase_every = 2;
        compare<Dcs, ClosedForm>(scene, {.check_every = 3}, 0, 20);
    }
    if constexpr (TestType::friction) {
        CHECK(compare_bits<Dcs, ClosedForm>(flowing_cell<TestType>(), 20, {.check_every = 3}).last().contacts > 20);
        CHECK(compare_bits<Dcs, ClosedForm>(pressed_cell<TestType>(), 90, {}).last().contacts > 60);
    }
}

TEST_CASE("a run over MPI is the run in process with any partition") {
    for (const auto& partitioner : {by_bisection<Spheres>(1.0), by_metis<Spheres>(1.0)}) {
        auto scene = dense_scenes<Spheres>()[1];  // the box: METIS divides the heap so that no grain is shared
        scene.settings.partition = partitioner;
        scene.settings.broad_phase_every = 2;
        compare<Dcs, ClosedForm>(scene);
    }
}

TEST_CASE("several subdomains a process are those in process, bit for bit") {
    const int processes = Mpi().size();
    for (const int ranks : {processes + 1, 2 * processes + 1}) {
        auto scene = dense_scenes<Spheres>().front();
        scene.settings.broad_phase_every = 2;
        compare<Dcs, ClosedForm>(scene, SolveOptions{.check_every = 3}.accelerated(), ranks);
        compare<Ccs, Factorised<>>(scene, {.check_every = 3}, ranks);
        scene = dense_scenes<Spheres>()[1];
        scene.settings.broad_phase_every = 2;
        scene.settings.partition = by_metis<Spheres>(1.0);
        compare<Dcs, ClosedForm>(scene, {.check_every = 3}, ranks);
    }
}

namespace {
struct Forgetful {  // leaves out the owner of all but the first cell
    int owner(const Disks::Vec& x) const { return static_cast<int>(x[0]); }
    void visit_owners(const Disks::Vec& x, double, auto&& visit) const {
        if (x[0] < 1) visit(0);
    }
    const char* name() const { return "forgetful"; }
};
}  // namespace

TEST_CASE("a partition that loses the grain of one rank is refused on every rank") {
    using M = Disks;
    Mpi comm;
    SimulationSettings<M> settings{.materials = smooth<M>(), .h = 1e-3};
    settings.partition = {.kind = "forgetful", .make = [](const auto&) { return Forgetful{}; }};
    const std::vector<Grain<M>> mine{make_grain<M>(comm.ranks()[0], 0.1, 1.0, {comm.ranks()[0] + 0.5, 0.0})};
    std::string said;
    try {
        Simulation<M>(comm, settings, mine);
    } catch (const std::invalid_argument& error) {
        said = error.what();
    }
    const std::string lost =
        "grain 1: the partition `forgetful` does not visit rank 1, which owns a point within reach";
    CHECK(said == (comm.size() > 1 ? lost : ""));
    MPI_Barrier(MPI_COMM_WORLD);
}

TEST_CASE("two grains of one id, each of another rank, are refused on every rank") {
    using M = Disks;
    Mpi comm;
    const std::vector<Grain<M>> mine{make_grain<M>(7, 0.5, 1.0, {2.0 * comm.ranks()[0], 0.0})};
    std::string said;
    try {
        Simulation<M>(comm, {.materials = smooth<M>(), .h = 1e-3}, mine);
    } catch (const std::invalid_argument& error) {
        said = error.what();
    }
    CHECK(said == (comm.size() > 1 ? "grain 7: there are two of this id" : ""));
    MPI_Barrier(MPI_COMM_WORLD);
}

TEST_CASE("an error in one subdomain is thrown on every rank, with the same words") {
    auto scene = heap<Disks>(true);
    scene.grains[0].position[0] = scene.grains[1].position[0] - 0.8 * scene.grains[1].radius;
    Mpi comm;
    const std::string ours = error_of([&] { run(scene, comm, 1, by_nscdd<Dcs<Disks>>({})); });
    const std::string theirs = error_of([&] { run_nscdd<Dcs, ClosedForm>(scene, comm.size(), 1, {}); });
    CHECK(ours == theirs);
    INFO(ours);
    CHECK(ours.starts_with("step 1: grain 0 and grain 1 overlap by"));
    MPI_Barrier(MPI_COMM_WORLD);  // nobody was left behind in a call
}

TEST_CASE("a residual that is not finite is an error on every rank") {
    auto scene = settled(heap<Disks>(true), 200);
    for (auto& pair : scene.impulses) pair.r *= 1e300;
    Mpi comm;
    const std::string said = error_of([&] { run(scene, comm, 1, by_nscdd<Dcs<Disks>>({.check_every = 1})); });
    INFO(said);
    CHECK(said.starts_with("the residual is not finite"));
    MPI_Barrier(MPI_COMM_WORLD);
}

TEMPLATE_TEST_CASE("one grain, over MPI", "[any_ranks]", SmoothDisks, Spheres) {
    auto described = test::one_grain<TestType>();
    for (const auto& partitioner : test::partitioners<TestType>(described.edge)) {
        INFO(partitioner.kind);
        described.settings.partition = partitioner;
        const auto left = compare_described("one grain", described);
        CHECK(left.last().contacts == 1);
    }
}

TEMPLATE_TEST_CASE("a grain crosses several subdomains in a step, over MPI", "[any_ranks]", SmoothDisks, Spheres) {
    auto described = test::crossing_grain<TestType>();
    int before = 0, farthest = 0;
    for (described.steps = 1; described.steps <= 5; ++described.steps) {
        const auto left = compare_described("a fast grain", described, 8);
        farthest = std::max(farthest, std::abs(left.grains[0].subdomain - before));
        before = left.grains[0].subdomain;
    }
    CHECK(farthest >= 2);
}

TEMPLATE_TEST_CASE("METIS deals parts that are not connected, over MPI", "[any_ranks]", SmoothDisks, Spheres) {
    using M = TestType;
    auto described = test::clumps<M>(2 * Mpi().size() + 1);
    described.settings.partition = by_metis<M>(1.0);
    std::map<int, std::set<int>> clumps_of;
    for (const auto& g : compare_described("clumps", described).grains)
        clumps_of[g.subdomain].insert(test::clump_at<M>(g.grain.position));
    CHECK(std::ranges::any_of(clumps_of, [](const auto& entry) { return entry.second.size() > 1; }));
}
