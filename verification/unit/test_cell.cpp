// A cell that repeats: where the origin is, how many times the scene is written down, and how it is divided must not
// matter.
#include <set>

#include "../catch.hpp"
#include "../small_scenes.hpp"
#include "nscdd/partition/bisection.hpp"
#include "nscdd/partition/metis.hpp"
#include "nscdd/plain/sweep.hpp"
#include "nscdd/reference/assemble.hpp"
#include "random_scenes.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace nscdd::test;
using scenes::Outcome, scenes::Scene, scenes::flowing_cell, scenes::repeating_cell;

namespace {

const SolveOptions exact{.tolerance = 1e-13, .check_every = 5, .max_iterations = 20000};

template <class M>
Cell<M> random_cell(Random& random) {
    Cell<M> cell;
    cell.low = random_vector<typename M::Vec>(random);
    for (int d = 0; d < M::dim; ++d) {
        cell.periodic[static_cast<std::size_t>(d)] = d != 1 || M::dim == 2;
        cell.size[d] = 4.0 + std::abs(random_vector<typename M::Vec>(random)[0]);
    }
    return cell;
}

// All images up to two sides away.
template <class M>
void visit_all(const Cell<M>& cell, const typename M::Vec& point, auto&& visit) {
    const auto most = [&](int d) { return d < M::dim && cell.periodic[static_cast<std::size_t>(d)] ? 2 : 0; };
    for (int x = -most(0); x <= most(0); ++x)
        for (int y = -most(1); y <= most(1); ++y)
            for (int z = -most(2); z <= most(2); ++z) {
                typename M::Vec image = point;
                const int times[] = {x, y, z};
                for (int d = 0; d < M::dim; ++d) image[d] += times[d] * (times[d] == 0 ? 0.0 : cell.size[d]);
                visit(image);
            }
}

template <class M>
double largest_difference(const Outcome<M>& a, const Outcome<M>& b) {
    double worst = 0;
    for (std::size_t g = 0; g < a.grains.size(); ++g)
        worst = std::max(worst, (a.grains[g].grain.velocity - b.grains[g].grain.velocity).norm());
    return worst;
}

}  // namespace

TEMPLATE_TEST_CASE("the nearest image and the images round a cell are those of a search through all", "", EVERY_MODEL) {
    using M = TestType;
    using Vec = typename M::Vec;
    Random random(5);
    for (int k = 0; k < 200; ++k) {
        const Cell<M> cell = random_cell<M>(random);
        const Vec a = 6 * random_vector<Vec>(random), b = 6 * random_vector<Vec>(random);
        const Vec home = cell.wrapped(a);
        double least = 1e300;
        visit_all(cell, cell.wrapped(b), [&](const Vec& image) { least = std::min(least, (home - image).norm()); });
        CHECK(cell.apart(a, b).norm() == Approx(least));
        CHECK(cell.apart(a, b) == -cell.apart(b, a));

        const double reach = 1.5;
        const auto within = [&](const Vec& image) {
            for (int d = 0; d < M::dim; ++d)
                if (cell.periodic[static_cast<std::size_t>(d)] &&
                    (image[d] < cell.low[d] - reach || image[d] > cell.low[d] + cell.size[d] + reach))
                    return false;
            return true;
        };
        int expected = 0, visited = 0;
        visit_all(cell, home, [&](const Vec& image) { expected += within(image); });
        cell.visit_images(a, reach, [&](const Vec& image) {
            CHECK(within(image));
            CHECK(cell.apart(image, a).norm() < 1e-12);
            ++visited;
        });
        CHECK(visited == expected);
    }
}

TEMPLATE_TEST_CASE("pairs that are close across the sides of a cell are found, each once", "", EVERY_MODEL) {
    using M = TestType;
    Random random(6);
    for (const double skin : {0.5, 1.0, 4.0}) {  // the last one takes in several images
        const Cell<M> cell = random_cell<M>(random);
        std::vector<Grain<M>> grains;
        for (int id = 0; id < 60; ++id)
            grains.push_back(
                make_grain<M>(59 - id, 0.01, 1.0, cell.wrapped(6 * random_vector<typename M::Vec>(random))));
        std::set<std::pair<int, int>> found, expected;
        const auto all = [](const auto&, const auto&) { return true; };
        for (const detail::GrainPair& pair : detail::close_pairs<M>(grains, cell, 0.02 + skin, skin, all)) {
            const int i = grains[static_cast<std::size_t>(pair.i)].id, j = grains[static_cast<std::size_t>(pair.j)].id;
            CHECK(i < j);
            CHECK(found.insert({i, j}).second);
        }
        for (const auto& a : grains)
            for (const auto& b : grains)
                if (a.id < b.id && cell.apart(a.position, b.position).norm() < 0.02 + skin)
                    expected.insert({a.id, b.id});
        CHECK(found == expected);
        CHECK(!expected.empty());
    }
}

TEMPLATE_TEST_CASE("a cell keeps the momentum of its grains", "", EVERY_MODEL) {
    using M = TestType;
    const Scene<M> scene = repeating_cell<M>();
    typename M::Vec before = M::Vec::Zero();
    double scale = 0;
    for (const auto& g : scene.grains) {
        before += g.mass * g.velocity.template head<M::dim>();
        scale += g.mass * g.velocity.norm();
    }
    for (const int ranks : {1, 5}) {
        const auto after = scenes::run_nscdd<Dcs, ClosedForm>(scene, ranks, 30, {});
        CHECK((after.measures.momentum - before).norm() < 1e-12 * scale);
        CHECK(after.last().contacts > 60);
    }
}

// A cell at rest and, of models that have one, a cell that flows.
template <class M>
std::vector<Scene<M>> cells() {
    std::vector<Scene<M>> all{repeating_cell<M>()};
    if constexpr (M::friction) {
        all.push_back(flowing_cell<M>());
        all.push_back(scenes::pressed_cell<M>());
    }
    return all;
}

TEMPLATE_TEST_CASE("where the origin of a cell is does not matter", "", EVERY_MODEL) {
    using M = TestType;
    using Vec = typename M::Vec;
    for (const Scene<M>& scene : cells<M>()) {
        INFO(scene.name);
        const auto given = scenes::run_nlgs(scene, 12, exact);
        REQUIRE(given.converged());
        Scene<M> moved = scene, corner = scene;
        for (auto& g : moved.grains) g.position += Vec::LinSpaced(M::dim, 3.3, -40.1);
        corner.settings.cell.low = Vec::LinSpaced(M::dim, 1.7, -2.9);
        const auto a = scenes::run_nlgs(moved, 12, exact), b = scenes::run_nlgs(corner, 12, exact);
        CHECK(largest_difference(given, a) < 1e-9);
        CHECK(largest_difference(given, b) < 1e-9);
        CHECK(given.contacts.size() == a.contacts.size());
        CHECK(given.contacts.size() > 25);
        CHECK((given.measures.virial - a.measures.virial).norm() < 1e-7 * given.measures.virial.norm());
    }
}

TEMPLATE_TEST_CASE("a common velocity of the grains in a cell does not matter", "", EVERY_MODEL) {
    using M = TestType;
    const Scene<M> scene = repeating_cell<M>();
    const auto given = scenes::run_nlgs(scene, 12, exact);
    Scene<M> still = scene;
    const typename M::Vec common = still.grains[0].velocity.template head<M::dim>();
    for (auto& g : still.grains) g.velocity.template head<M::dim>() -= common;
    auto other = scenes::run_nlgs(still, 12, exact);
    for (auto& g : other.grains) g.grain.velocity.template head<M::dim>() += common;
    CHECK(largest_difference(given, other) < 1e-9 * common.norm());
}

TEMPLATE_TEST_CASE("a cell written down twice has the answer of one", "", EVERY_MODEL) {
    using M = TestType;
    for (const Scene<M>& scene : cells<M>()) {
        INFO(scene.name);
        const int steps = scene.settings.cell.any_driven() ? 8 : 12;  // later ones take too long to be exact
        const auto once = scenes::run_nlgs(scene, steps, exact);
        CHECK(once.converged());
        for (int d = 0; d < M::dim; ++d) {
            Scene<M> doubled = scene;
            const int count = static_cast<int>(scene.grains.size());
            for (const auto& g : scene.grains) {
                doubled.grains.push_back(g);
                doubled.grains.back().id += count;
                doubled.grains.back().position[d] += scene.settings.cell.size[d];
            }
            doubled.settings.cell.size[d] *= 2;
            doubled.settings.cell.mass *= 2;
            const auto twice = scenes::run_nlgs(doubled, steps, exact);
            CHECK(twice.converged());
            CHECK(twice.contacts.size() == 2 * once.contacts.size());
            double worst = 0;
            for (std::size_t g = 0; g < twice.grains.size(); ++g)
                worst = std::max(
                    worst,
                    (twice.grains[g].grain.velocity - once.grains[g % scene.grains.size()].grain.velocity).norm());
            CHECK(worst < 1e-9);
        }
    }
}

TEMPLATE_TEST_CASE("a cell has one answer, however it is divided", "", EVERY_MODEL) {
    using M = TestType;
    for (Scene<M> scene : cells<M>()) {
        scene.settings.broad_phase_every = 3;
        const auto alone = scenes::run_nlgs(scene, 15, exact);
        CHECK(alone.converged());
        const auto compare = [&](const Outcome<M>& divided) {
            CHECK(divided.converged());
            CHECK(largest_difference(divided, alone) < 1e-8);
            CHECK(divided.contacts.size() == alone.contacts.size());
            CHECK(divided.last().interface_grains > 0);
        };
        compare(scenes::run_nscdd<Ccs, Factorised<>>(scene, 8, 15, exact));
        compare(scenes::run_nscdd<Dcs, ClosedForm>(scene, 2, 15, exact));
        for (const auto& partitioner : {by_bisection<M>(1.0), by_metis<M>(1.0)}) {
            INFO(scene.name << ", " << partitioner.kind);
            scene.settings.partition = partitioner;
            compare(scenes::run_nscdd<Dcs, ClosedForm>(scene, 7, 15, exact));
        }
    }
}

TEMPLATE_TEST_CASE("a cell goes on from where it stopped, bit for bit", "", EVERY_MODEL) {
    using M = TestType;
    for (const Scene<M>& scene : cells<M>()) {
        const auto solve = by_nscdd<Dcs<M>>({});
        InProcess comm(4), other(4);
        Simulation<M> whole(comm, scene.settings, scene.grains);
        for (int k = 0; k < 7; ++k) whole.step(solve);
        std::vector<Grain<M>> grains;
        for (const auto& g : gather_grains(whole)) grains.push_back(g.grain);
        std::vector<PairImpulse<M>> impulses;
        for (const auto& c : gather_contacts(whole)) impulses.push_back(c.pair());
        const BroadPhaseState<M> last = gather_broad_phase(whole);
        Simulation<M> second(other, whole.settings(), grains, impulses, &last);
        for (int k = 0; k < 8; ++k) {
            const StepReport a = whole.step(solve), b = second.step(solve);
            CHECK(a.solve.iterations == b.solve.iterations);
        }
        const auto a = gather_grains(whole), b = gather_grains(second);
        for (std::size_t g = 0; g < a.size(); ++g) {
            CHECK(a[g].grain.position == b[g].grain.position);
            CHECK(a[g].grain.velocity == b[g].grain.velocity);
        }
    }
}

TEST_CASE("a grain alone goes straight on in a cell that flows") {
    using M = scenes::Spheres;
    const auto error = [](double h) {
        Cell<M> cell{.periodic = {true, true, true}, .size = M::Vec::Constant(10)};
        cell.gradient(0, 1) = 0.7;
        cell.gradient(0, 2) = -0.3;
        SimulationSettings<M> settings{.cell = cell, .materials = smooth<M>(), .h = h};
        auto grain = make_grain<M>(0, 0.5, 1.0, M::Vec(2, 3, 4));
        grain.velocity.head<3>() = M::Vec(1, -0.5, 0.25);
        InProcess comm(1);
        Simulation<M> simulation(comm, settings, std::vector{grain});
        const double time = 0.8;
        for (int k = 0; k < std::lround(time / h); ++k) simulation.step(by_nlgs<M>({}));
        const M::Vec w = grain.velocity.head<3>(),  // found half a step ago, where the grain was then
            velocity = w + detail::flow_over<M>(cell.gradient_after(0.5 * h), grain.position - 0.5 * h * w);
        const Cell<M>& now = simulation.settings().cell;
        const auto after = gather_grains(simulation)[0].grain;
        return now.apart(after.position, grain.position + time * velocity).norm();
    };
    for (const double h : {1e-1, 1e-2}) CHECK(error(h) < 1e-12);
}

TEMPLATE_TEST_CASE("a cell that flows closes its energy balance and misses no contact", "", scenes::Disks,
                   scenes::Spheres) {
    using M = TestType;
    Scene<M> scene = flowing_cell<M>();
    scene.settings.h = 5e-3;
    double scale = 0;
    for (const auto& g : scene.grains) scale += g.mass;
    for (const int ranks : {1, 6}) {
        InProcess comm(ranks);
        Simulation<M> simulation(comm, scene.settings, scene.grains);
        const auto solve = by_nscdd<Dcs<M>>(SolveOptions{.tolerance = 1e-8}.accelerated());
        double largest_tilt = 0;
        for (int k = 0; k < 200; ++k) {
            const StepReport report = simulation.step(solve);
            const StepReport::Energy& e = report.energy;
            CHECK(std::abs(e.round_off()) < 1e-12 * (e.kinetic + std::abs(e.walls) + std::abs(e.contacts())));
            largest_tilt = std::max(largest_tilt, std::abs(simulation.settings().cell.tilt(0, 1)));
        }
        const Cell<M>& cell = simulation.settings().cell;
        CHECK(cell.size[0] == Approx(scene.settings.cell.size[0] * std::pow(1 - 0.08 * 5e-3, 200)));
        CHECK(largest_tilt > 0.4 * cell.size[0]);  // it has been sheared by more than half a side, and tilted back
        CHECK(std::abs(cell.tilt(0, 1)) <= 0.5 * cell.size[0]);
        typename M::Vec momentum = measure(simulation).momentum;
        CHECK(momentum.norm() < 1e-11 * scale);
        double deepest = 0;
        int touching = 0;
        const auto grains = gather_grains(simulation);
        for (const auto& a : grains)
            for (const auto& b : grains) {
                if (a.grain.id >= b.grain.id) continue;
                const double gap =
                    cell.apart(a.grain.position, b.grain.position).norm() - a.grain.radius - b.grain.radius;
                deepest = std::max(deepest, -gap);
                touching += gap < 1e-3;
            }
        CHECK(touching > 40);
        CHECK(deepest < 2e-3);
    }
}

TEMPLATE_TEST_CASE("a stress presses a cell until its grains bear it", "", scenes::Disks, scenes::Spheres) {
    using M = TestType;
    Scene<M> scene = scenes::pressed_cell<M>();
    scene.settings.cell.gradient.setZero();
    for (const int ranks : {1, 6}) {
        InProcess comm(ranks);
        Simulation<M> simulation(comm, scene.settings, scene.grains);
        const auto solve = by_nscdd<Dcs<M>>(SolveOptions{}.accelerated());
        int unconverged = 0;
        for (int k = 0; k < 600; ++k) {
            const StepReport report = simulation.step(solve);
            const StepReport::Energy& e = report.energy;
            CHECK(std::abs(e.round_off()) <
                  1e-12 * (e.before + e.kinetic + std::abs(e.walls) + std::abs(e.contacts())));
            unconverged += !report.solve.converged;
        }
        CHECK(unconverged == 0);
        const Cell<M>& cell = simulation.settings().cell;
        const auto virial = measure(simulation).virial;
        const double volume = cell.size.prod();
        for (int d = 0; d < M::dim; ++d) {
            CHECK(virial(d, d) / volume == Approx(cell.stress[d]).epsilon(0.02));
            CHECK(std::abs(cell.gradient(d, d)) < 1e-2);
            CHECK(cell.size[d] < scene.settings.cell.size[d]);
        }
    }
}

TEMPLATE_TEST_CASE("the plain sweep and the fast one agree in a cell that flows", "", scenes::Disks, scenes::Spheres) {
    using M = TestType;
    const Scene<M> scene = scenes::pressed_cell<M>();
    InProcess comm(1);
    Simulation<M> simulation(comm, scene.settings, scene.grains);
    for (int k = 0; k < 200; ++k) simulation.step(by_nlgs<M>({}));
    ContactProblem<M> problem;
    simulation.step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) {
        problem = parts[0].problem;
        return nlgs(parts[0].problem, exact);
    });
    CHECK(problem.flow.has_value());
    const ContactProblem<M> solved = simulation.parts()[0].problem;
    problem = solved;
    plain::sweep(problem);
    double worst = 0, largest = 0;
    for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
        worst = std::max(worst, (problem.contacts[c].r - solved.contacts[c].r).norm());
        largest = std::max(largest, solved.contacts[c].r.norm());
    }
    CHECK(problem.contacts.size() > 60);
    CHECK(worst < 1e-9 * largest);
    CHECK_THROWS_AS(assemble(problem), std::invalid_argument);
}

TEST_CASE("a cell that cannot be is refused in one line") {
    using M = scenes::Spheres;
    InProcess comm(2);
    const auto refused = [&](auto&& change) {
        Scene<M> scene = repeating_cell<M>();
        change(scene);
        try {
            Simulation<M>(comm, scene.settings, scene.grains).step(by_nscdd<Dcs<M>>({}));
        } catch (const std::exception& error) {
            return std::string(error.what());
        }
        return std::string("taken");
    };
    CHECK(refused([](auto&) {}) == "taken");
    CHECK(refused([](auto& s) { s.settings.cell.size[1] = 1.9; }) ==
          "cell: the side along y is shorter than 2.01 diameters of the largest grain");
    for (const double wrong : {0.0, -3.0, std::numeric_limits<double>::quiet_NaN()})
        CHECK(refused([&](auto& s) { s.settings.cell.size[2] = wrong; }) ==
              "cell: the side along z must be positive and finite");
    CHECK(refused([](auto& s) { s.settings.walls.emplace_back(); }) == "cell: the side along x crosses wall 0");
    const auto driven = [](Scene<M>& s) { s.settings.cell.driven.fill(true), s.settings.cell.stress.setOnes(); };
    CHECK(refused(driven) == "cell: sides that a stress drives need a positive mass");
    CHECK(refused([&](auto& s) { driven(s), s.settings.cell.mass = 0.01; }) ==
          "cell: the mass of sides must be at least three times that of all grains, 68 kg, for sweeps to converge");
    CHECK(refused([&](auto& s) { driven(s), s.settings.cell.periodic[1] = false; }) ==
          "cell: a stress drives sides where all axes are periodic, and is finite");
    CHECK(refused([](auto& s) { s.grains[3].velocity[0] = 100; }) ==
          "step 1: grains move by more than a fifth of the cell within the step: take h <= 0.0083 s");
}
