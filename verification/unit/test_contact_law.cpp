// The one-contact solve against the law itself: Signorini first, then Coulomb's disk |r_t| <= mu r_n'.
#include <numbers>

#include "nscdd/sweep/nlgs.hpp"
#include "random_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

using Small = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;  // up to three numbers

// One contact by itself, in its own axes (normal first): v(r') = v + W (r' - r).
struct OneContact {
    Small v, r;
    double wn, wt, mu, bias;
};

double signorini_error(const OneContact& c, double rn) {
    const double gap_speed = c.v[0] + c.wn * (rn - c.r[0]) + c.bias;
    return std::abs(std::min(c.wn * rn, gap_speed));
}

// Zero where there is no slip, or slip opposite to an impulse on the edge of the disk: both say that pushing the
// impulse against the slip and back into the disk changes nothing. (Products such as |r_t||v_t| + r_t.v_t are zero
// there as well, but nearly so far around, which no search likes.)
double coulomb_error(const OneContact& c, double rn, const Small& rt) {
    const Eigen::Index tangents = c.v.size() - 1;
    const Small slip = c.v.tail(tangents) + c.wt * (rt - c.r.tail(tangents));
    Small pushed = rt - slip;
    if (pushed.norm() > c.mu * rn) pushed *= c.mu * rn / pushed.norm();
    return (rt - pushed).norm();
}

// Least error over one or two coordinates within [-1, 1]: a grid, then finer grids around its best point.
Small search(Eigen::Index dim, auto&& error) {
    constexpr int half = 20, side = 2 * half + 1;
    Small best = Small::Zero(dim);
    double least = error(best);
    for (double step = 1.0 / half; step > 1e-12; step *= 0.3) {
        const Small centre = best;
        for (int k = 0; k < (dim == 2 ? side * side : side); ++k) {
            Small at = centre;
            at[0] += step * (k % side - half);
            if (dim == 2) at[1] += step * (k / side - half);
            at = at.cwiseMax(-1).cwiseMin(1);
            if (const double e = error(at); e < least) least = e, best = at;
        }
    }
    return best;
}

Small brute_force(const OneContact& c) {
    Small r = Small::Zero(c.v.size());
    const double bound = c.r[0] + (std::abs(c.v[0]) + c.bias) / c.wn;
    const auto normal = [&](const Small& x) { return 0.5 * bound * (1 + x[0]); };
    r[0] = normal(search(1, [&](const Small& x) { return signorini_error(c, normal(x)); }));

    // polar coordinates, so that the edge of the disk is a line of the grid
    const Eigen::Index tangents = c.v.size() - 1;
    const auto tangent = [&](const Small& x) {
        Small rt(tangents);
        if (tangents == 1) rt << c.mu * r[0] * x[0];
        if (tangents == 2) {
            const double length = 0.5 * c.mu * r[0] * (1 + x[0]), angle = std::numbers::pi * x[1];
            rt << length * std::cos(angle), length * std::sin(angle);
        }
        return rt;
    };
    if (tangents > 0)
        r.tail(tangents) =
            tangent(search(tangents, [&](const Small& x) { return coulomb_error(c, r[0], tangent(x)); }));
    return r;
}

OneContact random_contact(Random& random, Eigen::Index size) {
    OneContact c;
    c.v.resize(size), c.r.resize(size);
    for (Eigen::Index d = 0; d < size; ++d) c.v[d] = uniform(random, -1, 1), c.r[d] = uniform(random, -1, 1);
    c.r[0] = uniform(random, 0, 1);
    c.wn = uniform(random, 0.5, 3);
    c.wt = c.wn * uniform(random, 1, 4);
    c.mu = uniform(random, 0, 1.5);
    c.bias = uniform(random, 0, 1) < 0.5 ? 0 : uniform(random, 0, 1);
    return c;
}

// The kernel's answer: the axes of a frictionless contact are n alone, else the world's with n the first of them.
template <class M>
Small kernel_answer(const OneContact& c) {
    Contact<M> contact;
    contact.normal = M::Vec::UnitX();
    contact.bias = c.bias;
    contact.r = c.r;
    if constexpr (M::friction) contact.friction_coefficient = c.mu;
    return solve_contact<M>(contact, typename M::Impulse(c.v), 1 / c.wn, 1 / c.wt);
}

enum State { open, stick, slip };

// Fails unless (v, r) satisfy the law at a contact with normal n, to 1e-13. Returns what the contact does.
template <class M>
State check_law(const typename M::Impulse& v, const typename M::Impulse& r, const typename M::Vec& n, double bias,
                double mu) {
    constexpr double small = 1e-13;
    if constexpr (!M::friction) {
        (void)n, (void)mu;
        CHECK(r[0] >= 0);
        CHECK(v[0] + bias >= -small);
        CHECK(std::abs(r[0] * (v[0] + bias)) <= small);
        return r[0] > 0 ? stick : open;
    } else {
        const double rn = r.dot(n), vn = v.dot(n);
        CHECK(rn >= -small);
        CHECK(vn + bias >= -small);
        CHECK(std::abs(rn * (vn + bias)) <= small);
        const typename M::Vec rt = r - rn * n, vt = v - vn * n;
        CHECK(rt.norm() <= mu * rn + small);
        if (rn <= small) return open;
        if (vt.norm() <= small) return stick;
        CHECK(rt.norm() == Approx(mu * rn).epsilon(0).margin(small));
        CHECK((rt * vt.norm() + mu * rn * vt).norm() <= small);
        return slip;
    }
}

}  // namespace

TEMPLATE_TEST_CASE("the one-contact solve is what a search over Coulomb's law finds", "[law]", SmoothDisks,
                   FrictionDisks, FrictionSpheres) {
    Random random(1);
    for (int k = 0; k < (TestType::dim == 3 ? 60 : 300); ++k) {
        const OneContact c = random_contact(random, TestType::Impulse::RowsAtCompileTime);
        const Small found = brute_force(c), answer = kernel_answer<TestType>(c);
        INFO("case " << k << ": searched " << found.transpose() << ", answered " << answer.transpose());
        CHECK((found - answer).norm() < 1e-7);
    }
}

TEMPLATE_TEST_CASE("one sweep solves one contact exactly", "[law]", SmoothDisks, FrictionDisks, SmoothSpheres,
                   FrictionSpheres) {
    using M = TestType;
    Random random(2);
    int seen[3] = {0, 0, 0};
    for (int k = 0; k < 4000; ++k) {
        ContactProblem<M> problem;
        problem.bodies.resize(2);
        problem.walls.resize(1);
        problem.multiplicity = {2, 3};  // the sweep takes the split masses, which are those of the bodies
        problem.wall_multiplicity = {4};
        for (Body<M>& body : problem.bodies) {
            body.v = random_vector<typename M::Velocity>(random);
            body.inv_mass = uniform(random, 0.5, 2);
            if constexpr (M::friction) body.inv_inertia = uniform(random, 0.5, 5);
        }
        problem.walls[0].prescribed = random_vector<typename M::Vec>(random);
        if (k % 4 > 1) {  // driven
            problem.walls[0].prescribed.setZero();
            problem.walls[0].speed = uniform(random, -1, 1);
            problem.walls[0].inv_mass = uniform(random, 0.5, 2);
        }
        const bool wall = k % 2;
        Contact<M> c;
        c.j = wall ? 0 : 1;
        c.normal = random_unit<M>(random);
        c.bias = uniform(random, 0, 0.5);
        double mu = 0;
        if constexpr (M::friction) {
            mu = c.friction_coefficient = uniform(random, 0, 1);
            c.lever_i = uniform(random, 0.5, 1);
            c.lever_j = wall ? 0 : uniform(random, 0.5, 1);
            c.r = uniform(random, 0, 1) * c.normal + random_vector<typename M::Vec>(random, 0.1);
        } else {
            c.r[0] = uniform(random, 0, 1);
        }
        (wall ? problem.wall_contacts : problem.contacts).push_back(c);
        prepare_contacts(problem);
        sweep(problem);

        const Contact<M>& solved = wall ? problem.wall_contacts[0] : problem.contacts[0];
        const typename M::Impulse v =
            wall ? relative_velocity(problem, solved, WithWall{}) : relative_velocity(problem, solved, BetweenGrains{});
        INFO("case " << k);
        ++seen[check_law<M>(v, solved.r, c.normal, c.bias, mu)];
        CHECK(std::sqrt(residual_parts(problem).change) < 1e-13);
    }
    CHECK(seen[open] > 100);
    CHECK(seen[stick] > 100);
    CHECK((seen[slip] > 100 || !M::friction));
}

TEST_CASE("a contact without impulse, velocity or friction has a finite answer", "[law]") {
    OneContact c{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 1, 2, 0, 0};
    CHECK(kernel_answer<FrictionSpheres>(c) == Small(Eigen::Vector3d::Zero()));
    c.v = Eigen::Vector3d(-1, 1, 1);
    CHECK(kernel_answer<FrictionSpheres>(c) == Small(Eigen::Vector3d(1, 0, 0)));
}
