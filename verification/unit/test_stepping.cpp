// From step to step: a simulation that goes on from a stored one is the one that was not interrupted.
#include "../catch.hpp"
#include "../small_scenes.hpp"
#include "nscdd/partition/metis.hpp"
#include "scratch.hpp"

using namespace nscdd;
using namespace scenes;
using nscdd::test::complaint;

namespace {

// What a simulation leaves to go on from.
template <class M>
struct Stored {
    Scene<M> scene;
    BroadPhaseState<M> broad_phase;
};

template <class M>
Stored<M> store(const Simulation<M>& simulation) {
    Stored<M> stored{{"stored", simulation.settings(), {}, {}}, gather_broad_phase(simulation)};
    for (const auto& g : gather_grains(simulation)) stored.scene.grains.push_back(g.grain);
    for (const auto& c : gather_contacts(simulation)) stored.scene.impulses.push_back(c.pair());
    return stored;
}

template <class M>
Buffer numbers_of(const Simulation<M>& simulation) {
    Outcome<M> outcome;
    outcome.grains = gather_grains(simulation);
    outcome.contacts = gather_contacts(simulation);
    outcome.walls = {simulation.walls().begin(), simulation.walls().end()};
    Buffer numbers = outcome.state();
    for (const double x : outcome.history()) numbers.push_back(x);
    return numbers;
}

template <class M>
void goes_on_exactly(const Scene<M>& scene, const AnyStepSolver<M>& solve, int ranks) {
    InProcess comm(ranks);
    Simulation<M> whole(comm, scene.settings, scene.grains, scene.impulses);
    std::vector<Stored<M>> at;  // after steps 4 and 11, which no broad phase follows
    int phases = 0;
    for (int step = 1; step <= 41; ++step) {
        whole.step(solve);
        if (step == 4 || step == 11) at.push_back(store(whole));
        if (step == 4 || step == 11) phases += whole.broad_phase().steps_since();
    }
    CHECK(phases > 1);
    const Buffer expected = numbers_of(whole);

    // from the first to the second place, from there to the end; and from the first one to the end
    InProcess again(ranks);
    Simulation<M> first(again, at[0].scene.settings, at[0].scene.grains, at[0].scene.impulses, &at[0].broad_phase);
    for (int step = 5; step <= 11; ++step) first.step(solve);
    const Stored<M> then = store(first);
    CHECK(then.broad_phase.positions == at[1].broad_phase.positions);
    CHECK(then.broad_phase.offsets == at[1].broad_phase.offsets);
    CHECK((then.broad_phase.skin == at[1].broad_phase.skin &&
           then.broad_phase.steps_since == at[1].broad_phase.steps_since));
    Simulation<M> second(again, then.scene.settings, then.scene.grains, then.scene.impulses, &then.broad_phase);
    for (int step = 12; step <= 41; ++step) {
        first.step(solve);
        second.step(solve);
    }
    CHECK(first_difference(numbers_of(first), expected) == -1);
    CHECK(first_difference(numbers_of(second), expected) == -1);
}

}  // namespace

TEMPLATE_TEST_CASE("a stored simulation goes on to the last bit", "[stepping]", SmoothDisks, Spheres) {
    using M = TestType;
    for (Scene<M> scene : dense_scenes<M>()) {
        scene.settings.broad_phase_every = 7;
        INFO(scene.name);
        goes_on_exactly<M>(scene, by_nlgs<M>(SolveOptions{}.accelerated()), 1);
        goes_on_exactly<M>(scene, by_nscdd<Dcs<M>>(SolveOptions{}), 4);
        goes_on_exactly<M>(scene, by_nscdd<Ccs<M>>(SolveOptions{}.accelerated()), 3);
    }
}

TEMPLATE_TEST_CASE("a stored simulation goes on to the last bit by any partition", "[stepping]", Spheres) {
    using M = TestType;
    for (const double imbalance : {1.0, 1.1})
        for (const auto& partitioner : {by_bisection<M>(imbalance), by_metis<M>(imbalance)}) {
            INFO(partitioner.kind << " " << imbalance);
            Scene<M> scene = heap<M>(false);
            scene.settings.broad_phase_every = 7;
            scene.settings.partition = partitioner;
            goes_on_exactly<M>(scene, by_nscdd<Dcs<M>>(SolveOptions{}), 4);
        }
}

TEST_CASE("a stored simulation goes on with other subdomains, and with the phase of its broad phase", "[stepping]") {
    using M = Spheres;
    InProcess one(1), four(4);
    Scene<M> scene = squeezed_box<M>(false);
    Simulation<M> whole(one, scene.settings, scene.grains);
    const auto solve = by_nscdd<Dcs<M>>({.tolerance = 1e-8});
    for (int step = 0; step < 7; ++step) whole.step(solve);
    Stored<M> stored = store(whole);
    REQUIRE(stored.scene.settings.partition.kind == "grid");
    Simulation<M> rest(four, stored.scene.settings, stored.scene.grains, stored.scene.impulses, &stored.broad_phase);
    CHECK(rest.broad_phase().steps_since() == whole.broad_phase().steps_since());
    for (int step = 0; step < 3; ++step) {
        whole.step(solve);
        rest.step(solve);
    }
    const auto a = gather_grains(whole), b = gather_grains(rest);
    for (std::size_t g = 0; g < a.size(); ++g) CHECK((a[g].grain.position - b[g].grain.position).norm() < 1e-6);
}

TEST_CASE("a broad phase that cannot have been is refused", "[stepping]") {
    using M = SmoothDisks;
    const Scene<M> scene = heap<M>(false);
    InProcess comm(1);
    Simulation<M> simulation(comm, scene.settings, scene.grains);
    const auto refused = [&](auto&& spoil) {
        BroadPhaseState<M> broad_phase = gather_broad_phase(simulation);
        spoil(broad_phase);
        return complaint<std::invalid_argument>(
            [&] { Simulation<M>(comm, scene.settings, scene.grains, scene.impulses, &broad_phase); });
    };
    CHECK(refused([](auto&) {}) == "");
    CHECK(refused([](auto& r) { r.partition[0] = -3; }) == "");  // of another number of ranks
    CHECK(refused([](auto& r) { r.imbalance = NAN; }).find("imbalance") != std::string::npos);
    CHECK(refused([](auto& r) { r.positions.pop_back(); }) == "the last broad phase is of other grains or walls");
    CHECK(refused([](auto& r) { r.offsets.push_back(1); }) == "the last broad phase is of other grains or walls");
    CHECK(refused([](auto& r) { r.positions[3][1] = NAN; }).find("not finite") != std::string::npos);
    CHECK(refused([](auto& r) { r.offsets[0] = INFINITY; }).find("not finite") != std::string::npos);
    for (const double skin : {0.0, -1.0, std::nan("")})
        CHECK(refused([&](auto& r) { r.skin = skin; }).find("skin") != std::string::npos);
    CHECK(refused([](auto& r) { r.steps_since = -1; }).find("steps since") != std::string::npos);
}

namespace {

// A bullet at x = -distance flies at a wall of touching grains of the same radius, along x = 0, which are heavy.
template <class M>
Scene<M> bullet(double distance, double radii_a_step, double restitution) {
    Scene<M> scene;
    scene.name = "bullet";
    scene.settings.h = 0.01;
    scene.settings.materials.set(0, 0, {0.0, restitution});
    const auto add = [&](double density, const typename M::Vec& x) {
        scene.grains.push_back(nscdd::make_grain<M>(static_cast<int>(scene.grains.size()), 0.5, density, x));
    };
    add(1, -distance * M::Vec::UnitX());
    scene.grains[0].velocity[0] = radii_a_step * 0.5 / scene.settings.h;
    for (int k = 0; k < (M::dim == 2 ? 5 : 25); ++k) {
        typename M::Vec x = M::Vec::Zero();
        for (int d = 1, rest = k; d < M::dim; ++d, rest /= 5) x[d] = rest % 5 - 2;
        add(1e6, x);
    }
    return scene;
}

// The words with which a step was refused, "" if none was. By NLGS, and by DCS on two ranks.
template <class M>
std::string refused(const Scene<M>& scene, int steps, int ranks) {
    return complaint<std::runtime_error>([&] {
        InProcess comm(ranks);
        run(scene, comm, steps, ranks == 1 ? by_nlgs<M>({.tolerance = 1e-8}) : by_nscdd<Dcs<M>>({.tolerance = 1e-8}));
    });
}

double step_that_would_do(const std::string& refusal) {
    const std::string before = "take h <= ";
    return std::stod(refusal.substr(refusal.find(before) + before.size()));
}

// Refused in that step for this pair, in the same words on two ranks; with the step that it asks for the scene is not
// refused for as long, and nothing passes x = 0.
template <class M>
void refused_until_fine_enough(Scene<M> scene, int steps, const std::string& pair) {
    const std::string said = refused(scene, steps, 1);
    CHECK(said.starts_with("step " + std::to_string(steps) + ": " + pair + " pass into or through each other"));
    CHECK(refused(scene, steps, 2) == said);
    CHECK(refused(scene, steps - 1, 1) == "");
    const double h = step_that_would_do(said);
    CHECK(h < scene.settings.h);
    const double time = steps * scene.settings.h;
    scene.settings.h = h;
    for (const int ranks : {1, 2}) {
        CHECK(refused(scene, std::min(2000, static_cast<int>(std::ceil(time / h))), ranks) == "");
        InProcess comm(ranks);
        Simulation<M> simulation(comm, scene.settings, scene.grains);
        const auto solve = by_nscdd<Dcs<M>>({.tolerance = 1e-8});
        for (int step = 0; step < std::min(2000, static_cast<int>(std::ceil(2 * time / h))); ++step)
            simulation.step(solve);
        CHECK(gather_grains(simulation)[0].grain.position[0] < 0);
    }
}

}  // namespace

TEMPLATE_TEST_CASE("grains that pass through each other within a step are refused, with the step that would do",
                   "[stepping]", SmoothDisks, Spheres) {
    using M = TestType;
    const std::string hit = M::dim == 2 ? "grain 0 and grain 3" : "grain 0 and grain 13";
    for (const double restitution : {0.5, 1.0}) {
        INFO("e = " << restitution);
        // a quarter of a step before it touches when detected in step 2, then deep inside, or beyond
        for (const double radii : {4.4, 5.0, 5.5, 40.0})
            refused_until_fine_enough(bullet<M>(1.05 + 1.75 * radii * 0.5, radii, restitution), 2, hit);
    }
    // before the first detection, with e = 0 as well
    for (const double radii : {12.0, 1e4})
        for (const double restitution : {0.0, 0.5}) refused_until_fine_enough(bullet<M>(2, radii, restitution), 1, hit);
}

TEMPLATE_TEST_CASE("without restitution nothing that was detected is passed, at 1e4 radii a step", "[stepping]",
                   SmoothDisks, Spheres) {
    using M = TestType;
    for (const double distance : {2510.0, 4000.0, 7000.0, 12600.0})
        for (const int ranks : {1, 2}) {
            INFO(distance << ", ranks: " << ranks);
            Scene<M> scene = bullet<M>(distance, 1e4, 0);
            scene.grains.resize(2);
            scene.grains[1].position = 0.05 * M::Vec::UnitY();
            for (int d = 1; d < M::dim; ++d)  // a corridor too narrow to fly past it
                for (const double sign : {1.0, -1.0}) {
                    auto& side = scene.settings.walls.emplace_back();
                    side.normal = sign * M::Vec::Unit(d);
                    side.offset = -0.6;
                }
            InProcess comm(ranks);
            Simulation<M> simulation(comm, scene.settings, scene.grains);
            const auto solve = by_nscdd<Dcs<M>>(SolveOptions{.tolerance = 1e-6}.accelerated());
            for (int step = 0; step < 6; ++step) CHECK(simulation.step(solve).solve.converged);
            const auto grains = gather_grains(simulation);
            CHECK(grains[0].grain.position[0] < grains[1].grain.position[0] - 0.9);
        }
}

TEST_CASE("grains and walls that pass each other within a step are refused", "[stepping]") {
    using M = SmoothDisks;
    for (const double restitution : {0.0, 0.5}) {
        Scene<M> scene = bullet<M>(20, 5, restitution);
        scene.grains.resize(1);
        auto& wall = scene.settings.walls.emplace_back();
        wall.normal = {-1, 0};
        // detected half a radius and more before the plane in step 8, then as far beyond
        const std::string said = refused(scene, 8, 1);
        if (restitution == 0) {
            CHECK(said == "");
            scene.grains[0].velocity[0] *= 100;  // now before the first detection
        }
        refused_until_fine_enough(scene, restitution == 0 ? 1 : 8, "grain 0 and wall 0");
    }
}

TEST_CASE("where a pair overlaps already, the step that would do is shorter than the present one", "[stepping]") {
    Scene<SmoothDisks> scene = bullet<SmoothDisks>(0.54, 1, 1.0);  // 8 % of its radius beyond the plane
    scene.grains.resize(1);
    scene.settings.walls.emplace_back().normal = {-1, 0};
    scene.settings.h = 0.03;
    scene.grains[0].position[0] = -0.46;
    scene.grains[0].velocity[0] = 1;
    const std::string said = refused(scene, 1, 1);
    CHECK(said.starts_with("step 1: grain 0 and wall 0 pass into or through each other"));
    // 10 % are allowed: it goes the 2 % of 0.5 m in 0.01 s, and moves for h/2 before it is seen; said in two digits
    CHECK(step_that_would_do(said) <= 0.02);
    CHECK(step_that_would_do(said) > 0.018);
}

TEST_CASE("a refusal is data, and its step does for pairs that come later too", "[stepping]") {
    using M = SmoothDisks;
    Scene<M> scene = bullet<M>(1, 1, 0.5);
    scene.grains.resize(2);
    scene.settings.walls.emplace_back().normal = {-1, 0};
    scene.settings.gravity.setZero();
    scene.settings.h = 0.1;
    // the first is 0.06 deep after a step, where 0.05 are allowed; the second, four times as fast, two steps later
    const double gaps[] = {0.04, 0.85}, speeds[] = {1, 4};
    for (std::size_t g = 0; g < 2; ++g) {
        scene.grains[g].position = {-0.5 - gaps[g] - 0.5 * scene.settings.h * speeds[g], 5.0 * double(g)};
        scene.grains[g].velocity.setZero();
        scene.grains[g].velocity[0] = speeds[g];
    }
    const auto refused_by = [](const Scene<M>& one, int steps) -> std::optional<StepRefused::Refusal> {
        InProcess comm(2);
        try {
            run(one, comm, steps, by_nscdd<Dcs<M>>({.tolerance = 1e-8}));
        } catch (const StepRefused& refused) {
            CHECK(refused.what() == StepRefused::describe(refused.refusal));
            return refused.refusal;
        }
        return {};
    };
    const std::optional<StepRefused::Refusal> first = refused_by(scene, 1);
    REQUIRE(first);
    CHECK(first->step == 1);
    CHECK(first->i == 0);
    CHECK(first->j == -1);
    CHECK(first->h == Approx(0.05 / 4));
    const std::vector<std::string> names{"lid"};
    CHECK(StepRefused::describe(*first, names) ==
          "step 1: grain 0 and wall 'lid' pass into or through each other within the step: take h <= 0.012 s");
    scene.settings.h = first->h;
    CHECK_FALSE(refused_by(scene, 100));
    CHECK(StepRefused::describe({.step = 3, .i = 1, .j = 2, .overlap = 2.034, .allowed = 0.1}) ==
          "step 3: grain 1 and grain 2 overlap by 210 % of a radius (at most 10 %)");
}

TEMPLATE_TEST_CASE("passing by, grazing, sliding and resting are not refused", "[stepping]", SmoothDisks, Spheres) {
    using M = TestType;
    for (const double restitution : {0.0, 0.5, 1.0})
        for (const double offset : {0.97, 1.0, 1.5}) {  // 6 % of a radius, touching, free
            Scene<M> scene = bullet<M>(5, 5, restitution);
            if (restitution == 0 && offset < 1) continue;  // that is an ordinary contact
            scene.grains.resize(2);
            scene.grains[1].position = offset * M::Vec::UnitY();
            INFO("e = " << restitution << ", offset " << offset);
            CHECK(refused(scene, 10, 1) == "");
        }
    for (Scene<M> scene : {heap<M>(false), squeezed_box<M>(false)}) {
        INFO(scene.name);
        scene.settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.3});
        CHECK(refused(scene, 150, 1) == "");
    }
}
