// The kernel in other hands: what is no problem, no option and no scene is refused by name, and what a sequential user
// need not fill may stay empty.
#include <functional>
#include <limits>
#include <thread>

#include "random_scenes.hpp"
#include "scratch.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
constexpr double weight = 10, time_step = 1e-3;  // of a body [N]; of time [s]

// Three disks or spheres of radius 1/2 and mass 1 on top of each other on wall 0, each with V_free. Nothing is filled
// that need not be.
template <class M>
ContactProblem<M> column() {
    ContactProblem<M> problem;
    problem.h = time_step;
    problem.bodies.resize(3);
    problem.walls.resize(2);
    for (auto& body : problem.bodies) {
        body.inv_mass = 1;
        if constexpr (M::friction) body.inv_inertia = M::dim == 2 ? 8 : 10;
        body.v[1] = -weight * time_step;
    }
    Contact<M> contact;
    contact.normal = M::Vec::UnitY();
    if constexpr (M::friction) {
        contact.lever_i = contact.lever_j = 0.5;
        contact.friction_coefficient = 0.3;
    }
    for (const int upper : {1, 2}) {
        contact.i = upper, contact.j = upper - 1;
        problem.contacts.push_back(contact);
    }
    contact.i = contact.j = 0;
    problem.wall_contacts.push_back(contact);
    return problem;
}

template <class M>
double normal_impulse(const Contact<M>& c) {
    if constexpr (M::friction)
        return c.r.dot(c.normal);
    else
        return c.r[0];
}

template <class M>
void check_column(const ContactProblem<M>& problem) {
    for (std::size_t k = 0; k < 2; ++k)
        CHECK(normal_impulse<M>(problem.contacts[k]) == Approx((2.0 - double(k)) * weight * time_step).epsilon(1e-8));
    CHECK(normal_impulse<M>(problem.wall_contacts[0]) == Approx(3 * weight * time_step).epsilon(1e-8));
}

// What call() is refused with.
std::string refusal(auto&& call) { return complaint<std::invalid_argument>(call); }

// "" where the text says so, else the text.
std::string lacks(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos ? "" : "not \"" + std::string(part) + "\" but \"" + text + "\"";
}

template <class Spoilt>
struct Fault {
    const char* said;
    std::function<void(Spoilt&)> spoil;
};

template <class M>
std::vector<Fault<ContactProblem<M>>> faults() {
    using Problem = ContactProblem<M>;
    std::vector<Fault<Problem>> faults{
        {"contact 0: it touches body 3, but there are 3", [](Problem& p) { p.contacts[0].i = 3; }},
        {"contact 1: it touches body -1, but there are 3", [](Problem& p) { p.contacts[1].j = -1; }},
        {"body 2147483647", [](Problem& p) { p.contacts[1].i = std::numeric_limits<int>::max(); }},
        {"wall contact 0: it touches body -7", [](Problem& p) { p.wall_contacts[0].i = -7; }},
        {"wall contact 0: it touches wall 2, but there are 2", [](Problem& p) { p.wall_contacts[0].j = 2; }},
        {"it touches wall 0, but there are 0", [](Problem& p) { p.walls.clear(); }},
        {"it touches body 1, but there are 0", [](Problem& p) { p.bodies.clear(); }},
        {"contact 1: it touches body 1 twice", [](Problem& p) { p.contacts[1].i = 1; }},
        {"contact 1: the normal", [](Problem& p) { p.contacts[1].normal.setZero(); }},
        {"contact 0: the normal", [](Problem& p) { p.contacts[0].normal *= 1.001; }},
        {"wall contact 0: the normal", [](Problem& p) { p.wall_contacts[0].normal[0] = not_a_number; }},
        {"contact 1: the bias", [](Problem& p) { p.contacts[1].bias = not_a_number; }},
        {"wall contact 0: the bias", [](Problem& p) { p.wall_contacts[0].bias = -inf; }},
        {"contact 0: the impulse", [](Problem& p) { p.contacts[0].r[0] = not_a_number; }},
        {"body 2: the velocity", [](Problem& p) { p.bodies[2].v[0] = inf; }},
        {"body 1: the inverse mass", [](Problem& p) { p.bodies[1].inv_mass = -1; }},
        {"body 1: the inverse mass", [](Problem& p) { p.bodies[1].inv_mass = inf; }},
        {"contact 0: neither side can move", [](Problem& p) { p.bodies[0].inv_mass = p.bodies[1].inv_mass = 0; }},
        {"wall contact 0: neither side can move", [](Problem& p) { p.bodies[0].inv_mass = 0; }},
        {"wall 1: the velocity", [](Problem& p) { p.walls[1].prescribed[1] = not_a_number; }},
        {"wall 0: the speed", [](Problem& p) { p.walls[0].speed = not_a_number; }},
        {"wall 1: the inverse mass", [](Problem& p) { p.walls[1].inv_mass = -1; }},
        {"the step h", [](Problem& p) { p.h = 0; }},
        {"the step h", [](Problem& p) { p.h = -1; }},
        {"the step h", [](Problem& p) { p.h = not_a_number; }},
        {"the least radius", [](Problem& p) { p.least_radius = not_a_number; }},
        {"bodies: 2 multiplicities for 3",
         [](Problem& p) {
             p.multiplicity = {1, 1};
         }},
        {"bodies 1: the multiplicity is 0",
         [](Problem& p) {
             p.multiplicity = {1, 0, 1};
         }},
        {"walls: 1 multiplicities for 2", [](Problem& p) { p.wall_multiplicity = {1}; }},
        {"walls 0: the multiplicity is -1",
         [](Problem& p) {
             p.wall_multiplicity = {-1, 1};
         }},
    };
    if constexpr (M::friction) {
        faults.push_back({"contact 0: the coefficient", [](Problem& p) { p.contacts[0].friction_coefficient = -0.1; }});
        faults.push_back(
            {"contact 0: the coefficient", [](Problem& p) { p.contacts[0].friction_coefficient = not_a_number; }});
        faults.push_back({"contact 1: a lever", [](Problem& p) { p.contacts[1].lever_j = not_a_number; }});
        faults.push_back({"body 0: the inverse inertia", [](Problem& p) { p.bodies[0].inv_inertia = -1; }});
    }
    return faults;
}

}  // namespace

TEMPLATE_TEST_CASE("a sequential user fills neither multiplicities nor a least radius", "[misuse]", FrictionDisks,
                   FrictionSpheres) {
    using M = TestType;
    for (const bool filled : {false, true}) {
        auto problem = column<M>();
        if (filled) problem.multiplicity = {1, 1, 1}, problem.wall_multiplicity = {1, 1}, problem.least_radius = 0.5;
        auto swept = problem, exact = problem, descended = problem;
        const SolveReport report = nlgs(swept, {.tolerance = 1e-10});
        CHECK(report.converged);
        CHECK(report.iterations < 1000);
        check_column(swept);
        CHECK(newton_solve(exact).converged);
        check_column(exact);
        CHECK(projected_gradient(descended, {.tolerance = 1e-10}).converged);
        check_column(descended);
    }
}

TEST_CASE("a body that cannot move is as good as a wall", "[misuse]") {
    using M = FrictionDisks;
    for (const bool turns : {false, true}) {
        auto problem = column<M>();
        problem.wall_contacts.clear();
        problem.bodies[0] = {};
        problem.bodies[0].inv_inertia = turns ? 8 : 0;
        for (const int window : {0, 2}) {
            auto copy = problem;
            CHECK(nlgs(copy, {.tolerance = 1e-12, .window = window}).converged);
            CHECK(copy.contacts[0].r[1] == Approx(2 * weight * time_step).epsilon(1e-8));
            CHECK(copy.bodies[0].v.isZero(0));
            CHECK(std::abs(copy.bodies[1].v[1]) <= 1e-12);
        }
    }
}

TEMPLATE_TEST_CASE("what is no contact problem is refused by name", "[misuse]", FrictionDisks, FrictionSpheres) {
    using M = TestType;
    for (const auto& fault : faults<M>()) {
        INFO(fault.said);
        auto problem = column<M>();
        REQUIRE_NOTHROW(validate(problem));
        fault.spoil(problem);
        auto swept = problem, exact = problem, descended = problem;
        CHECK(lacks(refusal([&] { validate(problem); }), fault.said) == "");
        CHECK(lacks(refusal([&] { nlgs(swept, {}); }), fault.said) == "");
        CHECK(lacks(refusal([&] { newton_solve(exact); }), fault.said) == "");
        CHECK(lacks(refusal([&] { projected_gradient(descended, {}); }), fault.said) == "");
    }
    auto large = column<M>();  // sums of it overflow, no number of it does
    large.contacts[0].bias = large.wall_contacts[0].bias = 1e308;
    large.contacts[0].r[0] = large.wall_contacts[0].r[0] = 1e308;
    CHECK_NOTHROW(validate(large));
}

TEST_CASE("what is no local problem is refused by name", "[misuse]") {
    using Local = DelassusProblem<2>;
    struct Given {
        Local problem;
        std::vector<Local::Vec> r;
    };
    const auto good = [] {
        Given given;
        given.problem.q = {Local::Vec(-1, 0.1), Local::Vec(-2, 0)};
        given.problem.friction = {0.3, 0.3};
        given.problem.set_blocks({{0, 0, Local::Block::Identity()},
                                  {1, 1, Local::Block::Identity()},
                                  {0, 1, 0.1 * Local::Block::Identity()},
                                  {1, 0, 0.1 * Local::Block::Identity()}});
        given.r.assign(2, Local::Vec::Zero());
        return given;
    };
    const std::vector<Fault<Given>> faults{
        {"coefficients of friction: 1 of them, needs 2", [](Given& g) { g.problem.friction.pop_back(); }},
        {"contact 1: the coefficient", [](Given& g) { g.problem.friction[1] = -1; }},
        {"contact 0: the coefficient", [](Given& g) { g.problem.friction[0] = not_a_number; }},
        {"coefficients of friction: 2 of them, needs 3",
         [](Given& g) {
             g.problem.q.push_back({0, 0});
         }},
        {"contact 1: q", [](Given& g) { g.problem.q[1][0] = inf; }},
        {"impulses r: 0 of them, needs 2", [](Given& g) { g.r.clear(); }},
        {"contact 0: the impulse", [](Given& g) { g.r[0][1] = not_a_number; }},
        {"ends of the rows of W", [](Given& g) { g.problem.row_begin.pop_back(); }},
        {"ends of the rows of W", [](Given& g) { g.problem.row_begin.clear(); }},
        {"contact 0: its row of W", [](Given& g) { g.problem.row_begin[1] = 9; }},
        {"contact 0: its row of W", [](Given& g) { g.problem.row_begin[1] = -1; }},
        {"contact 0: its row of W does not begin", [](Given& g) { g.problem.row_begin[0] = -1; }},
        {"blocks within the rows of W", [](Given& g) { g.problem.row_begin[2] = 5; }},
        {"diagonal blocks of W", [](Given& g) { g.problem.diagonal.pop_back(); }},
        {"contact 1: its diagonal block", [](Given& g) { g.problem.diagonal[1] = 2; }},
        {"contact 0: its diagonal block", [](Given& g) { g.problem.diagonal[0] = -1; }},
        {"contact 0: a column of W", [](Given& g) { g.problem.columns[1] = 2; }},
        {"contact 1: a column of W", [](Given& g) { g.problem.columns[2] = -1; }},
        {"contact 1: the columns", [](Given& g) { g.problem.columns[2] = 1; }},
        {"columns of the blocks of W", [](Given& g) { g.problem.columns.pop_back(); }},
        {"contact 1: a block of W", [](Given& g) { g.problem.blocks[2](0, 1) = not_a_number; }},
    };
    for (const auto& fault : faults) {
        INFO(fault.said);
        Given given = good();
        REQUIRE(block_nlgs(given.problem, given.r).converged);
        fault.spoil(given);
        CHECK(lacks(refusal([&] { block_nlgs(given.problem, given.r); }), fault.said) == "");
        CHECK(lacks(refusal([&] { newton_solve(given.problem, given.r, NewtonOptions{}); }), fault.said) == "");
        const auto measure = [](const auto&) { return 0.0; };
        const auto descend = [&] { projected_gradient(given.problem, given.r, {}, Descent::spectral, measure); };
        CHECK(lacks(refusal(descend), fault.said) == "");
    }
    for (const auto& [row, column] : {std::pair(2, 0), std::pair(0, -1)}) {
        const Local::Entry stray{row, column, Local::Block::Identity()};
        CHECK(lacks(refusal([&] { good().problem.set_blocks({stray}); }), "but there are 2 contacts") == "");
    }
}

TEST_CASE("options without an end are refused", "[misuse]") {
    using M = FrictionDisks;
    const auto by = [](SolveOptions options) {
        return refusal([&] {
            auto problem = column<M>();
            nlgs(problem, options);
        });
    };
    for (const double bad : {not_a_number, -1.0}) {
        CHECK(lacks(by({.tolerance = bad}), "tolerance") == "");
        CHECK(lacks(by({.bounds = {.max_velocity_error = bad}}), "velocity_error") == "");
        CHECK(lacks(by({.bounds = {.max_energy_gain = bad}}), "energy_gain") == "");
        CHECK(lacks(by({.bounds = {.max_penetration = bad}}), "penetration") == "");
        CHECK(lacks(by({.bounds = {.max_gap_error = bad}}), "gap_error") == "");
        CHECK(lacks(by({.bounds = {.max_distance = bad}}), "distance") == "");
    }
    for (const double bad : {not_a_number, 0.0, -1.0, 2.0}) CHECK(lacks(by({.relaxation = bad}), "relaxation") == "");
    for (const int bad : {0, -1}) CHECK(lacks(by({.sweeps = bad}), "sweeps") == "");
    CHECK(lacks(by({.check_every = -1}), "check_every") == "");
    CHECK(lacks(by({.max_iterations = -1}), "max_iterations") == "");
    CHECK(lacks(by({.window = -1}), "window") == "");
    CHECK(lacks(by({.window = 1000}), "window") == "");

    const auto exactly = [](NewtonOptions options) {
        return refusal([&] {
            auto problem = column<M>();
            newton_solve(problem, options);
        });
    };
    for (const double bad : {not_a_number, -1.0}) {
        CHECK(lacks(exactly({.tolerance = bad, .warm_sweeps = 0}), "tolerance") == "");
        CHECK(lacks(exactly({.bounds = {.max_velocity_error = bad}, .warm_sweeps = 0}), "velocity_error") == "");
        CHECK(lacks(exactly({.bounds = {.max_energy_gain = bad}, .warm_sweeps = 0}), "energy_gain") == "");
        CHECK(lacks(exactly({.bounds = {.max_penetration = bad}, .warm_sweeps = 0}), "penetration") == "");
        CHECK(lacks(exactly({.bounds = {.max_gap_error = bad}, .warm_sweeps = 0}), "gap_error") == "");
        CHECK(lacks(exactly({.bounds = {.max_distance = bad}, .warm_sweeps = 0}), "distance") == "");
    }
    CHECK(lacks(exactly({.max_iterations = -1}), "negative") == "");
    const DelassusProblem<2> none;
    std::vector<DelassusProblem<2>::Vec> r;
    for (const BlockOptions bad : {BlockOptions{.tolerance = not_a_number}, BlockOptions{.check_every = 0}})
        CHECK(lacks(refusal([&] { block_nlgs(none, r, bad); }), "tolerance") == "");
    for (const int bad : {-1, 9}) CHECK(lacks(refusal([&] { block_nlgs(none, r, {.window = bad}); }), "window") == "");
}

TEST_CASE("what is no scene is refused by name", "[misuse]") {
    using M = FrictionDisks;
    const std::vector<Grain<M>> grains{make_grain<M>(0, 0.5, 1.0, {0, 0.5}), make_grain<M>(1, 0.5, 1.0, {3, 0.5})};
    SimulationSettings<M> settings{.h = 1e-3};
    settings.walls.resize(1);
    settings.walls[0].normal = M::Vec::UnitY();

    InProcess two(2);
    CHECK(lacks(refusal([&] { Simulation<M>(two, settings, grains); }), "no friction is known") == "");
    settings.materials.set(0, 0, {});
    for (const detail::GridCells<2> cells :
         {detail::GridCells<2>{-2, -1}, {0, 2}, {2, 0}, {1, 1}, {1 << 30, 1 << 30}, {65536, 65536}}) {
        settings.partition = by_grid<M>(cells);
        CHECK(lacks(refusal([&] { Simulation<M>(two, settings, grains); }), "cells") == "");
    }
    settings.partition = by_grid<M>({2, 1});
    Simulation<M> simulation(two, settings, grains);
    CHECK(lacks(refusal([&] { simulation.step({}); }), "the solver is empty") == "");
    static_assert(std::is_same_v<decltype(simulation.walls()), std::span<Wall<M>>>);  // nobody can resize it
    const auto solve = by_nscdd<Dcs<M>>({});
    const auto spoilt = [&](auto&& spoil) {
        const Wall<M> before = simulation.walls()[0];
        spoil(simulation.walls()[0]);
        const std::string text = refusal([&] { simulation.step(solve); });
        simulation.walls()[0] = before;
        return text;
    };
    CHECK(lacks(spoilt([](Wall<M>& wall) { wall.material = 99; }), "wall 0: material") == "");
    CHECK(lacks(spoilt([](Wall<M>& wall) { wall.normal.setZero(); }), "wall 0: the normal") == "");
    CHECK(lacks(spoilt([](Wall<M>& wall) { wall.driven = true; }), "wall 0: it is driven") == "");
    CHECK_NOTHROW(simulation.step(solve));
    using Problem = ContactProblem<M>;
    const auto solved_by = [&](void (*spoil)(Problem&)) {
        Simulation<M> other(two, settings, grains);
        return complaint<std::logic_error>([&] {
            other.step([&](std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
                const SolveReport report = solve(parts, comm, seconds);
                spoil(parts[1].problem);
                return report;
            });
        });
    };
    CHECK(lacks(solved_by([](Problem& p) { p.wall_contacts.clear(); }),
                "step 1, subdomain 1: contacts with walls were 1, the solver has made them 0") == "");
    CHECK(lacks(solved_by([](Problem& p) { p.contacts.resize(9); }), "subdomain 1: contacts between grains") == "");
    CHECK(lacks(solved_by([](Problem& p) { p.bodies.pop_back(); }), "subdomain 1: bodies") == "");
    CHECK(lacks(solved_by([](Problem& p) { p.walls.clear(); }), "subdomain 1: walls") == "");
    CHECK(lacks(solved_by([](Problem& p) { p.multiplicity.clear(); }), "subdomain 1: multiplicities were") == "");
    CHECK(lacks(solved_by([](Problem& p) { p.wall_contacts[0].i = 7; }),
                "step 1, subdomain 1: the solver has made wall contact 0 another one") == "");
    CHECK(lacks(solved_by([](Problem& p) { p.wall_contacts[0].j = -1; }), "made wall contact 0 another one") == "");
    const Simulation<M> moved = std::move(simulation);
    const std::function<void()> uses[]{[&] { simulation.step(solve); },
                                       [&] { measure(simulation); },
                                       [&] { observe(simulation); },
                                       [&] { gather_grains(simulation); },
                                       [&] { gather_broad_phase(simulation); },
                                       [&] { detail::last_broad_phase(simulation); },
                                       [&] { gather_contacts(simulation); }};
    for (const auto& use : uses)
        CHECK(complaint<std::logic_error>(use) == "Simulation: nothing is left of one that was moved");
    CHECK_NOTHROW(gather_broad_phase(moved));

    settings.h = 0;
    CHECK(refusal([&] { Simulation<M>(two, settings, grains); }) == "the step h of the settings has not been set");
    settings.h = -1;
    CHECK(lacks(refusal([&] { Simulation<M>(two, settings, grains); }), "the step h must be positive") == "");

    CHECK_THROWS_AS(detail::Grid<M>({0, 1}, M::Vec::Zero(), M::Vec::Ones()), std::invalid_argument);
    for (const double bad : {not_a_number, inf})
        CHECK_THROWS_AS(detail::Grid<M>({2, 1}, M::Vec::Zero(), M::Vec::Constant(bad)), std::invalid_argument);
    CHECK_THROWS_AS(detail::Grid<M>({2, 1}, M::Vec::Constant(-1e308), M::Vec::Constant(1e308)), std::invalid_argument);

    for (const int count : {-1, 0, 65536}) CHECK(lacks(refusal([&] { Materials<M>{count}; }), "materials") == "");
    Materials<M> pair(2);
    for (const auto& [a, b] : {std::pair(1, -1), std::pair(0, 2), std::pair(2, 0)})
        CHECK(lacks(refusal([&] { pair.set(a, b, {}); }), "there are 2") == "");

    CHECK(lacks(refusal([] { InProcess(0); }), "InProcess") == "");
    CHECK(lacks(refusal([] { InProcess(-1); }), "InProcess") == "");
    CHECK(lacks(refusal([] { InProcess(2, 0); }), "InProcess") == "");
    CHECK(lacks(refusal([] { InProcess(2, 3); }), "InProcess") == "");
}

TEST_CASE("a step within tasks, or beside another thread's on one communicator, is refused", "[misuse]") {
    using M = FrictionSpheres;
    SimulationSettings<M> settings{.materials = smooth<M>(), .h = 1e-3};
    settings.walls.emplace_back().normal = M::Vec::UnitY();
    const std::vector<Grain<M>> grains{make_grain<M>(0, 0.5, 1.0, {0, 0.5, 0}),
                                       make_grain<M>(1, 0.5, 1.0, {3, 0.5, 0})};
    const int threads = GENERATE(1, 2);
    InProcess comm(2, threads);
    Simulation<M> simulation(comm, settings, grains), other(comm, settings, grains);
    const AnyStepSolver<M> solve = by_nscdd<Dcs<M>>({});
    const auto refused = [&](auto&& call) {
        return lacks(complaint<std::logic_error>(call), "a communicator is called by one thread at a time");
    };
    for (const std::size_t rank : {0U, 1U})
        CHECK(refused([&] {
                  comm.each_rank([&, rank](std::size_t k) {
                      if (k == rank) simulation.step(solve);
                  });
              }) == "");
    std::vector<std::string> beside;  // what another thread is told, while the solver of this one's step runs
    simulation.step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds& seconds) {
        const std::function<void()> uses[]{[&] { other.step(solve); }, [&] { measure(other); },
                                           [&] { Simulation<M>(comm, settings, grains); }};
        for (const auto& use : uses) std::thread([&] { beside.push_back(refused(use)); }).join();
        return solve(parts, comm, seconds);
    });
    CHECK(beside == std::vector<std::string>(3));
    std::thread([&] { other.step(solve); }).join();
    CHECK(simulation.steps() == 1);
    CHECK(other.steps() == 1);
}
