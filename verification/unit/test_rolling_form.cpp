// Rolling resistance in local form: the exact answer of a full block clause by clause, measures with known values, W
// and q of a model's problem, and NLGS on blocks beside the matrix-free one.
#include "made_up_contacts.hpp"
#include "nscdd/core/rolling.hpp"
#include "scratch.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

using Disks = Model<2, Rolling>;
using Spheres = Model<3, Rolling>;
using Rolls2 = DelassusProblem<2, true>;
using Rolls3 = DelassusProblem<3, true>;

// Symmetric positive definite with eigenvalues from 0.01 to 1, all of which the rotation mixes.
template <class Problem>
typename Problem::Block random_block(Random& random) {
    using Matrix = Eigen::Matrix<double, Problem::size, Problem::size>;
    Matrix a;
    for (double& entry : a.reshaped()) entry = uniform(random, -1, 1);
    const Matrix q = Eigen::HouseholderQR<Matrix>(a).householderQ();
    typename Problem::Vec values;
    for (double& value : values) value = std::pow(10, -uniform(random, 0, 2));
    return q * values.asDiagonal() * q.transpose();
}

template <class Problem>
Problem alone(const typename Problem::Block& w, const typename Problem::Vec& q, double mu, double roll) {
    Problem problem;
    problem.q = {q}, problem.friction = {mu}, problem.rolling = {roll};
    problem.set_blocks({{0, 0, w}});
    return problem;
}

struct Statuses {
    int open = 0, held = 0, slides = 0, rolls = 0, both = 0;
    int fewest() const { return std::min({open, held, slides, rolls, both}); }
};

// Asserts that |part| <= limit, and that it is as large and opposes the slip where there is one. True if it slips.
bool check_part(const auto& part, const auto& slip, double limit, double eps_r, double eps_u) {
    REQUIRE(part.norm() <= limit + eps_r);
    if (slip.norm() <= eps_u) return false;
    REQUIRE((slip.norm() * part + limit * slip).norm() <= eps_r * slip.norm() + eps_u * limit);
    return true;
}

// One of four heaps of grains of several sizes in a corner, some steps after they were let go.
template <class M>
ContactProblem<M> heap(Random& random, double roll) {
    std::vector<Grain<M>> grains;
    for (int k = 0; k < 27; ++k) {
        typename M::Vec at = 0.55 * M::Vec::Ones();
        at[0] += 1.05 * (k % 3), at[1] += 1.05 * (k / 3 % (M::dim == 3 ? 3 : 9));
        if constexpr (M::dim == 3) at[2] += 1.05 * (k / 9);
        grains.push_back(make_grain<M>(k, uniform(random, 0.3, 0.5), 1000, at));
        grains.back().velocity = random_vector<typename M::Velocity>(random);
    }
    SimulationSettings<M> settings;
    settings.h = 0.02;
    settings.materials.set(0, 0, {.friction = 0.3, .rolling = roll});
    for (int d = 0; d < M::dim; ++d) {
        settings.walls.emplace_back().normal = M::Vec::Unit(d);
        settings.gravity[d] = -10.0 / (1 + d);
    }
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, grains);
    for (int step = 0; step < 12; ++step) simulation.step(by_nlgs<M>(SolveOptions{}));
    return simulation.parts()[0].problem;
}

}  // namespace

TEMPLATE_TEST_CASE("a full block with a couple is solved: each clause of the law holds", "[local]", Rolls2, Rolls3) {
    using Problem = TestType;
    constexpr int m = Problem::tangents;
    Random random(19);
    Statuses count;
    for (int k = 0; k < 6000; ++k) {
        const double scale = std::pow(10, uniform(random, -8, 8)), speed = std::pow(10, uniform(random, -8, 8));
        typename Problem::Block w = scale * random_block<Problem>(random);
        if (k % 4 == 0) {  // not symmetric, still positive definite
            const double twist = 0.3 * w.diagonal().minCoeff();
            w(0, 1) += twist, w(1, 0) -= twist;
        }
        const typename Problem::Vec q = speed * random_vector<typename Problem::Vec>(random);
        const double mu = k % 10 == 0 ? 0 : uniform(random, 0, 2), roll = k % 7 == 0 ? 0 : uniform(random, 0, 2);
        const typename Problem::Vec r = detail::rolling_contact<Problem::dim>(w, q, mu, roll), u = w * r + q;
        const double eps_r = 1e-12 * (r.norm() + q.norm() / scale), eps_u = 1e-12 * (q.norm() + scale * r.norm());
        INFO("W " << w << "\nq " << q.transpose() << "\nmu " << mu << ", roll " << roll << "\nr " << r.transpose());
        REQUIRE(r[0] >= 0);
        if (q[0] >= 0) {
            REQUIRE(r.isZero(0));
            ++count.open;
            continue;
        }
        REQUIRE(std::abs(u[0]) <= eps_u);
        const bool slides =
            check_part(r.template segment<m>(1).eval(), u.template segment<m>(1).eval(), mu * r[0], eps_r, eps_u);
        const bool rolls =
            check_part(r.template tail<m>().eval(), u.template tail<m>().eval(), roll * r[0], eps_r, eps_u);
        ++(slides && rolls ? count.both : slides ? count.slides : rolls ? count.rolls : count.held);
        CHECK(error_measures(alone<Problem>(w, q, mu, roll), {r}).natural_map_velocity < 1e-11);
    }
    CHECK(count.fewest() > 100);
}

TEST_CASE("blocks without mobility of the couple, of friction or of both are solved", "[local]") {
    Random random(5);
    for (int k = 0; k < 400; ++k) {
        const Rolls3::Vec q = random_vector<Rolls3::Vec>(random);
        Rolls3::Vec diagonal(2, 1, 1, 3, 3);
        if (k % 2 == 0) diagonal.segment<2>(1).setZero();
        if (k % 4 < 2) diagonal.tail<2>().setZero();
        const Rolls3::Block w = diagonal.asDiagonal();
        const Rolls3::Vec r = detail::rolling_contact<3>(w, q, 0.5, 0.2), u = w * r + q;
        REQUIRE(detail::natural_map(r, u, std::array{0.5, 0.2}, 0.5).norm() < 1e-12);
    }
}

TEST_CASE("the nearest point of a cone with two bounds is none of those around it", "[local]") {
    Random random(8);
    int cut = 0;
    for (int k = 0; k < 2000; ++k) {
        const std::array limits{k % 5 == 0 ? 0 : uniform(random, 0, 2), k % 7 == 0 ? 0 : uniform(random, 0, 2)};
        Rolls3::Vec y = random_vector<Rolls3::Vec>(random);
        if (k % 3 == 0) y.tail<2>().setZero();
        const Rolls3::Vec p = detail::project_on_cone(y, limits);
        REQUIRE(p.segment<2>(1).norm() <= limits[0] * p[0] + 1e-15);
        REQUIRE(p.tail<2>().norm() <= limits[1] * p[0] + 1e-15);
        cut += p != y && p[0] > 0;
        for (int other = 0; other < 20; ++other) {  // the angle at p is obtuse for every point of the cone
            Rolls3::Vec x = random_vector<Rolls3::Vec>(random);
            x[0] = std::abs(x[0]);
            x.segment<2>(1) *= limits[0] * x[0] / x.segment<2>(1).norm();
            x.tail<2>() *= limits[1] * x[0] / x.tail<2>().norm();
            REQUIRE((y - p).dot(x - p) <= 1e-14);
        }
    }
    CHECK(cut > 500);
}

TEST_CASE("measures of one contact that rolls have the values found by hand", "[local]") {
    // The couple's unit: u_n = 0, u_t = 0; the spin 4 is held back by a couple of 0.1 only, of the allowed 0.2
    const Rolls2::Block w = Rolls2::Vec(1, 1, 4).asDiagonal();
    const Rolls2 problem = alone<Rolls2>(w, {-1, 0, 4.4}, 0.5, 0.2);
    const ErrorMeasures e = error_measures(problem, {{1, 0, -0.1}});
    // With rho = 1, y = (1 - 0.2 * 4, 0, -4.1) goes to 0.2 y_n (mu_r) + ...: n = (0.2 + 0.2 * 4.1)/1.04
    const double n = 1.02 / 1.04;
    CHECK(e.natural_map == Approx(std::hypot(1 - n, -0.1 + 0.2 * n) / std::hypot(1, 4.4)));
    // With the length sqrt(1/4) a couple of 0.2 is an impulse of 0.4, and a spin of 4 a velocity of 2
    const double alike = (1 - 0.4 * 2 + 0.4 * 2.2) / 1.16;
    CHECK(e.natural_map_velocity == Approx(std::hypot(1 - alike, -0.2 + 0.4 * alike) / std::hypot(1, 2.2)));
    CHECK(e.natural_map_impulse == Approx(std::hypot(1 - alike, -0.2 + 0.4 * alike) / std::hypot(1, 0.2)));
    CHECK(e.eta == Approx(0.2 / std::hypot(1, 0.4)));  // the answer's couple is -0.2
    CHECK(e.cone_excess == 0);
    CHECK(e.complementarity == 0);
    CHECK(e.dissipation == Approx((0.2 * 4 - 0.1 * 4) / 2.2));
    // Beyond its bound by 0.1, which counts as 0.2
    CHECK(error_measures(problem, {{1, 0, -0.3}}).cone_excess == Approx(0.2));

    // Lengths in another unit change nothing but what has the problem's own units.
    const Rolls2 in_mm = alone<Rolls2>(Rolls2::Vec(1, 1, 4e-6).asDiagonal(), {-1, 0, 4.4e-3}, 0.5, 0.2e3);
    const ErrorMeasures same = error_measures(in_mm, {{1, 0, -0.1e3}});
    for (auto measure : {&ErrorMeasures::natural_map_velocity, &ErrorMeasures::natural_map_impulse, &ErrorMeasures::eta,
                         &ErrorMeasures::dissipation})
        CHECK(same.*measure == Approx(e.*measure));
}

TEMPLATE_TEST_CASE("u = W r + q is the velocity that bodies with these impulses have", "[local]", Disks, Spheres) {
    using M = TestType;
    constexpr int m = M::dim - 1;
    Random random(31);
    ContactProblem<M> problem = made_up_contacts<M>(random);
    const detail::LocalForm<M> local = assemble(problem);
    REQUIRE(local.contact_count() == 12);
    for (int trial = 0; trial < 3; ++trial) {
        std::size_t c = 0;
        const auto r = local_impulses(problem);
        detail::each_contact(problem, [&](const Contact<M>& contact, auto kind) {
            const auto frame = detail::contact_frame<M>(contact.normal);
            const typename M::Impulse v = relative_velocity(problem, contact, kind);
            const typename M::Spin spin = detail::couple_of<M>(v);
            typename detail::LocalForm<M>::Vec u;
            u.template head<M::dim>() = frame * detail::force_of<M>(v);
            u[0] += contact.bias;
            if constexpr (M::dim == 3)
                u.template tail<m>() = frame.template bottomRows<2>() * spin;
            else
                u.template tail<m>() = spin;
            CHECK((local.velocity(c, r) - u).norm() < 1e-13);
            CHECK(local.limits(c) == std::array{contact.friction_coefficient, contact.rolling_coefficient});
            ++c;
        });
        std::vector<typename detail::LocalForm<M>::Vec> others;
        for (std::size_t k = 0; k < 12; ++k)
            others.push_back(random_vector<typename detail::LocalForm<M>::Vec>(random));
        set_local_impulses(problem, others);
        const auto back = local_impulses(problem);
        for (std::size_t k = 0; k < 12; ++k) CHECK((back[k] - others[k]).norm() < 1e-14);
    }
}

TEMPLATE_TEST_CASE("NLGS on blocks has the velocities of matrix-free NLGS", "[local]", Disks, Spheres) {
    using M = TestType;
    Random random(41);
    ContactProblem<M> problem = heap<M>(random, 0.02);
    REQUIRE(problem.contact_count() > 20);
    const detail::LocalForm<M> local = assemble(problem);
    REQUIRE(nlgs(problem, {.tolerance = 1e-12, .bounds = {.max_velocity_error = 1e-10}, .max_iterations = 100000})
                .converged);
    auto r = local_impulses(problem);
    CHECK(error_measures(local, r).natural_map < 1e-9);
    double speed = 0, couple = 0;
    for (const Body<M>& body : problem.bodies) speed = std::max(speed, body.v.norm());
    for (const auto& impulse : r) couple = std::max(couple, impulse.template tail<M::dim - 1>().norm());
    REQUIRE(couple > 0);

    for (auto& impulse : r) impulse.setZero();
    CHECK(block_nlgs(local, r, {.tolerance = 1e-11}).converged);
    ContactProblem<M> other = problem;
    set_local_impulses(other, r);
    for (std::size_t b = 0; b < problem.bodies.size(); ++b)
        CHECK((problem.bodies[b].v - other.bodies[b].v).norm() < 1e-6 * speed);
    const ErrorMeasures e = error_measures(local, r);
    CHECK(std::max({e.natural_map, e.natural_map_velocity, e.unilateral}) ==
          Approx(detail::stopping_error(local, r)).margin(1e-12));
    CHECK(std::max({e.eta, e.cone_excess, e.complementarity, e.dissipation}) < 1e-8);
}

TEST_CASE("what a problem that rolls cannot be is refused", "[local]") {
    Random random(3);
    ContactProblem<Spheres> problem = made_up_contacts<Spheres>(random);
    problem.contacts[2].twisting_coefficient = 1e-3;
    CHECK(complaint<std::invalid_argument>([&] { assemble(problem); }).starts_with("resistance to twisting"));
    ContactProblem<Disks> disks = made_up_contacts<Disks>(random);
    disks.contacts[2].twisting_coefficient = 1e-3;  // disks do not twist
    CHECK(complaint<std::invalid_argument>([&] { assemble(disks); }) == "");

    Rolls2 bad = alone<Rolls2>(Rolls2::Block::Identity(), {-1, 0, 0}, 0.5, 0.1);
    std::vector<Rolls2::Vec> r(1, Rolls2::Vec::Zero());
    const auto refused = [&] { return complaint<std::invalid_argument>([&] { block_nlgs(bad, r); }); };
    CHECK(refused() == "");
    bad.rolling = {-0.1};
    CHECK(refused() == "contact 0: the coefficient of rolling is negative or not finite");
    bad.rolling = {};
    CHECK(refused().find("coefficients of rolling: 0 of them, needs 1") != std::string::npos);
}
