// Every partition: grid, bisection, METIS, and one that a stranger writes.
#include <map>
#include <set>

#include "../small_scenes.hpp"
#include "any_partition.hpp"
#include "scratch.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

constexpr double edge = 8;

template <class M>
struct Unnamed {
    int owner(const typename M::Vec&) const { return 0; }
    void visit_owners(const typename M::Vec&, double, auto&& visit) const { visit(0); }
};
struct Empty {};
static_assert(PartitionOf<detail::Grid<SmoothDisks>, SmoothDisks> && PartitionOf<Shells<SmoothDisks>, SmoothDisks>);
static_assert(PartitionOf<detail::Bisection<SmoothSpheres>, SmoothSpheres> &&
              PartitionOf<detail::CellTable<SmoothSpheres>, SmoothSpheres>);
static_assert(!PartitionOf<Unnamed<SmoothDisks>, SmoothDisks> && !PartitionOf<Empty, SmoothDisks>);

// Slabs of width 2 along the first axis, with a lapse.
enum class Lapse { none, owner_unvisited, neighbour_unvisited, twice, stranger_visited, counted_from_1 };
template <class M>
struct Slabs {
    int ranks;
    Lapse lapse;

    int owner(const typename M::Vec& x) const { return slab(x[0]) + (lapse == Lapse::counted_from_1); }
    void visit_owners(const typename M::Vec& x, double reach, auto&& visit) const {
        for (int k = slab(x[0] - reach); k <= slab(x[0] + reach); ++k) {
            if (lapse == (k == slab(x[0]) ? Lapse::owner_unvisited : Lapse::neighbour_unvisited)) continue;
            visit(lapse == Lapse::stranger_visited ? k + ranks : k);
            if (lapse == Lapse::twice) visit(k);
        }
    }
    std::string name() const { return "slabs"; }

  private:
    int slab(double x) const { return std::clamp(static_cast<int>(std::floor(x / 2)), 0, ranks - 1); }
};

// Grains that fill a corner of the box.
template <class M>
std::vector<Grain<M>> pile(Random& random) {
    return random_grains<M>(random, M::dim == 2 ? 120 : 250, M::dim == 2 ? 0.6 * edge : 0.45 * edge, 0.1, 0.15);
}

template <class M>
std::vector<Subdomain<M>> on_rank_0(const std::vector<Grain<M>>& grains, int ranks) {
    std::vector<Subdomain<M>> parts(static_cast<std::size_t>(ranks));
    for (int r = 0; r < ranks; ++r) parts[static_cast<std::size_t>(r)].rank = r;
    for (const auto& g : grains) {
        parts[0].grains.push_back(g);
        parts[0].replicas.push_back(0);
        parts[0].replica_begin.push_back(static_cast<int>(parts[0].replicas.size()));
    }
    return parts;
}

template <class M>
Partition<M> make(const Partitioner<M>& partitioner, const std::vector<Subdomain<M>>& parts, Communicator& comm,
                  double high = edge) {
    return partitioner.make({parts, comm, {M::Vec::Zero(), M::Vec::Constant(high)}, {}});
}

template <class M>
void check_owners(const Partition<M>& partition, int ranks, Random& random) {
    int twice = 0, missed = 0, none = 0;  // visits of one rank, owners that were not visited, ranks that are none
    for (int k = 0; k < 1000; ++k) {
        const typename M::Vec x =
            M::Vec::Constant(edge / 2) + random_vector<typename M::Vec>(random, 0.8 * edge);  // outside as well
        const double reach = uniform(random, 0, 0.5);
        std::set<int> visited;
        partition.visit_owners(x, reach, [&](int rank) {
            twice += !visited.insert(rank).second;
            none += rank < 0 || rank >= ranks;
        });
        missed += visited.count(partition.owner(x)) == 0;
        for (int n = 0; n < 10; ++n)
            missed += visited.count(partition.owner(x + random_vector<typename M::Vec>(random, reach))) == 0;
    }
    CHECK(twice == 0);
    CHECK(missed == 0);
    CHECK(none == 0);
}

}  // namespace

TEMPLATE_TEST_CASE("each partition has one owner for every point, and visits those near it", "[partition]", SmoothDisks,
                   SmoothSpheres) {
    using M = TestType;
    for (const int ranks : {1, 2, 3, 7, 8})
        for (const auto& partitioner : partitioners<M>(edge)) {
            INFO(partitioner.kind << ", ranks: " << ranks);
            Random random(31);
            InProcess comm(ranks);
            const auto parts = on_rank_0<M>(pile<M>(random), ranks);
            const Partition<M> partition = make(partitioner, parts, comm);
            check_owners(partition, ranks, random);
            if (!partitioner.restore) continue;
            const auto same = partitioner.restore(partition.numbers(), ranks);
            REQUIRE(same.has_value());
            CHECK(same->numbers() == partition.numbers());
            CHECK(same->name() == partition.name());
            for (int k = 0; k < 100; ++k) {
                const typename M::Vec x = random_vector<typename M::Vec>(random, edge);
                CHECK(same->owner(x) == partition.owner(x));
            }
        }
}

TEMPLATE_TEST_CASE("numbers that are no partition give none", "[partition]", SmoothDisks, SmoothSpheres) {
    using M = TestType;
    const int ranks = 4;
    Random random(32);
    InProcess comm(ranks);
    const auto parts = on_rank_0<M>(pile<M>(random), ranks);
    for (const auto& partitioner : partitioners<M>(edge)) {
        if (!partitioner.restore) continue;
        INFO(partitioner.kind);
        const Buffer numbers = make(partitioner, parts, comm).numbers();
        CHECK(partitioner.restore(numbers, ranks).has_value());
        CHECK(!partitioner.restore({}, ranks).has_value());
        for (const int other : {1, 3, 5}) CHECK(!partitioner.restore(numbers, other).has_value());
        for (const double bad : {double(NAN), double(INFINITY), -1.0, 1e300}) {
            Buffer spoilt = numbers;
            spoilt[0] = bad;
            CHECK(!partitioner.restore(spoilt, ranks).has_value());
        }
        Buffer shorter = numbers;
        shorter.pop_back();
        CHECK(!partitioner.restore(shorter, ranks).has_value());
    }
}

TEMPLATE_TEST_CASE("bisection and METIS divide a pile in a box half empty evenly", "[partition]", SmoothDisks,
                   SmoothSpheres) {
    using M = TestType;
    Random random(33);
    const auto grains = pile<M>(random);
    const auto walls = box_walls<M>(edge);
    const double skin = 0.1, largest = 0.15;
    for (const int ranks : {2, 3, 8}) {
        InProcess comm(ranks);
        std::vector<double> imbalance;
        for (const auto& partitioner : {by_grid<M>(), by_bisection<M>(), by_metis<M>()}) {
            auto parts = on_rank_0<M>(grains, ranks);
            for (int k = 0; k < 2; ++k)  // by grains, then by candidates
                detail::repartition<M>(parts, comm, make(partitioner, parts, comm), walls, skin, largest);
            imbalance.push_back(detail::measure_imbalance(parts, comm));
        }
        INFO("grid " << imbalance[0] << ", bisection " << imbalance[1] << ", METIS " << imbalance[2]);
        CHECK(imbalance[0] > 1.3);
        CHECK(imbalance[1] < 1.05);
        CHECK(imbalance[2] < 1.15);
    }
}

TEMPLATE_TEST_CASE("bisection and METIS divide a pile evenly when one grain is far away", "[partition]", SmoothDisks,
                   SmoothSpheres) {
    using M = TestType;
    Random random(33);
    auto grains = pile<M>(random);
    const double far = 100 * edge, skin = 0.1, largest = 0.15;
    grains.push_back(grains.front());
    grains.back().id = static_cast<int>(grains.size()) - 1;
    grains.back().position = M::Vec::Constant(far);
    const auto walls = box_walls<M>(edge);
    for (const int ranks : {2, 8}) {
        InProcess comm(ranks);
        for (const auto& partitioner : {by_bisection<M>(), by_metis<M>()}) {
            auto parts = on_rank_0<M>(grains, ranks);
            for (int k = 0; k < 2; ++k)  // by grains, then by candidates
                detail::repartition<M>(parts, comm, make(partitioner, parts, comm, far), walls, skin, largest);
            INFO(partitioner.kind << " on " << ranks << " ranks");
            CHECK(detail::measure_imbalance(parts, comm) < 1.15);
        }
    }
}

namespace {

template <class M>
std::size_t shared_grains(const std::vector<Subdomain<M>>& parts) {
    std::size_t count = 0;
    for (const auto& part : parts)
        for (std::size_t g = 0; g < part.grains.size(); ++g)
            count += part.primary(g) && part.last_replica(g) - part.first_replica(g) > 1;
    return count;
}

}  // namespace

TEMPLATE_TEST_CASE("METIS and bisection share few grains where ranks have few, first without contacts, then with",
                   "[partition]", SmoothDisks, SmoothSpheres) {
    using M = TestType;
    const int side = M::dim == 2 ? 30 : 10;
    Random random(35);
    const auto grains = shaken_lattice<M>(random, side);
    const typename PartitionInput<M>::Box box{M::Vec::Zero(), M::Vec::Constant(1.05 * side)};
    for (const int ranks : {8, 48}) {
        InProcess comm(ranks);
        std::vector<std::vector<std::size_t>> shared;
        for (const auto& partitioner : {by_grid<M>(), by_bisection<M>(), by_metis<M>()}) {
            auto parts = on_rank_0<M>(grains, ranks);
            auto& counts = shared.emplace_back();
            for (int k = 0; k < 2; ++k) {
                detail::repartition<M>(parts, comm, partitioner.make({parts, comm, box, {}}), box_walls<M>(1.05 * side),
                                       0.3, 0.5);
                counts.push_back(shared_grains(parts));
            }
        }
        INFO(ranks << " ranks, " << grains.size() << " grains, first and then: grid " << shared[0][0] << ", "
                   << shared[0][1] << ", bisection " << shared[1][0] << ", " << shared[1][1] << ", METIS "
                   << shared[2][0] << ", " << shared[2][1]);
        CHECK(shared[0][0] > 0);
        for (const std::size_t k : {1, 2})
            for (const std::size_t when : {0, 1}) CHECK(2 * shared[k][when] < 3 * shared[0][when]);
    }
}

TEMPLATE_TEST_CASE("bisection finds the middle of few and of equal points", "[partition]", SmoothDisks, SmoothSpheres) {
    using M = TestType;
    for (const int ranks : {2, 3, 5, 8}) {
        InProcess comm(ranks);
        std::vector<Grain<M>> grains;  // a row: the others have nothing to be cut by
        for (int k = 0; k < 4 * ranks; ++k)
            grains.push_back(make_grain<M>(k, 0.1, 1.0, (1.0 + k / 4) * M::Vec::UnitX()));  // four at each place
        const auto parts = on_rank_0<M>(grains, ranks);
        const Partition<M> partition = make(by_bisection<M>(), parts, comm);
        std::vector<int> count(static_cast<std::size_t>(ranks));
        for (const auto& g : grains) ++count[static_cast<std::size_t>(partition.owner(g.position))];
        CHECK(count == std::vector<int>(static_cast<std::size_t>(ranks), 4));
        CHECK_NOTHROW(make(by_bisection<M>(), on_rank_0<M>({grains[0]}, ranks), comm));
        CHECK_NOTHROW(make(by_metis<M>(), on_rank_0<M>({grains[0]}, ranks), comm));
    }
}

TEMPLATE_TEST_CASE("a partition is made anew when it has become uneven, and not again and again", "[partition]",
                   SmoothDisks) {
    using M = TestType;
    // a row of grains, half of which flies away from the other: candidates of the resting half alone remain
    SimulationSettings<M> settings{.materials = smooth<M>()};
    settings.h = 0.01;
    settings.broad_phase_every = 1;
    settings.partition = by_bisection<M>(1.2);
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 64; ++k) {
        grains.push_back(make_grain<M>(k, 0.5, 1.0, {1.0 * k, 0.0}));
        if (k >= 32) grains.back().velocity[0] = 30.0 * (k - 31);
    }
    InProcess comm(4);
    Simulation<M> simulation(comm, settings, grains);
    const auto solve = by_nscdd<Dcs<M>>(SolveOptions{});
    std::vector<Buffer> made{simulation.broad_phase().partition().numbers()};
    for (int step = 0; step < 30; ++step) {
        simulation.step(solve);
        if (simulation.broad_phase().partition().numbers() != made.back())
            made.push_back(simulation.broad_phase().partition().numbers());
    }
    CHECK(made.size() >= 2);
    CHECK(made.size() <= 6);  // of 30 broad phases
    CHECK(detail::measure_imbalance(simulation.parts(), comm) < 1.3);
}

TEMPLATE_TEST_CASE("grains with one id are refused wherever they are, and a scene without grains", "[partition]",
                   SmoothDisks) {
    using M = TestType;
    InProcess comm(3);
    const auto grain = [](int id, double x) { return make_grain<M>(id, 0.5, 1.0, {x, 0.0}); };
    const auto refused = [&](const std::vector<Grain<M>>& grains) {
        return complaint<std::invalid_argument>([&] { Simulation<M>(comm, {.h = 1e-3}, grains); });
    };
    CHECK(refused({grain(0, 0), grain(5, 40), grain(1, 10)}) == "");
    CHECK(refused({grain(5, 0), grain(1, 10), grain(5, 40)}) == "grain 5: there are two of this id");
    CHECK(refused({}) == "the scene has no grains");
}

TEMPLATE_TEST_CASE("a partition that would lose a grain is refused, and names it", "[partition]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    std::vector<Grain<M>> grains;  // a row, from the second slab into the third
    for (int k = 0; k < 4; ++k) grains.push_back(make_grain<M>(k, 0.5, 1.0, (3.5 + k) * M::Vec::UnitX()));
    Lapse lapse = Lapse::none;
    SimulationSettings<M> settings{.materials = smooth<M>(), .h = 0.01, .broad_phase_every = 0};
    settings.partition = {.kind = "slabs", .make = [&lapse](const PartitionInput<M>& scene) {
                              return Slabs<M>{scene.comm.size(), lapse};
                          }};
    const int threads = GENERATE(1, 3);
    for (const auto& [which, said] : std::map<Lapse, std::string>{
             {Lapse::owner_unvisited, "grain 0: the partition `slabs` does not visit rank 1"},
             {Lapse::neighbour_unvisited, "grain 0: the partition `slabs` does not visit rank 2"},
             {Lapse::twice, "grain 0: the partition `slabs` visits rank 1 twice"},
             {Lapse::stranger_visited, "grain 0: the partition `slabs` visits rank 4 of 3"},
             {Lapse::counted_from_1, "grain 0: the partition `slabs` gives a point within reach to rank 3 of 3"},
         }) {
        InProcess comm(3, threads);
        lapse = Lapse::none;
        Simulation<M> simulation(comm, settings, grains);
        CHECK(gather_grains(simulation).size() == 4);
        lapse = which;
        const auto refused = [&](auto&& call) { return complaint<std::invalid_argument>(call).substr(0, said.size()); };
        CHECK(refused([&] { Simulation<M>(comm, settings, grains); }) == said);
        // found by the rank that has the grain then
        CHECK(refused([&] { simulation.step(by_nscdd<Dcs<M>>({})); }) == said);
    }
}

TEMPLATE_TEST_CASE("a partition that cannot be even is not made anew at every detection", "[partition]", SmoothDisks) {
    using M = TestType;
    // five pairs at rest on four ranks: one rank has two, 1.6 times the mean, whatever the cuts
    SimulationSettings<M> settings{.materials = smooth<M>()};
    settings.h = 0.01;
    settings.broad_phase_every = 1;
    settings.partition = by_bisection<M>(1.2);
    int made = 0;
    settings.partition.make = [&made, make = settings.partition.make](const PartitionInput<M>& scene) {
        ++made;
        return make(scene);
    };
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 10; ++k) grains.push_back(make_grain<M>(k, 0.5, 1.0, {1.0 * (k % 2), 4.0 * (k / 2)}));
    InProcess comm(4);
    Simulation<M> simulation(comm, settings, grains);
    const auto solve = by_nscdd<Dcs<M>>(SolveOptions{});
    for (int step = 0; step < 20; ++step) simulation.step(solve);
    CHECK(detail::measure_imbalance(simulation.parts(), comm) > 1.2);
    CHECK(made <= 3);  // of grains, of candidates, and once more at most; not at each of 20 detections
}
