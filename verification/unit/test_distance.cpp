// The two statements on a converged step: gaps for which it is exact, and the distance to an answer by component.
#include <Eigen/Eigenvalues>

#include "nscdd/iterate/convergence_test.hpp"
#include "random_scenes.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

constexpr int row = 60, column = 150;
constexpr double row_step = 1e-3;

// Disks without friction: a column, and beside it a row whose disks are to close by the same in the third step.
SimulationSettings<SmoothDisks> row_settings() {
    SimulationSettings<SmoothDisks> settings{.materials = smooth<SmoothDisks>()};
    settings.h = row_step;
    settings.gravity = {0, -10};
    settings.walls.resize(1);
    settings.walls[0].normal = {0, 1};
    return settings;
}
std::vector<Grain<SmoothDisks>> row_beside_column() {
    std::vector<Grain<SmoothDisks>> grains;
    for (int k = 0; k < row; ++k) {
        grains.push_back(make_grain<SmoothDisks>(k, 0.5, 1.0, {200 + k * (1 + 5e-7), 0.5}));
        grains.back().velocity[0] = -2e-4 * k;
    }
    for (int k = 0; k < column; ++k) grains.push_back(make_grain<SmoothDisks>(row + k, 0.5, 1.0, {0.0, 0.5 + k}));
    return grains;
}

template <class M>
std::vector<typename M::Velocity> velocities(const Simulation<M>& simulation) {
    std::vector<typename M::Velocity> all;
    for (const auto& gathered : gather_grains(simulation)) all.push_back(gathered.grain.velocity);
    return all;
}

// |V - V*|_M / |V* - V_free|_M of the grains from `begin` up to `end`, all of one mass.
template <class M>
double distance(const std::vector<typename M::Velocity>& v, const std::vector<typename M::Velocity>& answer,
                const std::vector<typename M::Velocity>& free, std::size_t begin, std::size_t end) {
    double far = 0, change = 0;
    for (std::size_t k = begin; k < end; ++k) {
        far += (v[k] - answer[k]).squaredNorm();
        change += (answer[k] - free[k]).squaredNorm();
    }
    return std::sqrt(far / change);
}

}  // namespace

// Ten iterations were taken for an answer: the column fills norms of the scene, and a row that begins to touch has no
// impulses that any measure of work could weigh.
TEST_CASE("a row that begins to touch is not done before it has stopped", "[distance]") {
    using M = SmoothDisks;
    const auto begun = [](Communicator& comm) {
        Simulation<M> simulation(comm, row_settings(), row_beside_column());
        for (int step = 0; step < 2; ++step)
            simulation.step([](std::span<Subdomain<M>> parts, Communicator& c, PhaseSeconds& seconds) {
                if (c.size() == 1) return by_newton<M>({.tolerance = 1e-11})(parts, c, seconds);
                return by_nscdd<Dcs<M>>(
                    SolveOptions{.tolerance = 1e-9, .bounds = {.max_velocity_error = 1e-6}, .max_iterations = 100000}
                        .accelerated())(parts, c, seconds);
            });
        return simulation;
    };
    InProcess alone(1);
    auto exact = begun(alone);
    std::vector<M::Velocity> free = velocities(exact);
    for (auto& v : free) v += row_step * M::Vec(0, -10);
    REQUIRE(exact.step(by_newton<M>({.tolerance = 1e-11})).solve.converged);
    const auto answer = velocities(exact);
    for (const Scheme scheme : {Scheme::nlgs, Scheme::dcs, Scheme::ccs})
        for (const bool accelerated : {false, true})
            for (const int ranks : {1, 4}) {
                if (scheme == Scheme::nlgs && ranks > 1) continue;
                const SolveOptions options = accelerated ? SolveOptions{}.accelerated() : SolveOptions{};
                InProcess comm(ranks);
                auto simulation = begun(comm);
                const StepReport report = simulation.step(scheme == Scheme::nlgs  ? by_nlgs<M>(options)
                                                          : scheme == Scheme::dcs ? by_nscdd<Dcs<M>>(options)
                                                                                  : by_nscdd<Ccs<M>>(options));
                CAPTURE(accelerated, ranks, report.solve.iterations, report.solve.distance);
                REQUIRE(report.solve.converged);
                const auto v = velocities(simulation);
                CHECK(distance<M>(v, answer, free, 0, row) <= 0.3);
                CHECK(distance<M>(v, answer, free, row, row + column) <= 0.3);
                CHECK(report.solve.iterations > 10);
                CHECK(report.solve.distance <= 0.3);
            }
}

// A flat arch hardly moves in a sweep, while its feet settle at once: the line from the start ends where they do.
TEST_CASE("a flat arch beside a fast disk is not done before it carries", "[distance]") {
    using M = SmoothDisks;
    for (const double slope : {0.01, 0.03}) {
        SimulationSettings<M> settings{.materials = smooth<M>()};
        settings.h = 1e-5;
        settings.walls.resize(4);
        settings.walls[0].normal = {0, 1};
        settings.walls[1].normal = {1, 0};
        settings.walls[2].normal = {-1, 0};
        settings.walls[3].normal = {0, -1};
        const double half = 2 * std::cos(slope);
        settings.walls[1].offset = -1;
        settings.walls[2].offset = -(2 * half + 1);
        settings.walls[3].offset = -100;
        std::vector<Grain<M>> grains{
            make_grain<M>(0, 1.0, 1.0, {0, 1}), make_grain<M>(1, 1.0, 1.0, {half, 1 + 2 * std::sin(slope)}),
            make_grain<M>(2, 1.0, 1.0, {2 * half, 1}), make_grain<M>(3, 1.0, 1.0, {half, 98.995})};
        for (auto& grain : grains) grain.velocity = {0, -1};
        grains[3].velocity = {0, 1000};
        const auto free = [&] {
            std::vector<M::Velocity> all;
            for (const auto& grain : grains) all.push_back(grain.velocity);
            return all;
        }();
        const auto solved = [&](const AnyStepSolver<M>& solver, int ranks = 1) {
            InProcess comm(ranks);
            Simulation<M> simulation(comm, settings, grains);
            REQUIRE(simulation.step(solver).solve.converged);
            return velocities(simulation);
        };
        const auto answer = solved(by_newton<M>({.tolerance = 1e-12}));
        CAPTURE(slope);
        CHECK(distance<M>(answer, free, answer, 0, 3) == Approx(1));
        CHECK(distance<M>(solved(by_nlgs<M>({})), answer, free, 0, 3) <= 0.3);
        CHECK(distance<M>(solved(by_gradient<M>({}, Descent::spectral)), answer, free, 0, 3) <= 0.3);
        CHECK(distance<M>(solved(by_nscdd<Dcs<M>>({}), 3), answer, free, 0, 3) <= 0.3);
    }
}

TEMPLATE_TEST_CASE("what is asked of a body is the least change that does it", "[distance]", SmoothDisks,
                   FrictionSpheres) {
    using M = TestType;
    Random random(5);
    for (int k = 0; k < 3000; ++k) {
        detail::Asked<M> asked;
        const int contacts = 1 + k % 4;
        const double flat = k % 3 == 0 ? 1 : std::pow(10.0, -uniform(random, 0, 4));  // 0: they lie in one line
        const typename M::Vec line = random_unit<M>(random);
        for (int c = 0; c < contacts; ++c) {
            typename M::Vec normal = line + flat * random_unit<M>(random);
            if (k % 5 == 0) normal = (c % 2 ? -1 : 1) * line;
            normal.normalize();
            asked.add(normal * normal.transpose(), uniform(random, -1, 1) * normal, 1);
        }
        Eigen::SelfAdjointEigenSolver<typename detail::Asked<M>::Matrix> axes(asked.held);
        double square = 0;
        bool clear = true;  // no eigenvalue is nearly lost in round-off
        for (int d = 0; d < M::dim; ++d) {
            clear &= !(axes.eigenvalues()[d] > 1e-14 && axes.eigenvalues()[d] < 1e-11);
            if (const double value = axes.eigenvalues()[d]; value > 1e-11)
                square += std::pow(axes.eigenvectors().col(d).dot(asked.miss) / value, 2);
        }
        CAPTURE(k, contacts, flat, axes.eigenvalues().transpose());
        if (clear) CHECK(asked.square() == Approx(square).epsilon(1e-2));
    }
    CHECK(detail::Asked<M>{}.square() == 0);
}

TEMPLATE_TEST_CASE("a contact satisfies its law once its velocity has changed by law_miss()", "[distance]", SmoothDisks,
                   FrictionDisks, FrictionSpheres) {
    using M = TestType;
    Random random(3);
    for (int k = 0; k < 2000; ++k) {
        Contact<M> c;
        c.normal = random_unit<M>(random);
        c.bias = uniform(random, -1, 1);
        const double rn = std::max(uniform(random, -0.5, 1), 0.0);
        if constexpr (M::friction) {
            c.friction_coefficient = uniform(random, 0, 1);
            typename M::Vec t = random_unit<M>(random);
            t -= t.dot(c.normal) * c.normal;
            const double share = std::min(uniform(random, 0, 2), 1.0);  // half of them at the edge of the cone
            c.r = rn * c.normal + share * c.friction_coefficient * rn * t.normalized();
        } else {
            c.r[0] = rn;
        }
        const auto v = random_vector<typename M::Impulse>(random);
        const typename M::Impulse miss = detail::law_miss<M>(c, v, 1 / 1.3);
        const typename M::Impulse next = solve_contact<M>(c, v + miss, 1.3, 0.7);
        CAPTURE(k, rn, miss.norm());
        CHECK((next - c.r).norm() <= 1e-7);
        CHECK(miss.norm() <= (v.norm() + std::abs(c.bias)) * (1 + 1e-12));
        if ((solve_contact<M>(c, v, 1.3, 0.7) - c.r).norm() > 1e-6) CHECK(miss.norm() > 0);
    }
}

TEST_CASE("an impulse of round-off holds no open contact closed", "[distance]") {
    Contact<FrictionDisks> c;
    c.normal = {1, 0};
    c.friction_coefficient = 0.5;
    c.r = {1e-13, 0};
    CHECK(detail::law_miss<FrictionDisks>(c, {0.5, 2}, 1).norm() == 0);
    CHECK(detail::law_miss<FrictionDisks>(c, {-0.5, 2}, 1).norm() == Approx(0.5));
    c.r = {1e-11, 0};
    CHECK(detail::law_miss<FrictionDisks>(c, {0.5, 2}, 1).norm() == Approx(std::hypot(0.5, 2)));
}

// Seen of a sphere that slides along a wall: squares of its impulse are no longer normal numbers.
TEST_CASE("an impulse of round-off slides", "[distance]") {
    Contact<FrictionDisks> c;
    c.normal = {1, 0};
    c.friction_coefficient = 0.5;
    c.r = {1e-158, -0.5e-158 * (1 - 1e-8)};
    CHECK(detail::law_miss<FrictionDisks>(c, {1e-172, 0.7}, 1).norm() == 0);
    CHECK(detail::law_miss<FrictionDisks>(c, {-1e-9, 0.7}, 1).norm() == Approx(1e-9));
    c.r *= 1e150;
    CHECK(detail::law_miss<FrictionDisks>(c, {1e-172, 0.7}, 1).norm() == Approx(0.7));
}

TEMPLATE_TEST_CASE("components and estimate are the same on any number of subdomains", "[distance]", FrictionDisks,
                   SmoothSpheres, FrictionSpheres) {
    using M = TestType;
    for (const bool driven : {false, true}) {
        std::vector<detail::DistanceEstimate> by_one;  // of each attempt at the step
        for (const int ranks : {1, 2, 5, 16}) {
            CAPTURE(driven, ranks);
            Random random(11);
            auto grains = shaken_lattice<M>(random, 4);
            for (auto& grain : grains)
                if (grain.id % 5 == 0) grain.position[0] += 20;  // a second cloud, in pieces
            auto settings = lattice_settings<M>(4, driven);
            settings.walls[1].offset -= 30;
            InProcess comm(ranks);
            Simulation<M> simulation(comm, settings, grains);
            std::size_t attempt = 0;
            simulation.step([&](std::span<Subdomain<M>> parts, Communicator& c, PhaseSeconds&) {
                std::vector<detail::DistanceSums<M>> sums(parts.size());
                const auto impulse = [](const Subdomain<M>& part, Contact<M>& contact, bool wall, double size) {
                    const int i = part.grains[static_cast<std::size_t>(contact.i)].id,
                              j = wall ? -1 - contact.j : part.grains[static_cast<std::size_t>(contact.j)].id;
                    const double rn = size * (1 + std::abs(std::sin(i + j + 0.1 * i * j)));
                    if constexpr (M::friction)
                        contact.r = rn * contact.normal;
                    else
                        contact.r[0] = rn;
                };
                // velocities of an iterate that every number of subdomains has, glued
                const auto set = [&](double size) {
                    for (std::size_t k = 0; k < parts.size(); ++k) {
                        for (auto& contact : parts[k].problem.contacts) impulse(parts[k], contact, false, size);
                        for (auto& contact : parts[k].problem.wall_contacts) impulse(parts[k], contact, true, size);
                        sums[k].set_velocities(parts[k].problem);
                        parts[k].sweeper.load(parts[k].problem);
                    }
                    Dcs<M> scheme;
                    scheme.setup(parts, c);
                    detail::glue<M>(scheme, parts, c);
                    const std::size_t walls = parts[0].problem.walls.size();
                    const std::span<const double> speeds = reduce(c, walls, [&](std::size_t k) {
                        Buffer own(walls, 0.0);
                        for (std::size_t w = 0; w < parts[k].wall_active.size(); ++w)
                            if (parts[k].wall_active[w]) own[w] = parts[k].problem.walls[w].speed;
                        return own;
                    });
                    for (auto& part : parts) {
                        part.sweeper.store(part.problem);
                        for (std::size_t w = 0; w < part.wall_touched.size(); ++w)
                            if (part.wall_touched[w])
                                part.problem.walls[w].speed = speeds[w] / part.problem.wall_copies(w);
                    }
                };
                for (std::size_t k = 0; k < parts.size(); ++k) {
                    auto& problem = parts[k].problem;  // no impulses yet: V_free
                    sums[k].begin(problem, detail::free_velocities(problem));
                }
                set(1e-3);
                for (std::size_t k = 0; k < parts.size(); ++k) sums[k].mark(parts[k].problem);
                set(2e-3);
                for (std::size_t k = 0; k < parts.size(); ++k) sums[k].add_contacts(parts[k].problem, nullptr);
                detail::add_asked<M>(parts, c, sums);
                for (std::size_t k = 0; k < parts.size(); ++k) sums[k].add_bodies(parts[k].problem);
                const ResidualParts residual = reduce<ResidualParts>(
                    c, [&](std::size_t k) { return residual_parts(parts[k].problem, sums[k].free()); });
                detail::JoinedComponents<M> joined({parts.begin(), parts.end()}, c, sums);
                const detail::DistanceEstimate all = joined.estimate(c, sums, residual);
                CHECK(all.worst > 0);
                CHECK(all.scene > 0);
                CHECK(all.scene < all.worst);
                CHECK(all.gap_error > 0);
                if (ranks == 1) by_one.push_back(all);
                const detail::DistanceEstimate& alone = by_one.at(attempt++);
                CHECK(all.worst == Approx(alone.worst).epsilon(1e-9));
                CHECK(all.scene == Approx(alone.scene).epsilon(1e-9));
                CHECK(all.energy_gain == Approx(alone.energy_gain).epsilon(1e-9));
                CHECK(all.gap_error == Approx(alone.gap_error).epsilon(1e-9));
                return SolveReport{};
            });
        }
    }
}

// Impulses of a sphere between walls grow without end along a self-stress, or there is no answer at all.
TEST_CASE("spheres that rebound in corners with strong friction converge", "[distance]") {
    using M = FrictionSpheres;
    for (const int ranks : {1, 3}) {
        SolveOptions options = SolveOptions{}.accelerated();
        options.max_newton_contacts = 1000;
        Random random(5);
        auto grains = random_grains<M>(random, 20, 3.0, 0.3, 0.5);
        for (auto& grain : grains) grain.velocity = random_vector<typename M::Velocity>(random, 2);
        SimulationSettings<M> settings;
        settings.h = 1e-3;
        settings.gravity = {0, 0, -9.81};
        settings.walls = box_walls<M>(3.0);
        settings.materials.set(0, 0, {.friction = 0.8, .restitution = 0.5});
        InProcess comm(ranks);
        Simulation<M> simulation(comm, settings, grains);
        double newton = 0;
        int stopped = 0;
        for (int step = 0; step < 2500; ++step) {
            const SolveReport report = simulation
                                           .step(ranks > 1 ? by_nscdd<Dcs<M>>(options, newton_where_stalled<M>())
                                                           : by_nlgs<M>(options, newton_where_stalled<M>()))
                                           .solve;
            newton += report.newton_contacts;
            stopped += !report.converged;
        }
        CHECK(stopped == 0);
        CHECK(newton > 0);
    }
}

// A sphere of a hundredth in size lands on one that leans on a wall. Sweeps go round in a circle and Newton's method
// fails; half corrections get there.
TEST_CASE("a small sphere that lands on one in a corner, with friction 10, stops", "[distance]") {
    using M = FrictionSpheres;
    SimulationSettings<M> settings;
    settings.h = 0.002;
    settings.gravity = {0, 0, -10};
    settings.materials.set(0, 0, {.friction = 10});
    settings.walls.resize(2);
    settings.walls[0].normal = {0, 0, 1};
    settings.walls[1].normal = {1, 0, 0}, settings.walls[1].offset = -0.53;
    std::vector<Grain<M>> grains{
        make_grain<M>(0, 0.5, 1, {-0.53 + 0.5, 0.03834969125424846, 0.5000707766873761}),
        make_grain<M>(1, 0.01, 1, {-0.024317444959049774, 0.026196379030781952, 1.009897870755974})};
    grains[0].velocity << 0, -0.06673142880287379, -0.026769950412996613, -0.7021923310010916, -0.1464600991740066,
        -0.13346285760574758;
    grains[1].velocity << 0.030551227904395985, 0.1280801699463003, -0.021741196238193056, 15.553223345403683,
        10.557725973644818, 0.31792314762738466;
    const auto step = [&](const AnyStepSolver<M>& solver) {
        InProcess comm(1);
        return Simulation<M>(comm, settings, grains).step(solver).solve;
    };
    SolveOptions options = SolveOptions{}.accelerated();
    CHECK_FALSE(step(by_nlgs<M>(options)).converged);
    options.max_newton_contacts = 1000;
    CHECK_THROWS_AS(by_nlgs<M>(options), std::invalid_argument);  // nothing to hand over to
    const SolveReport report = step(by_nlgs<M>(options, newton_where_stalled<M>()));
    CHECK(report.converged);
    CHECK(report.newton_contacts == 3);

    const SolveReport failed = step(by_newton<M>({}));
    CHECK_FALSE(failed.converged);
    CHECK(failed.distance > 0.3);  // and says so
}

// What bears the sphere has 1e-9 of its mass each: sweeps get nowhere, and Newton's method takes over.
TEST_CASE("steps of a sphere on 81 of a thousandth of its radius converge", "[distance]") {
    using M = FrictionSpheres;
    constexpr double small = 1e-3;
    SimulationSettings<M> settings;
    settings.h = 1e-3;
    settings.gravity = {0, 0, -10};
    settings.materials.set(0, 0, {.friction = 0.3});
    settings.walls.resize(1);
    settings.walls[0].normal = {0, 0, 1};
    std::vector<Grain<M>> grains{make_grain<M>(0, 1, 1, {0, 0, 1 + 2 * small})};
    for (int k = 0; k < 81; ++k)
        grains.push_back(make_grain<M>(k + 1, small, 1, {2.2 * small * (k % 9 - 4), 2.2 * small * (k / 9 - 4), small}));
    SolveOptions options = SolveOptions{}.accelerated();
    options.max_newton_contacts = 1000;
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, grains);
    double newton = 0;
    for (int step = 0; step < 3; ++step) {
        const SolveReport report = simulation.step(by_nlgs<M>(options, newton_where_stalled<M>())).solve;
        CHECK(report.converged);
        newton += report.newton_contacts;
    }
    CHECK(newton > 0);
}
