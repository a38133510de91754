// The fast sweep as users get it, optimised and with products fused into sums at the compiler's discretion, against its
// readable twin. Compiled by itself: what the other tests share is compiled in another way.
#include <random>

#include "../catch.hpp"
#include "nscdd/plain/sweep.hpp"
#include "nscdd/sweep/sweeper.hpp"

using namespace nscdd;

namespace {

// Grains of random sizes at random speeds, each touching some of those before it and some a wall, in random directions.
// Impulses to start from, of some of the contacts.
template <class M>
ContactProblem<M> random_problem(int bodies) {
    std::mt19937 random(21);
    const auto uniform = [&random](double low, double high) {
        return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
    };
    const auto vector = [&] {
        typename M::Vec v;
        for (int d = 0; d < M::dim; ++d) v[d] = uniform(-1, 1);
        return v;
    };
    ContactProblem<M> problem;
    problem.h = 1e-3;
    problem.least_radius = 0.3;
    problem.walls.resize(3);
    for (auto& wall : problem.walls) wall.prescribed = 0.1 * vector();
    problem.walls[2].inv_mass = 0.1, problem.walls[2].speed = 0.2;
    std::vector<double> radius;
    for (int g = 0; g < bodies; ++g) {
        const double r = radius.emplace_back(uniform(0.3, 1)), mass = 4 * std::pow(r, M::dim);
        Body<M>& body = problem.bodies.emplace_back();
        body.inv_mass = 1 / mass;
        body.inv_inertia = (M::dim == 3 ? 2.5 : 2.0) / (mass * r * r);
        for (double& v : body.v) v = uniform(-1, 1);
        const auto touch = [&](std::vector<Contact<M>>& contacts, int j, double other) {
            Contact<M>& c = contacts.emplace_back();
            c.i = g, c.j = j;
            c.normal = vector().normalized();
            c.bias = uniform(-0.1, 0.1);
            c.friction_coefficient = contacts.size() % 3 == 0 ? 0.2 : 0.5;
            c.lever_i = r + c.bias / 20, c.lever_j = other + c.bias / 20;
            if (contacts.size() % 4 == 0) c.r = 0.05 * (c.normal + 0.1 * vector());
        };
        for (int k = 0; k < 3 && g > 0; ++k) {
            const int j = std::max(0, g - 1 - static_cast<int>(uniform(0, 40)));
            touch(problem.contacts, j, radius[static_cast<std::size_t>(j)]);
        }
        if (g % 3 == 0) touch(problem.wall_contacts, g / 3 % 3, 0);
    }
    return problem;
}

template <class M>
void sort(std::vector<Contact<M>>& contacts, const std::vector<int>& order) {
    std::vector<Contact<M>> sorted;
    for (const int c : order)
        if (c >= 0) sorted.push_back(contacts[static_cast<std::size_t>(c)]);
    REQUIRE(sorted.size() == contacts.size());
    contacts.swap(sorted);
}

}  // namespace

TEMPLATE_TEST_CASE("a fast sweep as it ships is a plain one", "[shipped]", (Model<2, Coulomb>), (Model<3, Coulomb>)) {
    using M = TestType;
    ContactProblem<M> fast = random_problem<M>(300);
    ContactProblem<M> plain = fast;
    Sweeper<M> sweeper;
    sweeper.load(fast);
    REQUIRE(sweeper.batched());
    sort<M>(plain.contacts, sweeper.order());
    sort<M>(plain.wall_contacts, sweeper.wall_order());
    for (int s = 0; s < 5; ++s) {
        sweeper.sweep(fast);
        plain::sweep(plain);
    }
    sweeper.store(fast);
    double speed = 0, difference = 0, impulse = 0, wrong = 0;
    for (std::size_t g = 0; g < plain.bodies.size(); ++g) {
        speed = std::max(speed, plain.bodies[g].v.norm());
        difference = std::max(difference, (plain.bodies[g].v - fast.bodies[g].v).norm());
    }
    sort<M>(fast.contacts, sweeper.order());
    sort<M>(fast.wall_contacts, sweeper.wall_order());
    const auto compare = [&](const std::vector<Contact<M>>& a, const std::vector<Contact<M>>& b) {
        for (std::size_t c = 0; c < a.size(); ++c) {
            impulse = std::max(impulse, a[c].r.norm());
            wrong = std::max(wrong, (a[c].r - b[c].r).norm());
        }
    };
    compare(plain.contacts, fast.contacts);
    compare(plain.wall_contacts, fast.wall_contacts);
    INFO("velocities differ by " << difference / speed << ", impulses by " << wrong / impulse);
    CHECK(speed > 0);
    CHECK(difference <= 1e-13 * speed);
    CHECK(impulse > 0);
    CHECK(wrong <= 1e-13 * impulse);
    CHECK(std::abs(fast.walls[2].speed - plain.walls[2].speed) <= 1e-13 * speed);
    CHECK(sweeper.residual(fast).eta() == Approx(residual_parts(plain).eta()).epsilon(1e-9));
}
