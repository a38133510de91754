// What must not matter: units, where the axes point, where the origin is, in which order bodies are given.
//
// Histories are compared, not answers alone: eta at every check of every step, by NLGS and by NSCDD on several
// subdomains. Where nothing is rounded differently they must be the same bits; elsewhere the count of iterations may
// move by one check, and velocities by round-off.
#include <Eigen/Geometry>
#include <map>

#include "../catch.hpp"
#include "random_scenes.hpp"
#include "smooth.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

constexpr int check_every = 5;
constexpr Solver every_solver[]{nlgs_alone, {Scheme::dcs, 3}, {Scheme::dcs, 4}};

template <class M>
struct Setting {
    SimulationSettings<M> settings{.materials = smooth<M>()};
    std::vector<Grain<M>> grains;
};

// Solves in pieces of check_every iterations and notes eta after each.
template <class M>
AnyStepSolver<M> in_pieces(const Solver& solver, double tolerance, std::vector<double>& eta) {
    const SolveOptions piece{.tolerance = tolerance, .check_every = check_every, .max_iterations = check_every};
    const AnyStepSolver<M> once = solver.scheme == Scheme::nlgs ? by_nlgs<M>(piece) : by_nscdd<Dcs<M>>(piece);
    return [once, &eta](std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
        SolveReport report;
        for (report.converged = false; !report.converged && report.iterations < 20000;) {
            const int before = report.iterations;
            report = once(parts, comm, seconds);
            report.iterations += before;
            eta.push_back(report.residual);
        }
        return report;
    };
}

template <class M>
struct History {
    std::vector<double> eta;
    std::vector<int> iterations;  // of each step
    std::map<int, Grain<M>> grains;
    std::vector<Wall<M>> walls;
};

template <class M>
History<M> run(const Solver& solver, const Setting<M>& setting, int steps, double tolerance) {
    History<M> history;
    InProcess comm(solver.ranks);
    Simulation<M> simulation(comm, setting.settings, setting.grains);
    for (int k = 0; k < steps; ++k) {
        const StepReport report = simulation.step(in_pieces<M>(solver, tolerance, history.eta));
        REQUIRE(report.solve.converged);
        REQUIRE(report.contacts > 20);
        history.iterations.push_back(report.solve.iterations);
    }
    for (const auto& g : gather_grains(simulation)) history.grains[g.grain.id] = g.grain;
    history.walls = simulation.settings().walls;
    return history;
}

// A heap that has just fallen together, of two materials, one of which rebounds; loads on all grains; two walls slide
// or recede.
template <class M>
Setting<M> random_setting(Random& random, bool driven) {
    const int side = M::dim == 2 ? 6 : 4;
    Setting<M> setting{lattice_settings<M>(side, driven), shaken_lattice<M>(random, side)};
    for (Grain<M>& grain : setting.grains) {  // of radii 0.45 to 0.5, as jammed ones take long
        const auto velocity = grain.velocity;
        grain = make_grain<M>(grain.id, 0.45 + 2.5 * (grain.radius - 0.49), 1.0, grain.position);
        grain.velocity = velocity;
    }
    setting.settings.materials = Materials<M>(2);
    setting.settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0});
    setting.settings.materials.set(0, 1, {M::friction ? 0.2 : 0.0, 0});
    setting.settings.materials.set(1, 1, {M::friction ? 0.5 : 0.0, 0.5});
    for (auto& grain : setting.grains) {
        grain.material = grain.id % 2;
        grain.load = 0.2 * grain.mass * random_vector<typename M::Velocity>(random);
    }
    setting.settings.walls[0].velocity = -0.02 * M::Vec::UnitX() + 0.1 * M::Vec::UnitY();
    setting.settings.walls[3].velocity = 0.05 * M::Vec::UnitX();
    setting.settings.gravity[M::dim - 1] = -10;
    setting.settings.largest_overlap = 1;  // pairs that rebound act only once they touch, and the steps are long
    const History<M> history = run(nlgs_alone, setting, 8, 1e-6);
    for (auto& g : setting.grains) g = history.grains.at(g.id);
    setting.settings.walls = history.walls;
    return setting;
}

void check_counts(const std::vector<int>& a, const std::vector<int>& b) {
    REQUIRE(a.size() == b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
        INFO("step " << k + 1 << ": " << a[k] << " and " << b[k] << " iterations");
        CHECK(std::abs(a[k] - b[k]) <= check_every);
    }
}

// The scene in other units: each number is multiplied by what its unit has become.
struct Units {
    double length, mass, time;
};

template <class M>
Setting<M> in_units(Setting<M> setting, const Units& units) {
    const auto& [l, m, t] = units;
    const double force = m * l / (t * t);
    for (auto& g : setting.grains) {
        g.radius *= l, g.position *= l, g.mass *= m, g.inertia *= m * l * l;
        g.velocity.template head<M::dim>() *= l / t;
        g.velocity.template tail<M::spins>() /= t;
        g.load.template head<M::dim>() *= force;
        g.load.template tail<M::spins>() *= force * l;
    }
    for (auto& wall : setting.settings.walls) {
        wall.offset *= l, wall.velocity *= l / t, wall.speed *= l / t, wall.mass *= m, wall.force *= force;
    }
    setting.settings.gravity *= l / (t * t);
    setting.settings.h *= t;
    return setting;
}

// As the numbers of one unit after another are changed, alone and together.
std::vector<Units> all_units(double factor) {
    std::vector<Units> all;
    for (const double f : {factor, 1 / factor})
        for (const Units& u : {Units{f, 1, 1}, {1, f, 1}, {1, 1, f}, {f, 1 / f, f}}) all.push_back(u);
    return all;
}

// x -> turn x, orthogonal; spins are axial vectors and turn the other way in a reflection.
template <class M>
struct Turn {
    using Matrix = Eigen::Matrix<double, M::dim, M::dim>;
    Matrix matrix;

    typename M::Vec operator()(const typename M::Vec& x) const { return matrix * x; }
    typename M::Velocity velocity(const typename M::Velocity& v) const {
        typename M::Velocity turned;
        turned.template head<M::dim>() = matrix * v.template head<M::dim>();
        if constexpr (M::spins == 1) turned[M::dim] = matrix.determinant() * v[M::dim];
        if constexpr (M::spins == 3) turned.template tail<3>() = matrix.determinant() * (matrix * v.template tail<3>());
        return turned;
    }
    typename M::Impulse impulse(const typename M::Impulse& r) const {
        if constexpr (M::friction)
            return matrix * r;
        else
            return r;
    }
    void operator()(ContactProblem<M>& problem) const {
        for (auto& body : problem.bodies) body.v = velocity(body.v);
        for (auto& wall : problem.walls) wall.prescribed = (*this)(wall.prescribed);
        for (auto* contacts : {&problem.contacts, &problem.wall_contacts})
            for (auto& c : *contacts) {
                c.normal = (*this)(c.normal);
                c.r = impulse(c.r);
            }
    }
};

template <class M>
std::map<std::string, Turn<M>> all_turns(Random& random) {
    using Matrix = typename Turn<M>::Matrix;
    Matrix any, quarter, mirror = Matrix::Identity();
    const auto n = random_unit<M>(random);
    if constexpr (M::dim == 2) {
        any = Eigen::Rotation2Dd(uniform(random, 0.1, 1.4)).toRotationMatrix();
        quarter << 0, -1, 1, 0;
    } else {
        any = Eigen::AngleAxisd(uniform(random, 0.1, 3), Eigen::Vector3d(n)).toRotationMatrix();
        quarter << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    }
    mirror(0, 0) = -1;
    return {{"a rotation", {any}},
            {"a quarter turn", {quarter}},
            {"a mirror across an axis", {mirror}},
            {"a mirror across any plane", {Matrix::Identity() - 2 * Eigen::MatrixXd(n * n.transpose())}}};
}

// Calls inspect(parts, comm) with the prepared problem of a second step, which brings impulses along.
template <class M>
void second_step(const Solver& solver, const Setting<M>& setting, auto&& inspect) {
    InProcess comm(solver.ranks);
    Simulation<M> simulation(comm, setting.settings, setting.grains);
    std::vector<double> eta;
    simulation.step(in_pieces<M>(solver, 1e-6, eta));
    bool inspected = false;
    simulation.step([&](std::span<Subdomain<M>> parts, Communicator& all, PhaseSeconds& seconds) {
        if (!inspected) inspect(std::vector(parts.begin(), parts.end()), all);
        inspected = true;
        return in_pieces<M>(solver, 1e-6, eta)(parts, all, seconds);
    });
}

template <class M>
struct Solved {
    std::vector<double> eta;
    SolveReport report;
};

template <class M>
Solved<M> solve(const Solver& solver, std::vector<Subdomain<M>>& parts, Communicator& comm) {
    Solved<M> solved;
    PhaseSeconds seconds;
    solved.report = in_pieces<M>(solver, 1e-8, solved.eta)(parts, comm, seconds);
    REQUIRE(solved.report.converged);
    REQUIRE(solved.report.iterations > 2 * check_every);
    return solved;
}

// Largest component of the difference of velocities, spins times radius, over the largest velocity.
template <class M>
class VelocityError {
  public:
    void add(const typename M::Velocity& a, const typename M::Velocity& b, double radius) {
        typename M::Velocity u = a, v = b;
        u.template tail<M::spins>() *= radius, v.template tail<M::spins>() *= radius;
        difference_ = std::max(difference_, (u - v).cwiseAbs().maxCoeff());
        largest_ = std::max(largest_, u.cwiseAbs().maxCoeff());
    }
    double relative() const { return difference_ / largest_; }

  private:
    double difference_ = 0, largest_ = 0;
};

}  // namespace

TEMPLATE_TEST_CASE("units scaled by powers of two leave every bit of the history", "[invariance]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Random random(3);
    const Setting<M> setting = random_setting<M>(random, driven);
    for (const Solver& solver : every_solver) {
        INFO(solver.name());
        const History<M> history = run(solver, setting, 3, 1e-6);
        CHECK(history.eta.size() > 20);
        for (const Units& units : all_units(0x1p20)) {
            INFO("length, mass, time: " << units.length << ", " << units.mass << ", " << units.time);
            const History<M> scaled = run(solver, in_units(setting, units), 3, 1e-6);
            CHECK(scaled.eta == history.eta);
            CHECK(scaled.iterations == history.iterations);
            bool same = true;
            for (const auto& [id, g] : history.grains) {
                const Grain<M>& other = scaled.grains.at(id);
                same = same && other.position == g.position * units.length;
                typename M::Velocity v = g.velocity / units.time;
                v.template head<M::dim>() *= units.length;
                same = same && other.velocity == v;
            }
            CHECK(same);
            for (std::size_t w = 0; w < history.walls.size(); ++w)
                CHECK(scaled.walls[w].speed == history.walls[w].speed * units.length / units.time);
        }
    }
}

TEMPLATE_TEST_CASE("other units leave the counts", "[invariance]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Random random(4);
    const Setting<M> setting = random_setting<M>(random, driven);
    for (const Solver& solver : every_solver) {
        INFO(solver.name());
        const History<M> history = run(solver, setting, 3, 1e-6);
        for (const Units& units : all_units(1e6)) {
            INFO("length, mass, time: " << units.length << ", " << units.mass << ", " << units.time);
            check_counts(run(solver, in_units(setting, units), 3, 1e-6).iterations, history.iterations);
        }
    }
}

TEMPLATE_TEST_CASE("turned and mirrored problems are solved alike", "[invariance]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Random random(5);
    const Setting<M> setting = random_setting<M>(random, driven);
    const auto turns = all_turns<M>(random);
    for (const Solver& solver : every_solver)
        second_step<M>(solver, setting, [&](const std::vector<Subdomain<M>>& given, Communicator& comm) {
            std::vector<Subdomain<M>> straight = given;
            const Solved<M> expected = solve(solver, straight, comm);
            for (const auto& [name, turn] : turns) {
                INFO(solver.name() << ", " << name);
                std::vector<Subdomain<M>> turned = given;
                for (auto& part : turned) turn(part.problem);
                const Solved<M> found = solve(solver, turned, comm);
                check_counts({found.report.iterations}, {expected.report.iterations});
                VelocityError<M> error;
                for (std::size_t p = 0; p < straight.size(); ++p) {
                    for (std::size_t g = 0; g < straight[p].grains.size(); ++g)
                        error.add(turn.velocity(straight[p].problem.bodies[g].v), turned[p].problem.bodies[g].v,
                                  straight[p].grains[g].radius);
                }
                CHECK(error.relative() <= 1e-11);
                CHECK(found.eta.front() == Approx(expected.eta.front()).epsilon(1e-9));
            }
        });
}

TEMPLATE_TEST_CASE("a scene elsewhere goes the same way", "[invariance]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Random random(6);
    Setting<M> setting = random_setting<M>(random, driven);
    // on a grid so coarse that no sum of a place and a shift, nor the first half step, is rounded
    const auto coarse = [](auto& v) { v = (v.array() * 0x1p20).round() / 0x1p20; };
    setting.settings.h = 0x1p-5;
    for (auto& g : setting.grains) coarse(g.position), coarse(g.velocity);
    for (auto& wall : setting.settings.walls) {
        wall.offset = std::round(wall.offset * 0x1p20) / 0x1p20;
        wall.speed = std::round(wall.speed * 0x1p20) / 0x1p20;
        coarse(wall.velocity);
    }
    const auto shifted = [&](const typename M::Vec& by) {
        Setting<M> elsewhere = setting;
        for (auto& g : elsewhere.grains) g.position += by;
        for (auto& wall : elsewhere.settings.walls) wall.offset += wall.normal.dot(by);
        return elsewhere;
    };
    typename M::Vec power = M::Vec::Constant(0x1p10);
    power[0] = -0x1p12;
    const auto any = typename M::Vec(1000 * random_unit<M>(random));
    for (const Solver& solver : every_solver) {
        INFO(solver.name());
        const bool same = run(solver, shifted(power), 1, 1e-7).eta == run(solver, setting, 1, 1e-7).eta;
        CHECK(same);
        const History<M> history = run(solver, setting, 3, 1e-9);
        for (const auto& by : {power, any}) {
            INFO("by " << by.transpose());
            const History<M> elsewhere = run(solver, shifted(by), 3, 1e-9);
            check_counts(elsewhere.iterations, history.iterations);
            VelocityError<M> error;
            for (const auto& [id, g] : history.grains)
                error.add(g.velocity, elsewhere.grains.at(id).velocity, g.radius);
            CHECK(error.relative() <= 1e-9);
        }
    }
}

// Spatial order is a matter of places, ties within a cell go by id: the order in which grains are given does not
// matter, nor do their ids as long as they rise together.
TEMPLATE_TEST_CASE("the order of the grains, and gaps between their ids, do not matter", "[invariance]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Random random(7);
    const Setting<M> setting = random_setting<M>(random, driven);
    Setting<M> shuffled = setting;
    std::shuffle(shuffled.grains.begin(), shuffled.grains.end(), random);
    for (auto& g : shuffled.grains) g.id = 3 * g.id + 5;
    for (const Solver& solver : every_solver) {
        INFO(solver.name());
        const History<M> a = run(solver, setting, 3, 1e-6), b = run(solver, shuffled, 3, 1e-6);
        CHECK(a.eta == b.eta);
        bool same = true;
        for (const auto& [id, g] : a.grains) {
            const Grain<M>& other = b.grains.at(3 * id + 5);
            same = same && other.position == g.position && other.velocity == g.velocity;
        }
        CHECK(same);
    }
}

TEMPLATE_TEST_CASE("bodies in another order, contacts in the same: the same bits", "[invariance]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Random random(8);
    second_step<M>(
        nlgs_alone, random_setting<M>(random, driven), [&](const std::vector<Subdomain<M>>& given, Communicator&) {
            ContactProblem<M> problem = given[0].problem, permuted = problem, reversed = problem;
            std::vector<int> place(problem.bodies.size());
            for (std::size_t g = 0; g < place.size(); ++g) place[g] = static_cast<int>(g);
            std::shuffle(place.begin(), place.end(), random);
            const auto at = [&](int g) { return static_cast<std::size_t>(place[static_cast<std::size_t>(g)]); };
            for (int g = 0; g < static_cast<int>(place.size()); ++g) {
                permuted.bodies[at(g)] = problem.bodies[static_cast<std::size_t>(g)];
                permuted.multiplicity[at(g)] = problem.multiplicity[static_cast<std::size_t>(g)];
            }
            for (auto& c : permuted.contacts) c.i = static_cast<int>(at(c.i)), c.j = static_cast<int>(at(c.j));
            for (auto& c : permuted.wall_contacts) c.i = static_cast<int>(at(c.i));
            for (std::size_t c = 0; c < reversed.contacts.size();
                 c += 2) {  // every other contact as its other grain sees it
                auto& contact = reversed.contacts[c];
                std::swap(contact.i, contact.j);
                contact.normal *= -1;
                if constexpr (M::friction) {
                    std::swap(contact.lever_i, contact.lever_j);
                    contact.r *= -1;
                }
            }
            const SolveOptions options{.tolerance = 1e-8, .check_every = check_every};
            const SolveReport a = nlgs(problem, options), b = nlgs(permuted, options), c = nlgs(reversed, options);
            CHECK(a.iterations > 2 * check_every);
            CHECK(a.residual == b.residual);
            CHECK(a.iterations == b.iterations);
            check_counts({c.iterations}, {a.iterations});
            bool same = true;
            VelocityError<M> error;
            for (int g = 0; g < static_cast<int>(place.size()); ++g) {
                const auto k = static_cast<std::size_t>(g);
                same = same && permuted.bodies[at(g)].v == problem.bodies[k].v;
                error.add(problem.bodies[k].v, reversed.bodies[k].v, given[0].grains[k].radius);
            }
            CHECK(same);
            CHECK(error.relative() <= 1e-11);
        });
}
