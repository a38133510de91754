// The fast sweep against the scalar one, contact by contact in the same order.
#include <numeric>

#include "../catch.hpp"
#include "random_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

// The layouts of bodies and contacts; where the kernel is compiled for this test alone, those that turn.
#ifdef NSCDD_WITHOUT_COMPILED_KERNEL
#define EVERY_LAYOUT FrictionDisks, FrictionSpheres
#else
#define EVERY_LAYOUT SmoothDisks, FrictionDisks, SmoothSpheres, FrictionSpheres
#endif

namespace {

template <class M>
std::vector<Contact<M>> in_order(const std::vector<Contact<M>>& contacts, const std::vector<int>& order) {
    std::vector<Contact<M>> sorted;
    for (int c : order)
        if (c >= 0) sorted.push_back(contacts[static_cast<std::size_t>(c)]);
    return sorted;
}

template <class M>
double largest_impulse_difference(const std::vector<Contact<M>>& a, const std::vector<Contact<M>>& b) {
    double largest = 0;
    for (std::size_t c = 0; c < a.size(); ++c) largest = std::max(largest, (a[c].r - b[c].r).norm());
    return largest;
}

// Hands the problems of a second step, whose contacts bring impulses along, to inspect(problem).
template <class M>
void second_step(Solver solver, SimulationSettings<M> settings, const std::vector<Grain<M>>& grains, auto&& inspect) {
    Run<M> run(solver, std::move(settings), grains);
    run.step();
    run.simulation.step([&](std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
        for (auto& part : parts) inspect(part.problem);
        return by_nscdd<Dcs<M>>(run.options)(parts, comm, seconds);
    });
}

// One sweep in two passes, contact by contact: walls' contacts before others in each.
template <class M>
void sweep_in_passes(ContactProblem<M>& problem, const detail::SweepFront& front, bool rest_first) {
    using List = std::vector<Contact<M>>;
    const auto pass = [&](List& contacts, std::size_t begin, std::size_t end, auto kind) {
        List part(contacts.begin() + static_cast<std::ptrdiff_t>(begin),
                  contacts.begin() + static_cast<std::ptrdiff_t>(end));
        detail::sweep_contacts(problem, part, kind, detail::Unaccelerated{});
        std::copy(part.begin(), part.end(), contacts.begin() + static_cast<std::ptrdiff_t>(begin));
    };
    for (const bool rest : {rest_first, !rest_first}) {
        const auto all = [rest](std::size_t front_size, const List& contacts) {
            return rest ? std::pair(front_size, contacts.size()) : std::pair(std::size_t{0}, front_size);
        };
        const auto [wall_begin, wall_end] = all(front.wall_contacts, problem.wall_contacts);
        const auto [begin, end] = all(front.contacts, problem.contacts);
        pass(problem.wall_contacts, wall_begin, wall_end, WithWall{});
        pass(problem.contacts, begin, end, BetweenGrains{});
    }
}

// Shares of the contacts that are swept in a first pass: none, or so many in a hundred.
template <class M>
void compare_sweeps(ContactProblem<M> scalar, std::size_t share = 0) {
    ContactProblem<M> fast = scalar;
    prepare_contacts(scalar);
    Sweeper<M> sweeper;
    const detail::SweepFront front{scalar.contacts.size() * share / 100, scalar.wall_contacts.size() * share / 100};
    sweeper.load(fast, 1, front);
    REQUIRE(sweeper.batched());
    scalar.contacts = in_order<M>(scalar.contacts, sweeper.order());
    scalar.wall_contacts = in_order<M>(scalar.wall_contacts, sweeper.wall_order());
    REQUIRE(scalar.contact_count() == fast.contact_count());
    for (int s = 0; s < 5; ++s) {
        if (share == 0) {
            sweep(scalar);
            sweeper.sweep(fast);
            continue;
        }
        const bool rest_first = s % 2 == 0;
        sweep_in_passes(scalar, front, rest_first);
        sweeper.begin(fast);
        if (!rest_first) sweeper.pass(fast, detail::SweepPass::first);
        sweeper.pass(fast, detail::SweepPass::rest_walls);
        for (std::size_t n = 0; n < 3; ++n)
            sweeper.pass(fast, detail::SweepPass::rest_grains, nullptr, nullptr, {n, 3});
        if (rest_first) sweeper.pass(fast, detail::SweepPass::first);
    }
    const ResidualParts ours = sweeper.residual(fast), theirs = residual_parts(scalar);
    sweeper.store(fast);

    double speed = 0, difference = 0, impulse = 0;
    for (std::size_t g = 0; g < fast.bodies.size(); ++g) {
        speed = std::max(speed, scalar.bodies[g].v.norm());
        difference = std::max(difference, (scalar.bodies[g].v - fast.bodies[g].v).norm());
    }
    CHECK(difference <= 1e-13 * speed);
    for (std::size_t w = 0; w < fast.walls.size(); ++w)
        CHECK(std::abs(fast.walls[w].speed - scalar.walls[w].speed) <= 1e-13 * speed);
    for (const auto& c : scalar.contacts) impulse = std::max(impulse, c.r.norm());
    CHECK(impulse > 0);
    CHECK(largest_impulse_difference<M>(in_order<M>(fast.contacts, sweeper.order()), scalar.contacts) <=
          1e-12 * impulse);
    CHECK(largest_impulse_difference<M>(in_order<M>(fast.wall_contacts, sweeper.wall_order()), scalar.wall_contacts) <=
          1e-12 * impulse);

    CHECK(theirs.change > 0);
    const Buffer our_numbers = detail::numbers(ours), their_numbers = detail::numbers(theirs);
    for (std::size_t k = 0; k < our_numbers.size(); ++k)
        CHECK(our_numbers[k] == Approx(their_numbers[k]).epsilon(1e-9).margin(1e-12 * theirs.energy));
}

}  // namespace

TEMPLATE_TEST_CASE("a fast sweep is a scalar sweep in its order", "[sweeper]", EVERY_LAYOUT) {
    using M = TestType;
    Random random(11);
    const int side = M::dim == 2 ? 9 : 5;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    for (const int ranks : {1, 3})  // with whole and with split masses
        second_step<M>({Scheme::dcs, ranks}, lattice_settings<M>(side, driven), shaken_lattice<M>(random, side),
                       [](const ContactProblem<M>& problem) {
                           REQUIRE(problem.contacts.size() > 15);
                           REQUIRE(problem.wall_contacts.size() > 1);
                           for (const std::size_t share : {0, 30, 100}) compare_sweeps(problem, share);
                       });
}

TEMPLATE_TEST_CASE("contacts that were open for long are swept once they close", "[sweeper]", EVERY_LAYOUT) {
    using M = TestType;
    Random random(15);
    const int side = M::dim == 2 ? 9 : 5;
    Run<M> run(nlgs_alone, lattice_settings<M>(side), shaken_lattice<M>(random, side));
    ContactProblem<M> scalar;
    std::vector<Grain<M>> grains;
    run.simulation.step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) {
        scalar = parts[0].problem;
        grains = parts[0].grains;
        return SolveReport{};
    });
    scalar.wall_contacts.clear();
    for (auto& c : scalar.contacts) c.r.setZero();
    const auto move = [&](ContactProblem<M>& problem, double outwards) {
        for (std::size_t g = 0; g < grains.size(); ++g) {
            problem.bodies[g].v.setZero();
            problem.bodies[g].linear() = outwards * grains[g].position;
        }
    };
    move(scalar, 1);
    ContactProblem<M> fast = scalar;
    prepare_contacts(scalar);
    Sweeper<M> sweeper;
    sweeper.load(fast);
    scalar.contacts = in_order<M>(scalar.contacts, sweeper.order());
    for (int s = 0; s < 20; ++s) sweeper.sweep(fast);
    sweeper.store(fast);
    for (std::size_t g = 0; g < grains.size(); ++g) REQUIRE((fast.bodies[g].v - scalar.bodies[g].v).norm() <= 1e-14);

    move(fast, -1);
    move(scalar, -1);
    // As gluing does it: between the rows of one sweeper and those of another, in which units ever.
    Sweeper<M> moved;
    moved.load(fast);
    for (int g = 0; g < static_cast<int>(grains.size()); ++g) std::copy_n(moved.row(g), M::dof, sweeper.row(g));
    for (int s = 0; s < 3; ++s) {
        sweeper.sweep(fast);
        sweep(scalar);
    }
    sweeper.store(fast);
    double impulse = 0;
    for (const auto& c : scalar.contacts) impulse = std::max(impulse, c.r.norm());
    CHECK(impulse > 0);
    CHECK(largest_impulse_difference<M>(in_order<M>(fast.contacts, sweeper.order()), scalar.contacts) <=
          1e-12 * impulse);
}

TEST_CASE("contacts of different friction do not share a batch", "[sweeper]") {
    using M = FrictionSpheres;
    Random random(12);
    auto settings = lattice_settings<M>(5);
    settings.materials = Materials<M>(2);
    settings.materials.set(0, 0, {0.1, 0});
    settings.materials.set(0, 1, {0.3, 0});
    settings.materials.set(1, 1, {0.9, 0});
    auto grains = shaken_lattice<M>(random, 5);
    for (auto& g : grains) g.material = g.id % 2;
    second_step<M>(nlgs_alone, settings, grains, [](const ContactProblem<M>& problem) { compare_sweeps(problem); });
}

TEMPLATE_TEST_CASE("batches hold every contact once and no body twice", "[sweeper]", FrictionDisks, FrictionSpheres) {
    using M = TestType;
    Random random(13);
    const int side = M::dim == 2 ? 12 : 6;
    second_step<M>(nlgs_alone, lattice_settings<M>(side), shaken_lattice<M>(random, side),
                   [](ContactProblem<M>& problem) {
                       Sweeper<M> sweeper;
                       sweeper.load(problem);
                       const std::vector<int>& order = sweeper.order();
                       REQUIRE(order.size() % detail::batch_size == 0);
                       std::vector<int> times(problem.contacts.size(), 0), last(problem.bodies.size(), -1);
                       for (std::size_t k = 0; k < order.size(); ++k) {
                           if (order[k] < 0) continue;
                           const auto& c = problem.contacts[static_cast<std::size_t>(order[k])];
                           ++times[static_cast<std::size_t>(order[k])];
                           for (int body : {c.i, c.j}) {
                               CHECK(last[static_cast<std::size_t>(body)] < static_cast<int>(k / detail::batch_size));
                               last[static_cast<std::size_t>(body)] = static_cast<int>(k / detail::batch_size);
                           }
                       }
                       CHECK(std::ranges::all_of(times, [](int n) { return n == 1; }));
                       CHECK(order.size() < problem.contacts.size() + 4 * detail::batch_size);  // few lanes are idle
                   });
}

TEST_CASE("inertias that are not those of solid spheres are swept contact by contact", "[sweeper]") {
    using M = FrictionSpheres;
    Random random(14);
    auto grains = shaken_lattice<M>(random, 4);
    for (auto& g : grains) g.inertia *= 1 + 0.1 * (g.id % 3);
    second_step<M>(nlgs_alone, lattice_settings<M>(4), grains, [](ContactProblem<M> problem) {
        ContactProblem<M> fast = problem;
        Sweeper<M> sweeper;
        sweeper.load(fast);
        CHECK_FALSE(sweeper.batched());
        prepare_contacts(problem);
        sweep(problem);
        sweeper.sweep(fast);
        sweeper.store(fast);
        double difference = 0;
        for (std::size_t g = 0; g < fast.bodies.size(); ++g)
            difference = std::max(difference, (problem.bodies[g].v - fast.bodies[g].v).norm());
        CHECK(difference == 0);
        CHECK(sweeper.residual(fast).eta() == residual_parts(problem).eta());
    });
}
