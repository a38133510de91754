// How contacts are dealt to subdomains, grains copied, masses split, and impulses carried along.
#include <map>
#include <set>
#include <tuple>

#include "random_scenes.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

using Pair = std::pair<int, int>;  // ids, j < 0: wall -1-j

template <class M>
std::vector<Pair> candidates(const Subdomain<M>& part) {
    std::vector<Pair> pairs;
    const auto id = [&](int g) { return part.grains[static_cast<std::size_t>(g)].id; };
    for (const auto& c : part.pairs) pairs.emplace_back(id(c.i), id(c.j));
    for (const auto& c : part.wall_pairs) pairs.emplace_back(id(c.i), -1 - c.j);
    return pairs;
}

template <class M>
std::vector<Pair> contacts(const Subdomain<M>& part) {
    std::vector<Pair> pairs;
    const auto id = [&](int g) { return part.grains[static_cast<std::size_t>(g)].id; };
    for (const auto& c : part.problem.contacts) pairs.emplace_back(id(c.i), id(c.j));
    for (const auto& c : part.problem.wall_contacts) pairs.emplace_back(id(c.i), -1 - c.j);
    return pairs;
}

// Of all subdomains, sorted; a pair that is in two of them is there twice.
template <class M>
std::vector<Pair> of_all(const std::vector<Subdomain<M>>& parts, auto&& pairs_of) {
    std::vector<Pair> all;
    for (const auto& part : parts) {
        const std::vector<Pair> pairs = pairs_of(part);
        all.insert(all.end(), pairs.begin(), pairs.end());
    }
    std::sort(all.begin(), all.end());
    return all;
}

// All that is closer than the skin, by looking at everything.
template <class M>
std::vector<Pair> brute_force(const std::vector<Grain<M>>& grains, const std::vector<Wall<M>>& walls, double skin) {
    std::vector<Pair> pairs;
    for (const auto& a : grains) {
        for (const auto& b : grains)
            if (a.id < b.id && (a.position - b.position).norm() - a.radius - b.radius < skin)
                pairs.emplace_back(a.id, b.id);
        for (std::size_t w = 0; w < walls.size(); ++w)
            if (walls[w].normal.dot(a.position) - walls[w].offset - a.radius < skin)
                pairs.emplace_back(a.id, -1 - static_cast<int>(w));
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

// Subdomains as a driver starts with them: the grains dealt out in turn, whatever their place.
template <class M>
std::vector<Subdomain<M>> dealt_in_turn(const std::vector<Grain<M>>& grains, int ranks) {
    std::vector<Subdomain<M>> parts(static_cast<std::size_t>(ranks));
    for (int r = 0; r < ranks; ++r) parts[static_cast<std::size_t>(r)].rank = r;
    for (std::size_t k = 0; k < grains.size(); ++k) {
        Subdomain<M>& part = parts[k % parts.size()];
        part.grains.push_back(grains[k]);
        part.replicas.push_back(part.rank);
        part.replica_begin.push_back(static_cast<int>(part.replicas.size()));
    }
    return parts;
}

template <class M>
detail::Grid<M> grid_of(int ranks, double edge) {
    const typename M::Vec extent = M::Vec::Constant(edge);
    return detail::Grid<M>(detail::choose_cells<M>(ranks, extent), M::Vec::Zero(), extent);
}

template <class M>
using Carried = std::vector<std::tuple<int, int, std::vector<double>>>;

template <class M>
Carried<M> impulses(const std::vector<Subdomain<M>>& parts) {
    Carried<M> all;
    for (const auto& part : parts)
        detail::visit_impulses(part, [&](const auto&, const PairImpulse<M>& p) {
            all.emplace_back(p.i, p.j, std::vector<double>(p.r.data(), p.r.data() + p.r.size()));
        });
    std::sort(all.begin(), all.end());
    return all;
}

// Grains of very unlike sizes, and clusters of them: 20 to 1.
template <class M>
std::vector<Grain<M>> unlike_grains(Random& random, double edge) {
    auto grains = random_grains<M>(random, 8, edge, 0.9, 1.0);
    for (auto& g : random_grains<M>(random, 400, edge, 0.05, 0.1)) {
        g.id = static_cast<int>(grains.size());
        const auto meets = [&](const Grain<M>& other) {
            return (other.position - g.position).norm() < other.radius + g.radius;
        };
        if (std::none_of(grains.begin(), grains.end(), meets)) grains.push_back(g);
    }
    return grains;
}

}  // namespace

TEST_CASE("as many cells as ranks, near to cubes", "[partition]") {
    const Eigen::Vector3d cube(1, 1, 1);
    CHECK(detail::choose_cells<SmoothSpheres>(1, cube) == detail::GridCells<3>{1, 1, 1});
    CHECK(detail::choose_cells<SmoothSpheres>(3, cube) == detail::GridCells<3>{3, 1, 1});
    CHECK(detail::choose_cells<SmoothSpheres>(4, cube) == detail::GridCells<3>{2, 2, 1});
    CHECK(detail::choose_cells<SmoothSpheres>(8, cube) == detail::GridCells<3>{2, 2, 2});
    CHECK(detail::choose_cells<SmoothSpheres>(8, Eigen::Vector3d(1, 1, 10)) == detail::GridCells<3>{1, 1, 8});
    CHECK(detail::choose_cells<SmoothSpheres>(12, Eigen::Vector3d(1, 3, 2)) == detail::GridCells<3>{1, 4, 3});
    CHECK(detail::choose_cells<SmoothDisks>(4, Eigen::Vector2d(1, 1)) == detail::GridCells<2>{2, 2});
    CHECK(detail::choose_cells<SmoothDisks>(6, Eigen::Vector2d(2, 3)) == detail::GridCells<2>{2, 3});
    CHECK(detail::choose_cells<SmoothDisks>(5, Eigen::Vector2d(1, 1)) == detail::GridCells<2>{5, 1});
    // on a line, in a plane, at one point
    CHECK(detail::choose_cells<SmoothSpheres>(4, Eigen::Vector3d(0, 0, 9)) == detail::GridCells<3>{1, 1, 4});
    CHECK(detail::choose_cells<SmoothSpheres>(4, Eigen::Vector3d(0, 9, 0)) == detail::GridCells<3>{1, 4, 1});
    CHECK(detail::choose_cells<SmoothSpheres>(4, Eigen::Vector3d(0, 1, 1)) == detail::GridCells<3>{1, 2, 2});
    CHECK(detail::choose_cells<SmoothDisks>(3, Eigen::Vector2d(0, 9)) == detail::GridCells<2>{1, 3});
    CHECK(detail::choose_cells<SmoothDisks>(3, Eigen::Vector2d(0, 0)) == detail::GridCells<2>{3, 1});
    CHECK_THROWS_AS(detail::choose_cells<SmoothDisks>(0, Eigen::Vector2d(1, 1)), std::invalid_argument);
}

TEMPLATE_TEST_CASE("every point has one owner, and those who come near it are visited", "[partition]", SmoothDisks,
                   SmoothSpheres) {
    using M = TestType;
    Random random(11);
    detail::GridCells<M::dim> cells;
    cells.fill(2);
    cells[0] = 3, cells[1] = 4;
    const int ranks = M::dim == 2 ? 12 : 24;
    const typename M::Vec low = M::Vec::Constant(-1), high = M::Vec::Constant(2);
    const detail::Grid<M> grid(cells, low, high);
    std::set<int> owners;
    for (int k = 0; k < 5000; ++k) {
        const typename M::Vec x =
            M::Vec::Constant(0.5) + random_vector<typename M::Vec>(random, 2.5);  // outside as well
        const double reach = uniform(random, 0, 0.5);
        std::set<int> visited;
        grid.visit_owners(x, reach, [&](int rank) { CHECK(visited.insert(rank).second); });
        const int owner = grid.owner(x);
        owners.insert(owner);
        CHECK(visited.count(owner) == 1);
        for (int n = 0; n < 10; ++n)
            CHECK(visited.count(grid.owner(x + random_vector<typename M::Vec>(random, reach))) == 1);
    }
    CHECK(static_cast<int>(owners.size()) == ranks);
    CHECK(*owners.begin() == 0);
    CHECK(*owners.rbegin() == ranks - 1);

    int visits = 0;  // in the middle of a cell of size 1 x 0.75 x 1.5: none but its owner
    grid.visit_owners(low + 0.5 * typename M::Vec(M::Vec::Constant(0.75)), 0.1, [&](int rank) { visits += 1 + rank; });
    CHECK(visits == 1);
}

TEMPLATE_TEST_CASE("candidates are complete, and each is in one subdomain", "[partition]", SmoothDisks, SmoothSpheres) {
    using M = TestType;
    Random random(12);
    const double edge = M::dim == 2 ? 8 : 5, skin = 0.1;
    const auto grains = unlike_grains<M>(random, edge);
    const auto walls = box_walls<M>(edge);
    const std::vector<Pair> expected = brute_force<M>(grains, walls, skin);
    REQUIRE(expected.size() > 50);
    for (const int ranks : {1, 2, 5, 16}) {
        INFO("ranks: " << ranks);
        InProcess comm(ranks);
        for (const bool anywhere : {false, true}) {
            auto parts = dealt_in_turn<M>(grains, ranks);
            detail::repartition<M>(parts, comm, grid_of<M>(ranks, edge), walls, skin, 1.0, anywhere);
            CHECK(of_all(parts, candidates<M>) == expected);
        }
    }
}

TEMPLATE_TEST_CASE("the contacts of all subdomains are those of one", "[partition]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const int side = M::dim == 2 ? 8 : 5;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    std::vector<std::vector<Pair>> expected;
    for (const int ranks : {1, 3, 8}) {
        INFO("ranks: " << ranks);
        Random random(13);
        const Solver solver = ranks == 1 ? nlgs_alone : Solver{Scheme::dcs, ranks};
        Run<M> run(solver, lattice_settings<M>(side, driven), shaken_lattice<M>(random, side));
        for (std::size_t step = 0; step < 5; ++step) {
            run.step();
            const auto pairs = of_all(run.simulation.parts(), contacts<M>);
            if (ranks == 1) expected.push_back(pairs);
            CHECK(pairs == expected[step]);
        }
    }
    CHECK(expected[0].size() > 50);
}

namespace {

// After a step: who holds a grain, whose copy is active, and what mass each of them was given.
template <class M>
void check_split_masses(const Simulation<M>& simulation) {
    const bool predicted = simulation.settings().multiplicity == Multiplicity::predicted;
    struct Sum {
        const Grain<M>* grain;
        std::vector<int> holders, touching;  // ranks
        std::vector<int> replicas, active;   // as the first holder has them
        double mass = 0, inertia = 0;
        int multiplicity = 0;
    };
    std::map<int, Sum> sums;
    for (const auto& part : simulation.parts()) {
        std::set<int> touched;
        for (const Pair& pair : predicted ? candidates(part) : contacts(part))
            touched.insert({pair.first, pair.second});
        for (std::size_t g = 0; g < part.grains.size(); ++g) {
            const auto first = static_cast<std::ptrdiff_t>(part.first_replica(g)),
                       last = static_cast<std::ptrdiff_t>(part.last_replica(g));
            const std::vector<int> replicas(part.replicas.begin() + first, part.replicas.begin() + last);
            const std::vector<int> active(part.active.begin() + first, part.active.begin() + last);
            const Body<M>& body = part.problem.bodies[g];
            const auto [entry, is_new] = sums.try_emplace(part.grains[g].id);
            Sum& sum = entry->second;
            if (is_new) sum.grain = &part.grains[g], sum.replicas = replicas, sum.active = active;
            CHECK(replicas == sum.replicas);
            CHECK(active == sum.active);
            CHECK(part.problem.multiplicity[g] == part.multiplicity(g));
            sum.holders.push_back(part.rank);
            sum.multiplicity = part.problem.multiplicity[g];
            if (!touched.count(part.grains[g].id)) continue;
            sum.touching.push_back(part.rank);
            sum.mass += 1 / body.inv_mass;
            if constexpr (M::friction) sum.inertia += 1 / body.inv_inertia;
        }
    }
    int shared = 0;
    for (const auto& [id, sum] : sums) {
        INFO("grain " << id);
        CHECK(sum.holders == sum.replicas);
        std::vector<int> active;
        for (std::size_t s = 0; s < sum.replicas.size(); ++s)
            if (sum.active[s]) active.push_back(sum.replicas[s]);
        if (!predicted || active.size() > 1) CHECK(active == sum.touching);
        CHECK(sum.multiplicity == std::max<int>(1, static_cast<int>(sum.touching.size())));
        if (sum.touching.empty()) continue;
        CHECK(sum.mass == Approx(sum.grain->mass).epsilon(1e-14));
        if (M::friction) CHECK(sum.inertia == Approx(sum.grain->inertia).epsilon(1e-14));
        shared += sum.multiplicity > 1;
    }
    CHECK(shared > 2);
}

template <class M>
void check_split_walls(const Simulation<M>& simulation) {
    const bool predicted = simulation.settings().multiplicity == Multiplicity::predicted;
    int shared = 0;
    for (std::size_t w = 0; w < simulation.walls().size(); ++w) {
        double mass = 0;
        int touching = 0;
        for (const auto& part : simulation.parts()) {
            const auto any = [&](const auto& all) {
                return std::any_of(all.begin(), all.end(), [&](const auto& c) { return c.j == static_cast<int>(w); });
            };
            if (!(predicted ? any(part.wall_pairs) : any(part.problem.wall_contacts))) continue;
            ++touching;
            if (simulation.walls()[w].driven)
                mass += 1 / part.problem.walls[w].inv_mass;
            else
                CHECK(part.problem.walls[w].inv_mass == 0);
        }
        if (!simulation.walls()[w].driven) continue;
        CHECK(mass == Approx(simulation.walls()[w].mass).epsilon(1e-14));
        shared += touching > 1;
    }
    CHECK(shared >= M::dim - 1);  // strips share the driven walls along them
}

}  // namespace

TEMPLATE_TEST_CASE("split masses sum to the whole, and all holders agree", "[partition]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    const int ranks = GENERATE(3, 8);
    INFO("ranks: " << ranks);
    Random random(14);
    const int side = M::dim == 2 ? 7 : 4;
    SimulationSettings<M> settings = lattice_settings<M>(side, driven);
    settings.multiplicity = GENERATE(Multiplicity::minimal, Multiplicity::predicted);
    CAPTURE(settings.multiplicity == Multiplicity::predicted);
    Run<M> run({Scheme::dcs, ranks}, settings, shaken_lattice<M>(random, side));
    for (int step = 0; step < 5; ++step) {
        run.step();
        check_split_masses(run.simulation);
        if (driven && step == 0) check_split_walls(run.simulation);
    }
}

TEMPLATE_TEST_CASE("impulses survive a new partition", "[partition]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Random random(15);
    const int side = M::dim == 2 ? 7 : 4, ranks = 8;
    const double edge = 1.05 * side, skin = 0.3;
    Run<M> run({Scheme::dcs, ranks}, lattice_settings<M>(side, driven), shaken_lattice<M>(random, side));
    for (int step = 0; step < 5; ++step) run.step();
    const auto& walls = run.simulation.walls();
    std::vector<Subdomain<M>> parts = run.simulation.parts();
    const Carried<M> before = impulses<M>(parts);
    REQUIRE(before.size() > 20);

    detail::GridCells<M::dim> strips;
    strips.fill(1);
    strips[1] = ranks;
    const detail::Grid<M> other(strips, M::Vec::Zero(), M::Vec::Constant(edge));
    for (const detail::Grid<M>& grid : {grid_of<M>(ranks, edge), other, grid_of<M>(ranks, edge)}) {
        detail::repartition<M>(parts, run.comm, grid, walls, skin, 0.5);
        CHECK(impulses<M>(parts) == before);
    }

    // and they can start another simulation, on as many ranks as one likes
    std::vector<PairImpulse<M>> start;
    for (const auto& part : parts)
        detail::visit_impulses(part, [&](const auto&, const PairImpulse<M>& p) { start.push_back(p); });
    auto settings = lattice_settings<M>(side);
    settings.walls.assign(walls.begin(), walls.end());
    InProcess comm(3);
    const Simulation<M> again(comm, settings, run.grains(), start);
    CHECK(impulses<M>(again.parts()) == before);
}

TEMPLATE_TEST_CASE("a column of grains is cut along its axis", "[partition]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const int ranks = GENERATE(2, 4);
    SimulationSettings<M> settings{.materials = smooth<M>(), .h = 1e-3};
    settings.walls = box_walls<M>(20);
    settings.gravity[M::dim - 1] = -1;
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 10; ++k) {
        grains.push_back(make_grain<M>(k, 0.5, 1.0, M::Vec::Constant(10)));
        grains.back().position[M::dim - 1] = 0.5 + k;
    }
    Run<M> run({Scheme::dcs, ranks}, settings, grains);
    CHECK(run.step().interface_grains == ranks - 1);
    for (const auto& part : run.simulation.parts()) CHECK(part.problem.contact_count() > 0);
}

TEMPLATE_TEST_CASE("a column at rest stays solved when it is repartitioned every step", "[partition]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    SimulationSettings<M> settings{.h = 1e-3};
    settings.walls = box_walls<M>(20);
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    settings.gravity[M::dim - 1] = -1;
    settings.broad_phase_every = 0;
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 8; ++k) {
        typename M::Vec x = M::Vec::Constant(10);
        x[M::dim - 1] = 0.5 + k;
        grains.push_back(make_grain<M>(k, 0.5, 1.0, x));
    }
    for (const Solver& solver : {nlgs_alone, Solver{Scheme::ccs, 3}, Solver{Scheme::dcs, 4}}) {
        INFO(solver.name());
        Run<M> run(solver, settings, grains);
        const int cold = run.step().solve.iterations;
        for (int step = 0; step < 5; ++step) CHECK(5 * run.step().solve.iterations < cold);
    }
}
