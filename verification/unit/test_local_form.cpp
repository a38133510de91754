// Problems in local form: measures with known values, the full-block contact solve against a search over all answers,
// W and NLGS against the matrix-free ones.
#include <numbers>

#include "random_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

using Local2 = DelassusProblem<2>;
using Local3 = DelassusProblem<3>;

// Contacts that do not see each other.
Local3 apart(const std::vector<Local3::Block>& blocks, const std::vector<Local3::Vec>& q, double mu) {
    Local3 problem;
    problem.q = q;
    problem.friction.assign(q.size(), mu);
    std::vector<Local3::Entry> entries;
    for (int c = 0; c < static_cast<int>(q.size()); ++c) entries.push_back({c, c, blocks[static_cast<std::size_t>(c)]});
    problem.set_blocks(entries);
    return problem;
}

Local3 alone(double w, const Local3::Vec& q, double mu) { return apart({w * Local3::Block::Identity()}, {q}, mu); }

// Every sliding answer of a contact: u_n = 0, r on the edge of the cone in a direction for which u_t is opposed to it.
template <int dim>
std::vector<typename DelassusProblem<dim>::Vec> sliding_answers(const typename DelassusProblem<dim>::Block& w,
                                                                const typename DelassusProblem<dim>::Vec& q,
                                                                double mu) {
    using Vec = typename DelassusProblem<dim>::Vec;
    const auto impulse = [&](double angle) -> Vec {
        Vec edge;
        if constexpr (dim == 2)
            edge << 1, mu * (angle == 0 ? 1 : -1);
        else
            edge << 1, mu * std::cos(angle), mu * std::sin(angle);
        return -q[0] / w.row(0).dot(edge) * edge;
    };
    const auto opposed = [&](const Vec& r) {
        const Vec u = w * r + q;
        return r[0] >= 0 && u.template tail<dim - 1>().dot(r.template tail<dim - 1>()) <= 0;
    };
    std::vector<Vec> answers;
    if constexpr (dim == 2) {
        for (double angle : {0.0, 1.0})
            if (opposed(impulse(angle))) answers.push_back(impulse(angle));
    } else {
        const auto aside = [&](double angle) {  // u_t across the direction
            const Vec u = w * impulse(angle) + q;
            return u[2] * std::cos(angle) - u[1] * std::sin(angle);
        };
        constexpr int count = 3000;
        for (int k = 0; k < count; ++k) {
            double low = 2 * std::numbers::pi * k / count, high = 2 * std::numbers::pi * (k + 1) / count;
            if (aside(low) * aside(high) > 0) continue;
            for (int halving = 0; halving < 60; ++halving) {
                const double middle = 0.5 * (low + high);
                (aside(low) * aside(middle) > 0 ? low : high) = middle;
            }
            if (opposed(impulse(low))) answers.push_back(impulse(low));
        }
    }
    return answers;
}

// Symmetric positive definite with eigenvalues from 10^-spread to 1.
template <int dim>
typename DelassusProblem<dim>::Block random_block(Random& random, double spread) {
    using Matrix = Eigen::Matrix<double, dim, dim>;
    Matrix a;
    for (int k = 0; k < dim * dim; ++k) a(k / dim, k % dim) = uniform(random, -1, 1);
    const Matrix q = Eigen::HouseholderQR<Matrix>(a).householderQ();
    Eigen::Matrix<double, dim, 1> values;
    for (int k = 0; k < dim; ++k) values[k] = std::pow(10, -uniform(random, 0, spread));
    return q * values.asDiagonal() * q.transpose();
}

// How far r is from the law, as an impulse over its own size and that of q/W.
template <int dim>
double law_error(const typename DelassusProblem<dim>::Block& w, const typename DelassusProblem<dim>::Vec& q, double mu,
                 const typename DelassusProblem<dim>::Vec& r) {
    const double rho = dim / w.trace();
    const typename DelassusProblem<dim>::Vec u = w * r + q;
    return detail::natural_map(r, u, mu, rho).norm() / (r.norm() + rho * q.norm());
}

template <int dim>
void check_one_contact(double spread, double tolerance) {
    using Vec = typename DelassusProblem<dim>::Vec;
    Random random(11);
    int open = 0, stick = 0, slide = 0;
    for (int k = 0; k < 3000; ++k) {
        const double scale = std::pow(10, uniform(random, -8, 8));
        const typename DelassusProblem<dim>::Block w = scale * random_block<dim>(random, spread);
        const Vec q = std::pow(10, uniform(random, -8, 8)) * random_vector<Vec>(random);
        const double mu = k % 10 == 0 ? 0 : uniform(random, 0, 2);
        const Vec r = detail::one_contact<dim>(w, q, mu);
        INFO("W " << w << "\nq " << q.transpose() << "\nmu " << mu << "\nr " << r.transpose());
        REQUIRE(law_error<dim>(w, q, mu, r) <= tolerance);
        if (q[0] >= 0) {
            REQUIRE(r.isZero(0));
            ++open;
            continue;
        }
        std::vector<Vec> answers = sliding_answers<dim>(w, q, mu);
        const Vec sticking = -w.inverse() * q;
        const bool can_stick = sticking.template tail<dim - 1>().norm() <= mu * sticking[0];
        if (can_stick) answers.push_back(sticking);
        double nearest = HUGE_VAL;
        for (const Vec& answer : answers) nearest = std::min(nearest, (answer - r).norm());
        REQUIRE(nearest <= 1e-9 * r.norm());
        ++(can_stick ? stick : slide);
    }
    CHECK(std::min({open, stick, slide}) > 100);
}

}  // namespace

TEST_CASE("Measures of one contact have the values found by hand", "[local]") {
    SECTION("an exact answer, sliding") {
        const ErrorMeasures e = error_measures(alone(1, {-1, -2, 0}, 0.5), {{1, 0.5, 0}});
        for (double value : {e.natural_map, e.natural_map_velocity, e.unilateral, e.natural_map_impulse, e.eta,
                             e.cone_excess, e.complementarity, e.dissipation, e.worst, e.least_normal_velocity})
            CHECK(std::abs(value) < 1e-15);
        CHECK(e.least_normal_impulse == 1);
    }
    SECTION("an exact answer, open, with and without friction") {
        for (double mu : {0.0, 0.5}) {
            const ErrorMeasures e = error_measures(alone(1, {2, 0, 0}, mu), {{0, 0, 0}});
            CHECK(e.natural_map == 0);
            CHECK(e.natural_map_velocity == 0);
            CHECK(e.eta == 0);
            CHECK(e.least_normal_velocity == 1);
        }
    }
    SECTION("no impulse where one is needed, whatever the unit") {
        for (double w : {1.0, 4.0, 1e-6}) {
            const ErrorMeasures e = error_measures(alone(w, {-w, 0, 0}, 0.5), {{0, 0, 0}});
            CHECK(e.natural_map == Approx(1));
            CHECK(e.natural_map_velocity == Approx(1));
            CHECK(e.natural_map_impulse == Approx(1));  // absolute: there is no impulse to compare with
            CHECK(e.eta == Approx(1));
            CHECK(e.least_normal_velocity == Approx(-1));
            CHECK(e.complementarity == 0);
        }
    }
    SECTION("outside the cone") {
        const ErrorMeasures e = error_measures(alone(1, {-1, 0, 0}, 0.5), {{1, 2, 0}});
        CHECK(e.natural_map == Approx(1));  // F = (1, 2, 0), as long as r
        CHECK(e.eta == Approx(2 / std::sqrt(5.0)));
        CHECK(e.cone_excess == Approx(0.75));
        CHECK(e.complementarity == 0);
        CHECK(e.dissipation == Approx(1.25));
    }
    SECTION("per contact, rho is 1/mean(diag W)") {
        // u = (0, 4, 0): y = (1 - 0.5 * 4/4, 2 - 4/4, 0) = (0.5, 1, 0) goes to (0.8, 0.4, 0)
        const ErrorMeasures e = error_measures(alone(4, {-4, -4, 0}, 0.5), {{1, 2, 0}});
        CHECK(e.natural_map_impulse == Approx(std::hypot(0.2, 1.6) / std::sqrt(5.0)));
        CHECK(e.natural_map_velocity == Approx(4 * std::hypot(0.2, 1.6) / std::sqrt(32.0)));
    }
    SECTION("pulling") {
        const ErrorMeasures e = error_measures(alone(1, {1, 0, 0}, 0.5), {{-2, 0, 0}});
        CHECK(e.least_normal_impulse == -1);
        CHECK(e.least_normal_velocity == -1);
        CHECK(e.complementarity == Approx(1));
    }
}

TEST_CASE("The nearest point of the cone is none of those around it", "[local]") {
    Random random(8);
    for (int k = 0; k < 2000; ++k) {
        const double mu = k % 5 == 0 ? 0 : uniform(random, 0, 2);
        Local3::Vec y = random_vector<Local3::Vec>(random);
        if (k % 3 == 0) y.tail<2>().setZero();
        const Local3::Vec p = detail::project_on_cone(y, mu);
        REQUIRE(p.tail<2>().norm() <= mu * p[0] + 1e-15);
        for (int other = 0; other < 20; ++other) {  // the angle at p is obtuse for every point of the cone
            Local3::Vec x = random_vector<Local3::Vec>(random);
            x[0] = std::abs(x[0]);
            x.tail<2>() *= mu * x[0] / x.tail<2>().norm();
            REQUIRE((y - p).dot(x - p) <= 1e-14);
        }
    }
}

TEST_CASE("The worst contact is named", "[local]") {
    const Local3::Block unit = Local3::Block::Identity();
    const Local3 problem = apart({unit, unit, unit}, {{-1, 0, 0}, {-3, 0, 0}, {-2, 0, 0}}, 0.3);
    const ErrorMeasures e = error_measures(problem, {{1, 0, 0}, {0, 0, 0}, {0, 0, 0}});
    CHECK(e.worst_contact == 1);
    CHECK(e.worst == Approx(3 / std::sqrt(14.0)));
    CHECK(e.natural_map == Approx(std::sqrt(13.0 / 14.0)));
    CHECK(detail::stopping_error(problem, {{1, 0, 0}, {0, 0, 0}, {0, 0, 0}}) ==
          std::max({e.natural_map, e.natural_map_velocity, e.unilateral}));
}

TEST_CASE("A full block is solved: the answer is one of those that a search finds", "[local]") {
    check_one_contact<2>(2, 1e-13);
    check_one_contact<3>(2, 1e-13);
}

TEST_CASE("Blocks without mobility along the tangents, and nearly singular ones, are solved", "[local]") {
    Random random(5);
    for (int k = 0; k < 3000; ++k) {
        const double mu = uniform(random, 0, 2);
        const auto q = random_vector<Local3::Vec>(random);
        Local3::Block w = random_block<3>(random, 8);
        REQUIRE(law_error<3>(w, q, mu, detail::one_contact<3>(w, q, mu)) <= 1e-7);
        w = Local3::Vec(2, 0, k % 2).asDiagonal();
        if (k % 4 < 2 || q[1] == 0) REQUIRE(law_error<3>(w, q, mu, detail::one_contact<3>(w, q, mu)) <= 1e-12);
    }
}

TEST_CASE("Blocks are put in order and added up", "[local]") {
    Local2 problem;
    problem.q.resize(3);
    const Local2::Block one = Local2::Block::Identity();
    problem.set_blocks({{2, 0, one}, {0, 0, one}, {0, 2, 2 * one}, {0, 0, 3 * one}});
    CHECK(problem.row_begin == std::vector<int>{0, 2, 3, 5});
    CHECK(problem.columns == std::vector<int>{0, 2, 1, 0, 2});
    CHECK(problem.diagonal == std::vector<int>{0, 2, 4});
    CHECK(problem.blocks[0] == 4 * one);
    CHECK(problem.blocks[2].isZero(0));
}

namespace {

// A dense problem with walls, its impulses partly converged.
template <class M>
ContactProblem<M> lattice_problem(bool driven) {
    Random random(2);
    const int side = M::dim == 2 ? 5 : 3;
    Run<M> run(nlgs_alone, lattice_settings<M>(side, driven), shaken_lattice<M>(random, side));
    run.options.tolerance = 1e-2;
    run.options.bounds.max_penetration = 1;
    run.simulation.walls()[0].velocity[1] = 0.1;
    for (int k = 0; k < 5; ++k) run.step();
    return run.simulation.parts()[0].problem;
}

// Relative velocity with all its components, frictionless or not.
template <class M>
typename M::Vec full_velocity(const ContactProblem<M>& problem, const Contact<M>& c, auto kind) {
    if constexpr (M::friction) {
        return relative_velocity(problem, c, kind);
    } else {
        const auto i = static_cast<std::size_t>(c.i), j = static_cast<std::size_t>(c.j);
        typename M::Vec v = problem.bodies[i].linear();
        if constexpr (std::is_same_v<decltype(kind), BetweenGrains>) return v - problem.bodies[j].linear();
        v -= problem.walls[j].prescribed;
        v -= problem.walls[j].speed * c.normal;
        return v;
    }
}

template <class M>
std::vector<typename M::Vec> full_velocities(ContactProblem<M>& problem) {
    std::vector<typename M::Vec> u;
    detail::each_contact(problem, [&](const Contact<M>& c, auto kind) {
        u.push_back(detail::contact_frame<M>(c.normal) * full_velocity(problem, c, kind));
    });
    return u;
}

}  // namespace

TEMPLATE_TEST_CASE("W and q are those of the matrix-free operators, column by column", "[local]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    ContactProblem<M> problem = lattice_problem<M>(driven);
    const DelassusProblem<M::dim> local = assemble(problem);
    REQUIRE(problem.wall_contacts.size() > 3);
    REQUIRE(problem.contacts.size() > 10);
    REQUIRE(local.contact_count() == problem.contact_count());

    const auto r = local_impulses(problem);
    const auto u = full_velocities(problem);
    std::vector<double> biases;
    detail::each_contact(problem, [&](const Contact<M>& c, auto) { biases.push_back(c.bias); });
    for (std::size_t c = 0; c < u.size(); ++c) {
        typename M::Vec expected = u[c];
        expected[0] += biases[c];
        CHECK((local.velocity(c, r) - expected).norm() < 1e-12);
    }

    ContactProblem<M> still = problem;
    for (auto& body : still.bodies) body.v.setZero();
    for (auto& wall : still.walls) {
        wall.prescribed.setZero();
        wall.speed = 0;
    }
    const std::size_t n = local.contact_count();
    std::size_t coupled = 0;
    for (std::size_t d = 0; d < n; ++d)
        for (int k = 0; k < (M::friction ? M::dim : 1); ++k) {
            ContactProblem<M> pushed = still;
            std::size_t at = 0;
            detail::each_contact(pushed, [&](const Contact<M>& c, auto kind) {
                if (at++ != d) return;
                typename M::Impulse unit = M::Impulse::Unit(0);
                if constexpr (M::friction) unit = detail::contact_frame<M>(c.normal).row(k).transpose();
                apply_impulse(pushed, c, unit, kind);
            });
            const auto expected = full_velocities(pushed);
            for (std::size_t c = 0; c < n; ++c) {
                typename M::Vec column = M::Vec::Zero();
                for (int b = local.row_begin[c]; b < local.row_begin[c + 1]; ++b)
                    if (local.columns[static_cast<std::size_t>(b)] == static_cast<int>(d))
                        column = local.blocks[static_cast<std::size_t>(b)].col(k);
                CHECK((column - expected[c]).norm() < 1e-13 * (1 + expected[c].norm()));
                coupled += c != d && column.norm() > 0;
            }
        }
    CHECK(coupled > n);
}

TEMPLATE_TEST_CASE("Sweeps, eta and velocities are those of matrix-free NLGS", "[local]", EVERY_MODEL) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    ContactProblem<M> problem = lattice_problem<M>(driven);
    const DelassusProblem<M::dim> local = assemble(problem);
    auto r = local_impulses(problem);
    CHECK(error_measures(local, r).eta == Approx(residual_parts(problem).eta()).epsilon(1e-6));

    ContactProblem<M> swept = problem;
    prepare_contacts(swept);
    for (int k = 0; k < 7; ++k) sweep(swept), detail::block_sweep(local, r);
    const auto expected = local_impulses(swept);
    double largest = 0;
    for (const auto& impulse : expected) largest = std::max(largest, impulse.norm());
    REQUIRE(largest > 0);
    for (std::size_t c = 0; c < r.size(); ++c) CHECK((r[c] - expected[c]).norm() < 1e-11 * largest);

    set_local_impulses(problem, r);
    for (std::size_t b = 0; b < problem.bodies.size(); ++b)
        CHECK((problem.bodies[b].v - swept.bodies[b].v).norm() < 1e-10);
    for (std::size_t w = 0; w < problem.walls.size(); ++w)
        CHECK(problem.walls[w].speed == Approx(swept.walls[w].speed).margin(1e-10));

    const SolveReport report = block_nlgs(local, r, {.tolerance = 1e-10});
    CHECK(report.converged);
    const ErrorMeasures e = error_measures(local, r);
    CHECK(detail::stopping_error(local, r) == report.residual);
    CHECK(std::max({e.natural_map, e.natural_map_velocity, e.unilateral}) == Approx(report.residual).margin(1e-12));
    CHECK(e.eta < 1e-8);
    CHECK(e.cone_excess < 1e-14);
    CHECK(e.complementarity < 1e-8);
    CHECK(e.dissipation < 1e-8);
}

TEST_CASE("A cap on sweeps is reported, and so are numbers that are not finite", "[local]") {
    Local3 problem = apart({Local3::Block::Identity(), Local3::Block::Identity()}, {{-1, 0, 0}, {-1, 0, 0}}, 0.5);
    const Local3::Block one = Local3::Block::Identity(), other = -0.9 * one;  // each feels the other
    problem.set_blocks({{0, 0, one}, {0, 1, other}, {1, 0, other}, {1, 1, one}});
    std::vector<Local3::Vec> r(2, Local3::Vec::Zero());
    const SolveReport report = block_nlgs(problem, r, {.tolerance = 1e-6, .check_every = 1, .max_iterations = 3});
    CHECK(!report.converged);
    CHECK(report.iterations == 3);
    const Local3 broken = alone(1, {NAN, 0, 0}, 0.5);
    r.assign(1, Local3::Vec::Zero());
    CHECK_THROWS_AS(block_nlgs(broken, r), std::invalid_argument);
    CHECK_THROWS_AS(block_nlgs(alone(1, {-1e200, 0, 0}, 0.5), r), std::runtime_error);  // its square is not
}

TEST_CASE("Heavy and light bodies are solved as exactly as others", "[local]") {
    Local3 problem = apart({Local3::Block::Identity(), Local3::Block::Identity()}, {{-1, 0, 0}, {-1, 0, 0}}, 0.5);
    for (const double w : {1.0, 1e-8, 1e8}) {
        const Local3::Block one = w * Local3::Block::Identity(), other = -0.9 * one;  // each feels the other
        problem.set_blocks({{0, 0, one}, {0, 1, other}, {1, 0, other}, {1, 1, one}});
        std::vector<Local3::Vec> r(2, Local3::Vec::Zero());
        const SolveReport plain = block_nlgs(problem, r, {.tolerance = 1e-8, .check_every = 1});
        CHECK(plain.converged);
        CHECK(w * r[0][0] == Approx(10).epsilon(1e-6));
        r.assign(2, Local3::Vec::Zero());
        const SolveReport accelerated = block_nlgs(problem, r, {.tolerance = 1e-8, .check_every = 1, .window = 2});
        CHECK(accelerated.converged);
        CHECK(accelerated.iterations < plain.iterations / 4);
        CHECK(w * r[0][0] == Approx(10).epsilon(1e-6));
    }
}
