// The schemes against one another: sequential NLGS, CCS and DCS, closed form, factorised and elementary.
#include <functional>

#include "../catch.hpp"
#include "../small_scenes.hpp"

using namespace nscdd;
using namespace scenes;

namespace {

constexpr SolveOptions every_iteration{.check_every = 1};
const SolveOptions accelerated = every_iteration.accelerated();

template <class M>
void check_same_bits(const Outcome<M>& a, const Outcome<M>& b) {
    CHECK(a.iterations() == b.iterations());
    CHECK(first_difference(a.history(), b.history()) == -1);
    CHECK(first_difference(a.state(), b.state()) == -1);
}

// Largest difference of a velocity (spins times radius, and speeds of walls) over the largest velocity.
template <class M>
double velocity_difference(const Outcome<M>& a, const Outcome<M>& b) {
    double difference = 0, largest = 0;
    for (std::size_t g = 0; g < a.grains.size(); ++g) {
        typename M::Velocity u = a.grains[g].grain.velocity, v = b.grains[g].grain.velocity;
        u.template tail<M::spins>() *= a.grains[g].grain.radius;
        v.template tail<M::spins>() *= a.grains[g].grain.radius;
        difference = std::max(difference, (u - v).cwiseAbs().maxCoeff());
        largest = std::max(largest, u.cwiseAbs().maxCoeff());
    }
    for (std::size_t w = 0; w < a.walls.size(); ++w)
        difference = std::max(difference, std::abs(a.walls[w].speed - b.walls[w].speed));
    return difference / largest;
}

// DCS that does something else while its first messages are under way.
struct Interrupted : CommunicationScheme<Spheres> {
    inline static std::function<void()> once;
    Dcs<Spheres> dcs;

    void setup(std::span<Subdomain<Spheres>> parts, Communicator& comm) override { dcs.setup(parts, comm); }
    std::size_t pack(Subdomain<Spheres>& part, std::size_t k) override { return dcs.pack(part, k); }
    void start() override {
        dcs.start();
        if (const auto call = std::exchange(once, nullptr)) call();
    }
    void finish(std::span<Subdomain<Spheres>> parts, Communicator& comm) override { dcs.finish(parts, comm); }
};

}  // namespace

TEMPLATE_TEST_CASE("NSCDD with one subdomain is NLGS, bit for bit", "", EVERY_MODEL) {
    for (const auto& scene : dense_scenes<TestType>()) {
        INFO(scene.name);
        const auto nlgs = run_nlgs(scene, 5, every_iteration);
        CHECK(nlgs.last().contacts > 60);
        check_same_bits(run_nscdd<Ccs, ClosedForm>(scene, 1, 5, every_iteration), nlgs);
        check_same_bits(run_nscdd<Dcs, ClosedForm>(scene, 1, 5, every_iteration), nlgs);
        check_same_bits(run_nscdd<Dcs, ClosedForm>(scene, 1, 5, accelerated), run_nlgs(scene, 5, accelerated));
    }
}

TEMPLATE_TEST_CASE("CCS and DCS with the closed form are the same, bit for bit", "", EVERY_MODEL) {
    for (const auto& scene : dense_scenes<TestType>())
        for (int ranks : {2, 3, 4, 8}) {
            INFO(scene.name << ", " << ranks << " subdomains");
            const auto ccs = run_nscdd<Ccs, ClosedForm>(scene, ranks, 5, every_iteration);
            CHECK(ccs.last().interface_grains > 0);
            check_same_bits(ccs, run_nscdd<Dcs, ClosedForm>(scene, ranks, 5, every_iteration));
            check_same_bits(run_nscdd<Ccs, ClosedForm>(scene, ranks, 5, accelerated),
                            run_nscdd<Dcs, ClosedForm>(scene, ranks, 5, accelerated));
        }
}

TEMPLATE_TEST_CASE("any number of threads gives the same bits", "", EVERY_MODEL) {
    for (const auto& scene : dense_scenes<TestType>()) {
        const auto dcs = run_nscdd<Dcs, ClosedForm>(scene, 8, 5, accelerated);
        const auto ccs = run_nscdd<Ccs, Factorised<>>(scene, 8, 5, accelerated);
        // the paper's method sweeps the rest of the contacts while messages are under way
        const SolveOptions paper{.tolerance = 0, .max_iterations = 20};
        const auto hidden = run_nscdd<Dcs, ClosedForm>(scene, 8, 5, paper);
        for (int threads : {2, 3, 8}) {
            INFO(scene.name << ", " << threads << " threads");
            check_same_bits(run_nscdd<Dcs, ClosedForm>(scene, 8, 5, accelerated, threads), dcs);
            check_same_bits(run_nscdd<Ccs, Factorised<>>(scene, 8, 5, accelerated, threads), ccs);
            check_same_bits(run_nscdd<Dcs, ClosedForm>(scene, 8, 5, paper, threads), hidden);
        }
    }
}

TEST_CASE("copies of a solver share nothing") {
    const auto scene = settled(heap<Spheres>(false), 200);
    const auto work = [&scene](const AnyStepSolver<Spheres>& solve) {
        InProcess comm(4);
        return run(scene, comm, 3, solve);
    };
    const AnyStepSolver<Spheres> solve = by_nscdd<Interrupted>(every_iteration), copy = solve;
    const auto alone = work(solve);
    CHECK(alone.steps[0].interface_grains > 0);
    Buffer amid;
    Interrupted::once = [&] { amid = work(copy).state(); };
    check_same_bits(work(solve), alone);
    CHECK(first_difference(amid, alone.state()) == -1);
}

TEMPLATE_TEST_CASE("factorised and elementary interface problems give the closed form's iterates", "", EVERY_MODEL) {
    for (const auto& scene : dense_scenes<TestType>())
        for (int ranks : {2, 4, 8})
            for (int k = 1; k <= 5; ++k) {
                INFO(scene.name << ", " << ranks << " subdomains, iteration " << k);
                const SolveOptions options{.tolerance = 0, .check_every = k, .max_iterations = k};
                const auto closed = run_nscdd<Ccs, ClosedForm>(scene, ranks, 1, options);
                CHECK(closed.iterations() == std::vector{k * closed.last().attempts});
                CHECK(closed.last().interface_grains > 0);
                CHECK(velocity_difference(closed, run_nscdd<Ccs, Factorised<>>(scene, ranks, 1, options)) <= 1e-12);
                CHECK(velocity_difference(closed, run_nscdd<Dcs, Factorised<>>(scene, ranks, 1, options)) <= 1e-12);
            }
}

TEMPLATE_TEST_CASE("factorised and elementary interface problems need as many iterations", "", EVERY_MODEL) {
    for (const auto& scene : dense_scenes<TestType>())
        for (int ranks : {2, 8}) {
            INFO(scene.name << ", " << ranks << " subdomains");
            const auto counts = run_nscdd<Ccs, ClosedForm>(scene, ranks, 4, every_iteration).iterations();
            CHECK(run_nscdd<Ccs, Factorised<>>(scene, ranks, 4, every_iteration).iterations() == counts);
            CHECK(run_nscdd<Dcs, Factorised<>>(scene, ranks, 4, every_iteration).iterations() == counts);
        }
}

TEMPLATE_TEST_CASE("more sweeps between two gluings converge in fewer iterations", "", EVERY_MODEL) {
    for (const auto& scene : dense_scenes<TestType>())
        for (int ranks : {1, 4, 8}) {
            INFO(scene.name << ", " << ranks << " subdomains");
            const auto after = [&](int sweeps) {
                return run_nscdd<Dcs, ClosedForm>(scene, ranks, 1, {.check_every = 1, .sweeps = sweeps}).last();
            };
            const StepReport first = after(1);
            const SolveReport one = first.solve, two = after(2).solve, five = after(5).solve;
            CHECK((one.converged && two.converged && five.converged));
            CHECK(two.residual <= 1e-4);
            CHECK(five.residual <= 1e-4);
            CHECK(two.iterations <= one.iterations);
            CHECK(five.iterations <= two.iterations);
            if (ranks == 1 && first.attempts == 1) {  // nothing to glue: sweeps are sweeps
                CHECK(two.iterations == (one.iterations + 1) / 2);
                CHECK(five.iterations == (one.iterations + 4) / 5);
            }
        }
}

TEMPLATE_TEST_CASE("acceleration saves half the iterations or more on any subdomains", "", EVERY_MODEL) {
    for (auto scene : dense_scenes<TestType>()) {
        scene.impulses.clear();  // a cold start
        for (int ranks : {1, 4, 8}) {
            INFO(scene.name << ", " << ranks << " subdomains");
            const auto plain = run_nscdd<Dcs, ClosedForm>(scene, ranks, 1, every_iteration).last().solve;
            const auto fast = run_nscdd<Dcs, ClosedForm>(scene, ranks, 1, accelerated).last().solve;
            CHECK((plain.converged && fast.converged));
            CHECK(2 * fast.iterations <= plain.iterations);
        }
    }
}

// There is no answer: impulses grow by the same at every sweep, up to the cap. Where acceleration ran away they were
// thousands of times too large.
TEMPLATE_TEST_CASE("acceleration does not run away where walls leave no room", "", Disks, Spheres) {
    using M = TestType;
    Scene<M> scene;
    scene.name = "jammed crystal";
    scene.settings.h = 1.0 / 128;
    scene.settings.materials.set(0, 0, {0.3, 0});
    for (int id = 0, edge = 3; id < (M::dim == 2 ? 9 : 27); ++id) {
        typename M::Vec x;
        for (int d = 0, rest = id; d < M::dim; ++d, rest /= edge) x[d] = rest % edge + 0.5;
        scene.grains.push_back(make_grain<M>(id, 0.5, 1.0, x));
    }
    for (const double side : {1.0, -1.0}) {
        Wall<M> wall;
        wall.normal = side * M::Vec::Unit(M::dim - 1);
        wall.offset = side > 0 ? 0 : -3;
        wall.velocity = 0.064 * wall.normal;
        scene.settings.walls.push_back(wall);
    }
    const SolveOptions plain{.max_iterations = 2000};
    for (int ranks : {1, 2, 3, 4}) {
        INFO(ranks << " subdomains");
        const auto largest = [&](const SolveOptions& options) {
            double impulse = 0;
            for (const auto& c : run_nscdd<Dcs, ClosedForm>(scene, ranks, 6, options).contacts)
                impulse = std::max(impulse, c.impulse.norm());
            return impulse;
        };
        // There is no one answer: the last bits decide how large.
        const double combined = largest(plain.accelerated()), once = largest(plain);
        CHECK(combined < 4 * once);
        CHECK(combined > once / 4);
    }
}

TEMPLATE_TEST_CASE("warm started, a heap at rest needs one iteration a step on any subdomains", "", Disks) {
    auto warm = settled(heap<TestType>(true), 1000);
    warm.settings.broad_phase_every = 3;  // impulses are handed on with every new decomposition
    auto cold = warm;
    cold.impulses.clear();
    for (int ranks : {1, 4, 8}) {
        INFO(ranks << " subdomains");
        const auto counts = run_nscdd<Dcs, ClosedForm>(warm, ranks, 10, every_iteration).iterations();
        CHECK(counts == std::vector(10, 1));
        CHECK(run_nscdd<Dcs, ClosedForm>(cold, ranks, 1, every_iteration).last().solve.iterations > 100);
    }
}
