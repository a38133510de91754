// Anderson acceleration: against exact answers, and the kernel's against a plain one that keeps whole vectors.
#include <Eigen/QR>

#include "../catch.hpp"
#include "random_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

template <class M>
Eigen::VectorXd impulses(const ContactProblem<M>& problem) {
    std::vector<double> all;
    detail::each_contact(
        problem, [&](const Contact<M>& c, auto) { all.insert(all.end(), c.r.data(), c.r.data() + c.r.size()); });
    return Eigen::Map<Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

template <class M>
void set_impulses(ContactProblem<M>& problem, const Eigen::VectorXd& r) {
    Eigen::Index at = 0;
    detail::each_contact(problem, [&](Contact<M>& c, auto) {
        c.r = r.segment(at, c.r.size());
        at += c.r.size();
    });
}

// Velocities from the impulses, by way of V_free.
template <class M>
void set_velocities(ContactProblem<M>& problem, const ContactProblem<M>& free) {
    for (std::size_t g = 0; g < problem.bodies.size(); ++g) problem.bodies[g].v = free.bodies[g].v;
    for (std::size_t w = 0; w < problem.walls.size(); ++w) problem.walls[w].speed = free.walls[w].speed;
    detail::apply_impulses(problem);
}

// Root of the metric times a change: W_n, times the fourth power of how much split masses make it too large, a tenth of
// it for tangential parts.
template <class M>
Eigen::VectorXd weighted(const ContactProblem<M>& problem, const Eigen::VectorXd& change) {
    Eigen::VectorXd out = change;
    Eigen::Index at = 0;
    detail::each_contact(problem, [&](const Contact<M>& c, auto kind) {
        auto part = out.segment(at, c.r.size());
        const double split = detail::delassus(problem, c, true, kind).normal,
                     whole = detail::delassus(problem, c, false, kind).normal;
        const double root = std::sqrt(split) * std::pow(split / whole, 2);
        if constexpr (M::friction) {
            const double normal = c.normal.dot(part);
            part = root * (std::sqrt(0.1) * (part - normal * c.normal) + normal * c.normal);
        } else {
            part *= root;
        }
        at += c.r.size();
    });
    return out;
}

// The same iteration by its definition: least squares over whole vectors, velocities from the impulses.
template <class M>
class ByDefinition {
  public:
    ByDefinition(const ContactProblem<M>& problem, const ContactProblem<M>& free, int window)
        : problem_(problem), free_(free), window_(window), x_(impulses(problem)) {
        prepare_contacts(problem_);
    }
    void iterate() {
        set_impulses(problem_, x_);
        set_velocities(problem_, free_);
        sweep(problem_);
        const Eigen::VectorXd g = impulses(problem_), f = weighted(problem_, g - x_);
        if (!f_.empty() && f.squaredNorm() > f_.back().squaredNorm()) f_.clear(), g_.clear();
        x_ = g;
        const auto n = static_cast<Eigen::Index>(f_.size());
        if (n > 0) {
            Eigen::MatrixXd differences(f.size(), n);
            for (Eigen::Index j = 0; j < n; ++j) differences.col(j) = f_[static_cast<std::size_t>(j)] - f;
            Eigen::VectorXd c = differences.colPivHouseholderQr().solve(-f);
            c *= std::min(1.0, 5 / c.lpNorm<1>());
            for (Eigen::Index j = 0; j < n; ++j) x_ += c[j] * (g_[static_cast<std::size_t>(j)] - g);
        }
        f_.push_back(f), g_.push_back(g);
        if (static_cast<int>(f_.size()) > window_) f_.erase(f_.begin()), g_.erase(g_.begin());
    }
    const ContactProblem<M>& problem() const { return problem_; }

  private:
    ContactProblem<M> problem_;
    const ContactProblem<M>& free_;
    int window_;
    Eigen::VectorXd x_;
    std::vector<Eigen::VectorXd> f_, g_;
};

// The problem of a second step without its warm start: velocities are V_free.
template <class M>
ContactProblem<M> cold_problem(const std::vector<Grain<M>>& grains, int side, bool driven = false) {
    Run<M> run(nlgs_alone, lattice_settings<M>(side, driven), grains);
    run.step();
    ContactProblem<M> problem;
    run.simulation.step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) {
        problem = parts[0].problem;
        for (auto& c : problem.contacts) c.r *= -1;
        for (auto& c : problem.wall_contacts) c.r *= -1;
        detail::apply_impulses(problem);
        for (auto& c : problem.contacts) c.r.setZero();
        for (auto& c : problem.wall_contacts) c.r.setZero();
        return SolveReport{};
    });
    return problem;
}

// Every other grain as a copy with half of its mass.
template <class M>
ContactProblem<M> with_split_masses(ContactProblem<M> problem) {
    for (std::size_t g = 0; g < problem.bodies.size(); g += 2) {
        problem.multiplicity[g] = 2;
        problem.bodies[g].inv_mass *= 2;
        if constexpr (M::friction) problem.bodies[g].inv_inertia *= 2;
    }
    return problem;
}

// Largest difference of velocities over the largest velocity.
template <class M>
double velocity_difference(const ContactProblem<M>& a, const ContactProblem<M>& b) {
    double difference = 0, speed = 0;
    for (std::size_t g = 0; g < a.bodies.size(); ++g) {
        difference = std::max(difference, (a.bodies[g].v - b.bodies[g].v).cwiseAbs().maxCoeff());
        speed = std::max(speed, a.bodies[g].v.cwiseAbs().maxCoeff());
    }
    for (std::size_t w = 0; w < a.walls.size(); ++w)
        difference = std::max(difference, std::abs(a.walls[w].speed - b.walls[w].speed));
    return difference / speed;
}

template <class M>
void compare_with_definition(const ContactProblem<M>& free, int window) {
    ContactProblem<M> ours = free;
    prepare_contacts(ours);
    Sweeper<M> sweeper;
    sweeper.load(ours);
    sweeper.accelerate(ours, window);
    ContactProblem<M> ordered = free;  // contacts in the order of our sweep
    if (sweeper.batched()) {
        const auto sort = [](auto& contacts, const std::vector<int>& order) {
            const auto all = contacts;
            contacts.clear();
            for (int c : order)
                if (c >= 0) contacts.push_back(all[static_cast<std::size_t>(c)]);
        };
        sort(ordered.contacts, sweeper.order());
        sort(ordered.wall_contacts, sweeper.wall_order());
    }
    ByDefinition<M> theirs(ordered, free, window);
    detail::Anderson anderson(window);
    for (int k = 0; k < 12; ++k) {
        INFO("iteration " << k << ", restarts so far " << anderson.restarts());
        detail::Anderson::Products products{};
        sweeper.sweep(ours, anderson, products);
        anderson.update(products.data());
        sweeper.store(ours);
        theirs.iterate();
        CHECK(velocity_difference(theirs.problem(), ours) <= 1e-9);
    }
}

}  // namespace

TEST_CASE("a linear iteration in n unknowns ends after n + 1 with a window of n", "[anderson]") {
    constexpr int n = 4;
    Random random(21);
    Eigen::Matrix<double, n, n> a;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) a(i, j) = uniform(random, -0.25, 0.25);
    const auto b = random_vector<Eigen::Vector<double, n>>(random);
    const Eigen::Vector<double, n> exact = (Eigen::Matrix<double, n, n>::Identity() - a).lu().solve(b);

    detail::Anderson anderson(n);
    std::vector<Eigen::Vector<double, n>> iterates(n, b), changes(n, b);
    Eigen::Vector<double, n> g = Eigen::Vector<double, n>::Zero();
    for (int k = 0; k <= n; ++k) {
        CHECK((g - exact).norm() > 1e-5);  // there is something left to do
        Eigen::Vector<double, n> x = g;
        for (int j = 0; j < n; ++j) x += anderson.coefficient(j) * (iterates[static_cast<std::size_t>(j)] - g);
        iterates[static_cast<std::size_t>(anderson.last())] = g;
        g = a * x + b;
        const Eigen::Vector<double, n> f = g - x;
        std::vector<double> products{f.dot(f)};
        for (const auto& change : changes) products.push_back(f.dot(change));
        changes[static_cast<std::size_t>(anderson.now())] = f;
        anderson.update(products.data());
        REQUIRE(anderson.restarts() == 0);
    }
    Eigen::Vector<double, n> x = g;
    for (int j = 0; j < n; ++j) x += anderson.coefficient(j) * (iterates[static_cast<std::size_t>(j)] - g);
    CHECK((x - exact).norm() <= 1e-7 * exact.norm());  // normal equations, held up by 1e-10
}

TEST_CASE("a change that grows empties the window", "[anderson]") {
    detail::Anderson anderson(2);
    anderson.update(std::array{1.0, 0.0, 0.0}.data());
    CHECK(anderson.restarts() == 0);
    anderson.update(std::array{0.5, 0.0, 0.6}.data());  // slot 1 is empty as yet: its 0.6 is nobody's
    CHECK(anderson.coefficient(0) == Approx(0.5 / 1.5).epsilon(1e-9));
    CHECK(anderson.coefficient(1) == 0);
    anderson.update(std::array{0.6, 0.1, 0.1}.data());
    CHECK(anderson.restarts() == 1);
    CHECK(anderson.coefficient(0) == 0);
    CHECK(anderson.coefficient(1) == 0);
    anderson.update(std::array{0.2, 0.1, 0.4}.data());
    CHECK(anderson.coefficient(0) == Approx((0.2 - 0.1) / (0.6 - 2 * 0.1 + 0.2)).epsilon(1e-9));  // of what came since
    CHECK(anderson.coefficient(1) == 0);
}

TEST_CASE("one iteration in five combines nothing, after two hundred", "[anderson]") {
    detail::Anderson anderson(1);
    double own = 1;
    const auto next = [&] {  // each change 0.9 of the last
        own *= 0.81;
        anderson.update(std::array{own, own / 0.9}.data());
        return anderson.coefficient(0);
    };
    for (int k = 1; k <= 221; ++k) {
        INFO("iteration " << k);
        CHECK((next() == 0) == (k == 1 || (k > 200 && k % 5 == 0)));
    }
    anderson.forget();
    CHECK(anderson.coefficient(0) == 0);
    CHECK(next() == 0);
    CHECK(next() != 0);
}

TEMPLATE_TEST_CASE("accelerated sweeps are those of the definition", "[anderson]", EVERY_MODEL) {
    using M = TestType;
    Random random(22);
    const int side = M::dim == 2 ? 9 : 5;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    const auto problem = cold_problem<M>(shaken_lattice<M>(random, side), side, driven);
    REQUIRE(problem.contacts.size() > 15);
    for (int window : {1, 2, 5}) {
        INFO("window " << window);
        compare_with_definition(problem, window);
        if (window < 5) compare_with_definition(with_split_masses(problem), window);  // 5: round-off reaches 2e-9
    }
}

TEST_CASE("so are those of contacts swept one by one", "[anderson]") {
    using M = FrictionSpheres;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Random random(23);
    auto grains = shaken_lattice<M>(random, 4);
    for (auto& g : grains) g.inertia *= 1 + 0.1 * (g.id % 3);  // no solid spheres
    auto problem = cold_problem<M>(grains, 4, driven);
    Sweeper<M> sweeper;
    sweeper.load(problem);
    REQUIRE_FALSE(sweeper.batched());
    compare_with_definition(problem, 2);
    compare_with_definition(with_split_masses(problem), 2);
}

TEST_CASE("velocities stay those of the impulses", "[anderson]") {
    using M = FrictionSpheres;
    Random random(24);
    auto free = cold_problem<M>(shaken_lattice<M>(random, 5), 5, true);
    auto solved = free;
    for (const char* start : {"cold", "warm, other velocities"}) {  // warm: open contacts are known
        INFO(start);
        const SolveReport report =
            nlgs(solved, SolveOptions{.tolerance = 1e-8, .bounds = {.max_penetration = 1}}.accelerated());
        CHECK(report.converged);
        CHECK(report.residual <= 1e-8);
        CHECK(report.iterations > 10);  // the first ten are not accelerated
        auto again = solved;
        set_velocities(again, free);
        CHECK(velocity_difference(again, solved) <= 1e-12);
        for (std::size_t g = 0; g < free.bodies.size(); ++g) {
            const typename M::Velocity more = 0.1 * random_vector<typename M::Velocity>(random);
            free.bodies[g].v += more;
            solved.bodies[g].v += more;
        }
    }
}

// A column of n grains of mass 1 at rest; a driven lid, if there is one, presses with the weight of ten. inertia: of
// spheres with friction, over that of solid ones, which alone are swept in batches.
template <class M>
struct Column {
    static constexpr double h = 0.01, lid_mass = 3;
    static SimulationSettings<M> settings(int n, bool driven) {
        SimulationSettings<M> settings;
        settings.h = h;
        settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
        settings.gravity[M::dim - 1] = -1;
        settings.walls.resize(driven ? 2 : 1);
        settings.walls[0].normal = M::Vec::Unit(M::dim - 1);
        if (driven) {
            Wall<M>& lid = settings.walls[1];
            lid.normal = -M::Vec::Unit(M::dim - 1);
            lid.offset = -n;
            lid.driven = true;
            lid.force = 10;
            lid.mass = lid_mass;
        }
        return settings;
    }
    static std::vector<Grain<M>> grains(int n, double inertia) {
        std::vector<Grain<M>> grains;
        for (int k = 0; k < n; ++k) {
            grains.push_back(make_grain<M>(k, 0.5, 1.0, (k + 0.5) * M::Vec::Unit(M::dim - 1)));
            if constexpr (M::friction) grains.back().inertia /= grains.back().mass;
            grains.back().mass = 1;
            if constexpr (M::friction && M::dim == 3) grains.back().inertia *= inertia;
        }
        return grains;
    }
};

TEMPLATE_TEST_CASE("a long column takes few iterations for each grain, and keeps velocities to its impulses",
                   "[anderson]", SmoothDisks, FrictionSpheres) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    const double load = driven ? 10 : 0;
    constexpr int n = 200;
    constexpr double h = Column<M>::h;
    const double inertia = GENERATE(1.0, 1.2);
    if (inertia != 1 && !(M::friction && M::dim == 3)) return;
    for (const Solver& solver : {nlgs_alone, Solver{Scheme::dcs, 3}, Solver{Scheme::ccs, 2}}) {
        INFO(solver.name() << ", inertia " << inertia);
        Run<M> run(solver, Column<M>::settings(n, driven), Column<M>::grains(n, inertia));
        run.options =
            SolveOptions{.tolerance = 1e-11, .bounds = {.max_penetration = 1}, .max_iterations = 20000}.accelerated();
        const int iterations = run.step().solve.iterations;
        CHECK(iterations > 2 * detail::Anderson::many);  // else round-off is too small to be seen
        CHECK(iterations <= 10 * n);
        std::vector<double> impulse(n + 1, 0.0);  // below each grain, and of the lid
        for (const auto& c : gather_contacts(run.simulation)) {
            const auto at = static_cast<std::size_t>(c.j >= 0 ? std::max(c.i, c.j) : c.j == -1 ? 0 : n);
            impulse[at] = std::abs(c.impulse[M::dim - 1]);
        }
        double worst = 0;
        const auto grains = run.grains();
        for (std::size_t k = 0; k < n; ++k) {
            const double exact = (static_cast<double>(n - k) + load) * h;
            CHECK(impulse[k] == Approx(exact).epsilon(1e-4));
            worst = std::max(worst, std::abs(grains[k].velocity[M::dim - 1] + h - impulse[k] + impulse[k + 1]));
        }
        if (driven)
            worst = std::max(worst,
                             std::abs(run.simulation.walls()[1].speed - (load * h - impulse[n]) / Column<M>::lid_mass));
        CHECK(worst <= 1e-13);  // round-off; 1e-12 and more by combinations alone
    }
}

// Combinations of few contacts with masses a thousand times apart make round-off as large as the velocities within 100
// iterations: the heavy ball gained 1.4 J from nothing in a step that had converged.
TEST_CASE("velocities are those of the impulses after short solves as well", "[anderson]") {
    using M = SmoothSpheres;
    for (const int ranks : {1, 4}) {
        std::vector<Grain<M>> grains;
        for (int k = 0; k < 16; ++k) grains.push_back(make_grain<M>(k, 0.5, 1.0, {k % 4 - 1.5, k / 4 - 1.5, 0.5}));
        grains.push_back(make_grain<M>(16, 5.0, 1.0, {0, 0, 0.5 + 0.5 * std::sqrt(119.0)}));
        SimulationSettings<M> settings;
        settings.h = 1e-3;
        settings.gravity = {0, 0, -10};
        settings.materials.set(0, 0, {0.1, 0});
        Wall<M> floor;
        floor.normal = {0, 0, 1};
        settings.walls.push_back(floor);
        InProcess comm(ranks);
        Simulation<M> simulation(comm, settings, grains);
        const SolveOptions options = SolveOptions{}.accelerated();
        const auto solve = ranks > 1 ? by_nscdd<Dcs<M>>(options) : by_nlgs<M>(options);
        double worst = 0;
        for (int step = 0; step < 620; ++step) {
            const StepReport::Energy e = simulation.step(solve).energy;
            const double scale = e.kinetic + std::abs(e.external) + std::abs(e.normal) + std::abs(e.friction);
            worst = std::max(worst, std::abs(e.round_off()) / scale);
        }
        CHECK(worst <= 1e-11);  // 1e-9 to 0.99 when only solves of 200 iterations were asked
    }
}

// By round-off the velocities of combinations are now a little better, now a little worse than those of the impulses:
// of this many tolerances, each met closely, some are met by the former alone.
TEST_CASE("a long solve goes on when the velocities of its impulses say that it is not over", "[anderson]") {
    using M = SmoothDisks;
    constexpr int n = 200, tolerances = 20;
    for (const Solver& solver : {nlgs_alone, Solver{Scheme::dcs, 3}, Solver{Scheme::ccs, 2}})
        for (int k = 0; k < tolerances; ++k) {
            Run<M> run(solver, Column<M>::settings(n, false), Column<M>::grains(n, 1));
            const double tolerance = 1e-13 * (1 + 0.1 * k);
            run.options =
                SolveOptions{
                    .tolerance = tolerance, .bounds = {.max_penetration = 1}, .check_every = 1, .max_iterations = 20000}
                    .accelerated();
            const auto report = run.step().solve;  // which has to converge
            CHECK(report.iterations > 2 * detail::Anderson::many);
            CHECK(report.residual <= tolerance);
        }
}

TEST_CASE("relaxation changes the way, not the answer", "[relaxation]") {
    using M = SmoothSpheres;
    for (const int ranks : {1, 4})
        for (const double relaxation : {0.7, 1.5}) {
            INFO(ranks << " subdomains, omega " << relaxation);
            Random random(26), same(26);
            Run<M> reference({Scheme::dcs, ranks}, lattice_settings<M>(5, true), shaken_lattice<M>(random, 5));
            Run<M> relaxed({Scheme::dcs, ranks}, lattice_settings<M>(5, true), shaken_lattice<M>(same, 5));
            relaxed.options.relaxation = relaxation;
            CHECK(relaxed.step().solve.iterations != reference.step().solve.iterations);
            const auto a = reference.grains(), b = relaxed.grains();
            for (std::size_t g = 0; g < a.size(); ++g) CHECK((a[g].velocity - b[g].velocity).norm() <= 1e-7);
        }
}

TEST_CASE("what no solver would end with is refused", "[anderson]") {
    using M = FrictionSpheres;
    Random random(27);
    auto problem = cold_problem<M>(shaken_lattice<M>(random, 4), 4);
    CHECK_THROWS_AS(nlgs(problem, {.check_every = -1}), std::invalid_argument);
    CHECK_THROWS_AS(nlgs(problem, {.sweeps = 0}), std::invalid_argument);
    CHECK_THROWS_AS(nlgs(problem, {.relaxation = 2}), std::invalid_argument);
    CHECK_THROWS_AS(nlgs(problem, {.relaxation = std::nan("")}), std::invalid_argument);
    CHECK_THROWS_AS(nlgs(problem, {.window = -1}), std::invalid_argument);
    CHECK_THROWS_AS(nlgs(problem, {.window = 9}), std::invalid_argument);
    problem.contacts[0].bias = std::nan("");
    CHECK_THROWS_AS(nlgs(problem, {}), std::invalid_argument);
}
