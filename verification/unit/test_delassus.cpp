// The matrix-free sweep against H, M^-1 and W = H^T M^-1 H written out.
#include <set>
#include "nscdd/plain/nscdd.hpp"

#include "random_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

template <class M>
Eigen::MatrixXd inverse_mass(const Body<M>& body, double multiplicity) {
    Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(M::dof, body.inv_mass / multiplicity);
    if constexpr (M::friction) diagonal.tail(M::spins).setConstant(body.inv_inertia / multiplicity);
    return diagonal.asDiagonal();
}

// Compares W with the two numbers that the kernel keeps of it, to 1e-14 of the largest.
void check_diagonal(const Eigen::MatrixXd& w, const detail::DelassusDiagonal& kernel) {
    Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(w.rows(), kernel.tangential);
    diagonal[0] = kernel.normal;
    const Eigen::MatrixXd difference = w - Eigen::MatrixXd(diagonal.asDiagonal());
    CHECK(difference.cwiseAbs().maxCoeff() <= 1e-14 * w.cwiseAbs().maxCoeff());
}

// One contact of two random bodies, or of the first and a wall, with split masses.
template <class M>
ContactProblem<M> random_pair(Random& random, bool wall, bool driven) {
    ContactProblem<M> problem;
    problem.bodies.resize(2);
    problem.walls.resize(1);
    problem.multiplicity = {1 + static_cast<int>(random() % 8), 1 + static_cast<int>(random() % 8)};
    problem.wall_multiplicity = {1 + static_cast<int>(random() % 8)};
    for (Body<M>& body : problem.bodies) {
        body.inv_mass = std::pow(10, uniform(random, -2, 2));
        if constexpr (M::friction) body.inv_inertia = std::pow(10, uniform(random, -2, 2));
    }
    if (driven) problem.walls[0].inv_mass = std::pow(10, uniform(random, -2, 2));
    Contact<M> c;
    c.j = wall ? 0 : 1;
    c.normal = random_unit<M>(random);
    if constexpr (M::friction) c.lever_i = uniform(random, 0.1, 2), c.lever_j = wall ? 0 : uniform(random, 0.1, 2);
    (wall ? problem.wall_contacts : problem.contacts).push_back(c);
    return problem;
}

}  // namespace

TEMPLATE_TEST_CASE("W of a contact is diagonal, isotropic in the tangent plane, and the kernel's", "[delassus]",
                   SmoothDisks, FrictionDisks, SmoothSpheres, FrictionSpheres) {
    using M = TestType;
    Random random(3);
    for (int k = 0; k < 10000; ++k) {
        const bool wall = k % 4 == 3, driven = k % 8 == 7;
        const ContactProblem<M> problem = random_pair<M>(random, wall, driven);
        const Contact<M>& c = wall ? problem.wall_contacts[0] : problem.contacts[0];
        double lever_i = 0, lever_j = 0;
        if constexpr (M::friction) lever_i = c.lever_i, lever_j = c.lever_j;
        const Eigen::MatrixXd axes = plain::contact_axes<M>(c.normal);
        const Eigen::MatrixXd ha = plain::contact_map<M>(axes, -lever_i * c.normal);
        const Eigen::MatrixXd hb = plain::contact_map<M>(axes, lever_j * c.normal);
        for (const bool split : {true, false}) {
            const auto share = [&](int multiplicity) { return split ? 1.0 : double(multiplicity); };
            Eigen::MatrixXd w = ha * inverse_mass(problem.bodies[0], share(problem.multiplicity[0])) * ha.transpose();
            if (!wall) w += hb * inverse_mass(problem.bodies[1], share(problem.multiplicity[1])) * hb.transpose();
            if (wall) w(0, 0) += problem.walls[0].inv_mass / share(problem.wall_multiplicity[0]);
            check_diagonal(w, wall ? detail::delassus(problem, c, split, WithWall{})
                                   : detail::delassus(problem, c, split, BetweenGrains{}));
        }
    }
}

TEMPLATE_TEST_CASE("a sweep is the plain sweep", "[delassus]", EVERY_MODEL) {
    using M = TestType;
    Random random(4);
    const int side = M::dim == 2 ? 9 : 5;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    Run<M> run(nlgs_alone, lattice_settings<M>(side, driven), shaken_lattice<M>(random, side));
    run.step();  // so that contacts bring impulses along
    run.simulation.step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) {
        ContactProblem<M>& fast = parts[0].problem;
        ContactProblem<M> plain = fast;
        prepare_contacts(fast);
        REQUIRE(fast.contacts.size() > 50);
        REQUIRE(fast.wall_contacts.size() > 10);
        for (int s = 0; s < 5; ++s) {
            sweep(fast);
            plain::sweep(plain);
            double largest = 0, difference = 0;
            for (std::size_t k = 0; k < fast.bodies.size(); ++k) {
                largest = std::max(largest, plain.bodies[k].v.norm());
                difference = std::max(difference, (fast.bodies[k].v - plain.bodies[k].v).norm());
            }
            for (std::size_t w = 0; w < fast.walls.size(); ++w)
                difference = std::max(difference, std::abs(fast.walls[w].speed - plain.walls[w].speed));
            CHECK(difference <= 1e-12 * largest);

            largest = difference = 0;
            const auto compare = [&](const std::vector<Contact<M>>& a, const std::vector<Contact<M>>& b) {
                for (std::size_t k = 0; k < a.size(); ++k) {
                    largest = std::max(largest, b[k].r.norm());
                    difference = std::max(difference, (a[k].r - b[k].r).norm());
                }
            };
            compare(fast.contacts, plain.contacts);
            compare(fast.wall_contacts, plain.wall_contacts);
            CHECK(largest > 0);
            CHECK(difference <= 1e-12 * largest);
        }
        return nlgs(fast, run.options);
    });
}

TEMPLATE_TEST_CASE("the plain NSCDD is the plain NLGS on one subdomain, and finds its answer on three", "[delassus]",
                   SmoothDisks, SmoothSpheres, FrictionDisks, FrictionSpheres) {
    using M = TestType;
    Random random(5);
    const int side = M::dim == 2 ? 7 : 4;
    Run<M> run(nlgs_alone, lattice_settings<M>(side, false), shaken_lattice<M>(random, side));
    run.step();  // so that contacts bring impulses along
    run.simulation.step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) {
        ContactProblem<M>& fast = parts[0].problem;
        ContactProblem<M> alone = fast, one = fast, three = fast;
        const double tolerance = 1e-9;
        const SolveReport reference = plain::nlgs(alone, tolerance);
        CHECK(reference.converged);

        const auto third = [&](std::size_t body) { return std::min(2, int(3 * fast.centres[body][0] / side)); };
        std::vector<int> owner, owner_at_wall, none(fast.contact_count(), 0);
        for (const Contact<M>& c : fast.contacts) owner.push_back(third(static_cast<std::size_t>(c.i)));
        for (const Contact<M>& c : fast.wall_contacts) owner_at_wall.push_back(third(static_cast<std::size_t>(c.i)));
        REQUIRE(std::set(owner.begin(), owner.end()).size() == 3);
        const SolveReport same = plain::nscdd<M>(one, none, none, 1, tolerance);
        CHECK(same.iterations == reference.iterations);
        const SolveReport glued = plain::nscdd<M>(three, owner, owner_at_wall, 3, tolerance);
        CHECK(glued.converged);
        CHECK(residual_parts(three).eta() <= tolerance);

        SolveOptions options = run.options;
        options.tolerance = tolerance;
        options.check_every = 1;
        options.bounds = {1e30, 1e30, options.bounds.max_penetration, 1e30, 1e30};  // eta alone
        const SolveReport report = nlgs(fast, options);
        CHECK(std::abs(report.iterations - reference.iterations) <= 2 + reference.iterations / 5);
        double largest = 0, apart_one = 0, apart_three = 0, apart_fast = 0;
        for (std::size_t g = 0; g < alone.bodies.size(); ++g) {
            const auto from_reference = [&](const ContactProblem<M>& problem) {
                return (problem.bodies[g].v - alone.bodies[g].v).norm();
            };
            largest = std::max(largest, alone.bodies[g].v.norm());
            apart_one = std::max(apart_one, from_reference(one));
            apart_three = std::max(apart_three, from_reference(three));
            apart_fast = std::max(apart_fast, from_reference(fast));
        }
        CHECK(apart_one <= 1e-12 * largest);
        if constexpr (!M::friction) {  // with friction velocities need not be unique
            CHECK(apart_three <= 1e-3 * largest);
            CHECK(apart_fast <= 1e-3 * largest);
        }
        return report;
    });
}
