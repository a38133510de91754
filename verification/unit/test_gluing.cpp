// The interface operator X by assembly, in closed form and by elementary problems; what gluing does to copies.
#include <Eigen/Dense>

#include "nscdd/decompose/gluing.hpp"
#include "random_scenes.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

// Bodies with 2 to 8 copies and their velocities.
Copies random_copies(Random& random, int bodies, int dof) {
    Copies copies;
    copies.clear(dof);
    for (int b = 0; b < bodies; ++b) {
        copies.begin.push_back(copies.count() + 2 + static_cast<int>(random() % 7));
        for (int d = 0; d < dof; ++d) copies.inverse_mass.push_back(std::pow(10, uniform(random, -2, 2)));
    }
    return copies;
}

Buffer random_velocities(Random& random, const Copies& copies) {
    Buffer v(static_cast<std::size_t>(copies.count() * copies.dof));
    for (double& x : v) x = uniform(random, -1, 1);
    return v;
}

// Velocities of all copies in a row, in place.
void glue(auto& gluing, Copies copies, Buffer& v) {
    for (int c = 0; c < copies.count(); ++c) copies.from.push_back(v.data() + c * copies.dof);
    copies.to.assign(copies.from.size(), nullptr);
    for (std::size_t c = 0; c < copies.to.size(); ++c)
        copies.to[c] = v.data() + c * static_cast<std::size_t>(copies.dof);
    gluing.setup(copies);
    gluing(copies);
}

Eigen::MatrixXd interface_operator(const Copies& copies) {
    const Eigen::MatrixXd jumps = detail::jump_matrix(copies);
    return jumps * detail::split_inverse_masses(copies).asDiagonal() * jumps.transpose();
}

Eigen::VectorXd multipliers(const Copies& copies, const Buffer& v) {
    const Eigen::Map<const Eigen::VectorXd> velocity(v.data(), static_cast<Eigen::Index>(v.size()));
    return interface_operator(copies).ldlt().solve(Eigen::MatrixXd(detail::jump_matrix(copies)) * velocity);
}

double distance(const Buffer& a, const Buffer& b) {
    double largest = 0;
    for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(a[k] - b[k]));
    return largest;
}

}  // namespace

TEST_CASE("X is (m/M) tridiag(-1, 2, -1) per body and degree of freedom", "[gluing]") {
    Random random(5);
    const int dof = GENERATE(1, 3, 6);
    const Copies copies = random_copies(random, 20, dof);
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero((copies.count() - 20) * dof, (copies.count() - 20) * dof);
    for (int b = 0, row = 0; b < 20; ++b) {
        const int m = copies.begin[static_cast<std::size_t>(b) + 1] - copies.begin[static_cast<std::size_t>(b)];
        for (int jump = 0; jump < m - 1; ++jump)
            for (int d = 0; d < dof; ++d, ++row) {
                const double scale = m * copies.inverse_mass[static_cast<std::size_t>(b * dof + d)];
                expected(row, row) = 2 * scale;
                if (jump > 0) expected(row, row - dof) = expected(row - dof, row) = -scale;
            }
    }
    Factorised<> factorised;
    factorised.setup(copies);
    CHECK((Eigen::MatrixXd(factorised.x()) - expected).cwiseAbs().maxCoeff() <= 1e-12 * expected.maxCoeff());
}

TEST_CASE("the closed form says which degrees of freedom it is made for", "[gluing]") {
    Buffer v{1.0, 2.0};
    Copies copies;
    copies.clear(1);
    copies.begin.push_back(2);
    ClosedForm mean;
    CHECK_THROWS_WITH(glue(mean, copies, v), "copies of 1 degrees of freedom, a body has 2, 3 or 6");
}

TEST_CASE("closed form and factorised X glue alike", "[gluing]") {
    Random random(6);
    const int dof = GENERATE(2, 3, 6);
    for (int round = 0; round < 20; ++round) {
        const Copies copies = random_copies(random, 15, dof);
        const Buffer before = random_velocities(random, copies);
        Buffer closed = before, factorised = before;
        ClosedForm mean;
        glue(mean, copies, closed);
        Factorised<> cholesky;
        glue(cholesky, copies, factorised);
        CHECK(distance(closed, factorised) <= 1e-12);
        CHECK(distance(closed, before) > 0.1);

        // all copies agree: bit for bit in closed form; and the momentum of each body is what it was
        for (int b = 0; b < copies.bodies(); ++b)
            for (int d = 0; d < dof; ++d) {
                const auto first = static_cast<std::size_t>(copies.begin[static_cast<std::size_t>(b)]);
                const auto last = static_cast<std::size_t>(copies.begin[static_cast<std::size_t>(b) + 1]);
                const auto at = [&](std::size_t c) {
                    return c * static_cast<std::size_t>(dof) + static_cast<std::size_t>(d);
                };
                double sum_before = 0, sum_closed = 0, sum_factorised = 0;
                for (std::size_t c = first; c < last; ++c) {
                    CHECK(closed[at(c)] == closed[at(first)]);
                    CHECK(std::abs(factorised[at(c)] - factorised[at(first)]) <= 1e-12);
                    sum_before += before[at(c)], sum_closed += closed[at(c)], sum_factorised += factorised[at(c)];
                }
                CHECK(std::abs(sum_closed - sum_before) <= 1e-14 * double(last - first));
                CHECK(std::abs(sum_factorised - sum_before) <= 1e-12 * double(last - first));
            }
    }
}

TEST_CASE("nothing shared, nothing to glue", "[gluing]") {
    Copies copies;
    copies.clear(3);
    copies.begin.push_back(1);  // one body with a single copy
    copies.inverse_mass.assign(3, 1.0);
    Buffer v{1, 2, 3};
    Factorised<> factorised;
    glue(factorised, copies, v);
    CHECK(v == Buffer{1, 2, 3});
    ClosedForm mean;
    glue(mean, copies, v);
    CHECK(v == Buffer{1, 2, 3});
}

TEST_CASE("elementary problems (10) to (12) give the global Delta F", "[gluing]") {
    Random random(7);
    constexpr int subdomains = 6, bodies = 25, dof = 3;
    std::vector<std::vector<int>> holders(bodies);  // subdomains with a copy of each body
    Copies copies;
    copies.clear(dof);
    for (auto& ranks : holders) {
        while (ranks.size() < 2) {
            ranks.clear();
            for (int e = 0; e < subdomains; ++e)
                if (random() % 2) ranks.push_back(e);
        }
        copies.begin.push_back(copies.count() + static_cast<int>(ranks.size()));
        for (int d = 0; d < dof; ++d) copies.inverse_mass.push_back(std::pow(10, uniform(random, -1, 1)));
    }
    const Buffer v = random_velocities(random, copies);
    const Eigen::VectorXd global = multipliers(copies, v);

    const auto jumps_before = [](const Copies& c, int body) {
        return (c.begin[static_cast<std::size_t>(body)] - body) * c.dof;
    };
    Eigen::VectorXd combined = Eigen::VectorXd::Zero(global.size());
    for (int e = 0; e < subdomains; ++e) {
        Copies own;  // all copies of the bodies on the boundary of subdomain e
        own.clear(dof);
        std::vector<int> body_of;
        Buffer own_v;
        for (int b = 0; b < bodies; ++b) {
            const auto& ranks = holders[static_cast<std::size_t>(b)];
            if (std::find(ranks.begin(), ranks.end(), e) == ranks.end()) continue;
            const auto begin = copies.inverse_mass.begin() + b * dof;
            own.inverse_mass.insert(own.inverse_mass.end(), begin, begin + dof);
            own.begin.push_back(own.count() + static_cast<int>(ranks.size()));
            own_v.insert(own_v.end(), v.begin() + copies.begin[static_cast<std::size_t>(b)] * dof,
                         v.begin() + copies.begin[static_cast<std::size_t>(b) + 1] * dof);
            body_of.push_back(b);
        }
        const Eigen::VectorXd elementary = multipliers(own, own_v);
        for (int k = 0; k < own.bodies(); ++k) {
            const int b = body_of[static_cast<std::size_t>(k)];
            const auto m = static_cast<int>(holders[static_cast<std::size_t>(b)].size());
            combined.segment(jumps_before(copies, b), (m - 1) * dof) +=
                elementary.segment(jumps_before(own, k), (m - 1) * dof) / m;  // D_E = 1/m
        }
    }
    CHECK((combined - global).norm() <= 1e-12 * global.norm());

    // and it is the Delta F that gluing uses: V - M_E^-1 A^T Delta F
    Buffer glued = v;
    Factorised<> factorised;
    glue(factorised, copies, glued);
    const Eigen::VectorXd correction = detail::split_inverse_masses(copies).asDiagonal() *
                                       (Eigen::MatrixXd(detail::jump_matrix(copies)).transpose() * combined);
    for (std::size_t k = 0; k < v.size(); ++k)
        CHECK(std::abs(v[k] - correction[static_cast<Eigen::Index>(k)] - glued[k]) <= 1e-12);
}

namespace {

// A scene on `ranks` ranks whose second step is handed to `inspect(parts, comm)` with copies that disagree.
template <class M>
void with_torn_copies(int ranks, bool driven, auto&& inspect) {
    Random random(8);
    const int side = M::dim == 2 ? 6 : 4;
    Run<M> run({Scheme::dcs, ranks}, lattice_settings<M>(side, driven), shaken_lattice<M>(random, side));
    run.step();
    run.simulation.step([&](std::span<Subdomain<M>> parts, Communicator& comm, PhaseSeconds& seconds) {
        Dcs<M> dcs;
        for (auto& part : parts) {
            prepare_contacts(part.problem);
            sweep(part.problem);
        }
        inspect(std::vector(parts.begin(), parts.end()), comm);
        return nscdd_solve<M>(parts, comm, dcs, run.options, seconds);
    });
}

template <class M>
std::vector<Subdomain<M>> glued_by(auto&& scheme, std::vector<Subdomain<M>> parts, Communicator& comm) {
    for (auto& part : parts) part.sweeper.load(part.problem);
    scheme.setup(parts, comm);
    nscdd::detail::glue<M>(scheme, parts, comm);
    for (auto& part : parts) part.sweeper.store(part.problem);
    return parts;
}

// Largest difference of velocities; 0 means equal bits.
template <class M>
double difference(const std::vector<Subdomain<M>>& a, const std::vector<Subdomain<M>>& b) {
    double largest = 0;
    for (std::size_t k = 0; k < a.size(); ++k)
        for (std::size_t g = 0; g < a[k].problem.bodies.size(); ++g)
            largest = std::max(largest, (a[k].problem.bodies[g].v - b[k].problem.bodies[g].v).norm());
    return largest;
}

// The definition: every active copy takes the mean of the active copies.
template <class M>
std::vector<Subdomain<M>> glued_by_hand(std::vector<Subdomain<M>> parts) {
    struct Sum {
        typename M::Velocity v = M::Velocity::Zero();
        int copies = 0;
    };
    std::map<int, Sum> sums;
    const auto visit = [&](auto&& call) {
        for (auto& part : parts) {
            std::vector<char> touched(part.grains.size(), 0);
            for (const auto& c : part.problem.contacts)
                touched[static_cast<std::size_t>(c.i)] = touched[static_cast<std::size_t>(c.j)] = 1;
            for (const auto& c : part.problem.wall_contacts) touched[static_cast<std::size_t>(c.i)] = 1;
            for (std::size_t g = 0; g < part.grains.size(); ++g)
                if (touched[g]) call(sums[part.grains[g].id], part.problem.bodies[g]);
        }
    };
    visit([](Sum& sum, const Body<M>& body) { sum.v += body.v, ++sum.copies; });
    visit([](const Sum& sum, Body<M>& body) { body.v = sum.v / sum.copies; });
    return parts;
}

}  // namespace

TEMPLATE_TEST_CASE("both schemes, with X in closed form or factorised, average the active copies", "[gluing]",
                   SmoothDisks, FrictionDisks, FrictionSpheres) {
    using M = TestType;
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    const int ranks = GENERATE(2, 3, 8);
    INFO("ranks: " << ranks);
    with_torn_copies<M>(ranks, driven, [](const std::vector<Subdomain<M>>& torn, Communicator& comm) {
        const auto by_hand = glued_by_hand(torn);
        REQUIRE(difference(torn, by_hand) > 1e-3);
        const auto ccs = glued_by(Ccs<M, ClosedForm>{}, torn, comm), dcs = glued_by(Dcs<M, ClosedForm>{}, torn, comm);
        CHECK(difference(ccs, by_hand) <= 1e-14);
        CHECK(difference(ccs, dcs) == 0);
        CHECK(difference(glued_by(Ccs<M, Factorised<>>{}, torn, comm), by_hand) <= 1e-12);
        CHECK(difference(glued_by(Dcs<M, Factorised<>>{}, torn, comm), by_hand) <= 1e-12);

        std::size_t sent = 0;  // by all but rank 0, to it and back
        for (std::size_t k = 1; k < torn.size(); ++k) sent += M::dof * torn[k].interface.size();
        auto parts = torn;
        Ccs<M, ClosedForm> scheme;
        for (auto& part : parts) part.sweeper.load(part.problem);
        scheme.setup(parts, comm);
        const double before = comm.traffic().bytes;
        nscdd::detail::glue<M>(scheme, parts, comm);
        CHECK(comm.traffic().bytes - before == 2.0 * sizeof(double) * static_cast<double>(sent));
    });
}

namespace {

template <class Scheme, class M>
void check_copies_after_steps(int ranks, bool driven) {
    Random random(9);
    const int side = M::dim == 2 ? 6 : 3;
    InProcess comm(ranks);
    Simulation<M> simulation(comm, lattice_settings<M>(side, driven), shaken_lattice<M>(random, side));
    for (int step = 0; step < 8; ++step) {
        simulation.step(by_nscdd<Scheme>(SolveOptions{}));
        std::map<int, const Grain<M>*> seen;
        int copies = 0;
        for (const auto& part : simulation.parts())
            for (std::size_t w = 0; w < part.problem.walls.size(); ++w)
                CHECK(part.problem.walls[w].speed == simulation.parts()[0].problem.walls[w].speed);
        for (const auto& part : simulation.parts())
            for (const auto& grain : part.grains) {
                const auto [first, is_new] = seen.emplace(grain.id, &grain);
                if (is_new) continue;
                ++copies;
                CHECK(grain.position == first->second->position);
                CHECK(grain.velocity == first->second->velocity);
            }
        CHECK(copies > 3);
    }
}

}  // namespace

TEMPLATE_TEST_CASE("after a step all copies of a grain have the same bits", "[gluing][long]", SmoothDisks,
                   FrictionSpheres) {
    const bool driven = GENERATE(false, true);
    CAPTURE(driven);
    const int ranks = GENERATE(2, 5);
    INFO("ranks: " << ranks);
    check_copies_after_steps<Ccs<TestType, ClosedForm>, TestType>(ranks, driven);
    check_copies_after_steps<Ccs<TestType, Factorised<>>, TestType>(ranks, driven);
    check_copies_after_steps<Dcs<TestType, ClosedForm>, TestType>(ranks, driven);
    check_copies_after_steps<Dcs<TestType, Factorised<>>, TestType>(ranks, driven);
}
