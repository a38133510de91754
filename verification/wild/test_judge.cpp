// The judge of random scenes on problems whose answer is known.
#include "../catch.hpp"
#include "draw.hpp"
#include "verdict.hpp"

using namespace wild;

namespace {

// Bodies on a line, each of its mass; contact c lets body i leave body j upwards, j = -1 is the floor.
Quadratic on_a_line(const std::vector<double>& masses, const std::vector<std::pair<int, int>>& contacts) {
    Quadratic problem;
    const auto bodies = static_cast<Eigen::Index>(masses.size()), count = static_cast<Eigen::Index>(contacts.size());
    problem.mass = Eigen::Map<const Vector>(masses.data(), bodies);
    problem.free = Vector::Constant(bodies, -1);
    problem.bias = Vector::Zero(count);
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index c = 0; c < count; ++c) {
        const auto [i, j] = contacts[static_cast<std::size_t>(c)];
        entries.emplace_back(i, c, 1.0);
        if (j >= 0) entries.emplace_back(j, c, -1.0);
    }
    problem.h.resize(bodies, count);
    problem.h.setFromTriplets(entries.begin(), entries.end());
    for (Eigen::Index b = 0; b <= bodies; ++b) problem.begin.push_back(b);
    problem.component.assign(masses.size(), 0);
    problem.contact_component.assign(contacts.size(), 0);
    problem.components = 1;
    return problem;
}

// The answer by trying every set of contacts.
Vector by_trying(const Quadratic& problem) {
    const Eigen::Index count = problem.bias.size();
    const Eigen::MatrixXd h(problem.h), w = h.transpose() * problem.mass.cwiseInverse().asDiagonal() * h;
    const Vector q = problem.w(problem.free);
    Vector best = problem.free;
    double least = std::numeric_limits<double>::infinity();
    for (int set = 0; set < 1 << count; ++set) {
        std::vector<Eigen::Index> in;
        for (Eigen::Index c = 0; c < count; ++c)
            if (set >> c & 1) in.push_back(c);
        Vector r = Vector::Zero(count);
        if (!in.empty()) r(in) = -w(in, in).completeOrthogonalDecomposition().solve(Vector(q(in)));
        const double worst = std::max(-(w * r + q).minCoeff(), -r.minCoeff());
        if (worst < least) least = worst, best = problem.free + problem.mass.cwiseInverse().cwiseProduct(h * r);
    }
    return best;
}

}  // namespace

TEST_CASE("the active-set method finds what trying every set finds", "[wild]") {
    Draw draw(3);
    for (int k = 0; k < 200; ++k) {
        const int bodies = draw.integer(1, 4), count = draw.integer(1, 7);
        std::vector<double> masses;
        for (int b = 0; b < bodies; ++b) masses.push_back(draw.log_uniform(1e-2, 1e2));
        std::vector<std::pair<int, int>> contacts;
        for (int c = 0; c < count; ++c) {  // some of them twice
            const int i = draw.integer(0, bodies - 1);
            contacts.emplace_back(i, draw.integer(-1, i - 1));
        }
        Quadratic problem = on_a_line(masses, contacts);
        problem.free = draw.vector<Eigen::Matrix<double, 4, 1>>(1).head(bodies);
        for (double& b : problem.bias) b = draw.chance(0.5) ? 0 : draw.uniform(0, 1);
        const Answer answer = solve(problem);
        CAPTURE(k);
        CHECK(answer.solved);
        CHECK(answer.room);
        CHECK((answer.v - by_trying(problem)).norm() < 1e-7);
    }
}

TEST_CASE("heavy on light, contacts that are there twice, and a long column", "[wild]") {
    for (const double ratio : {1.0, 1e4, 1e8}) {
        const Answer pair = solve(on_a_line({1, ratio}, {{0, -1}, {1, 0}, {1, 0}}));
        CHECK(pair.solved);
        CHECK(pair.v.cwiseAbs().maxCoeff() < 1e-7);
    }
    std::vector<std::pair<int, int>> contacts;
    for (int k = 0; k < 300; ++k) contacts.emplace_back(k, k - 1);
    const Answer column = solve(on_a_line(std::vector<double>(300, 1), contacts));
    CHECK(column.solved);
    CHECK(column.v.cwiseAbs().maxCoeff() < 1e-8);
    CHECK(column.r[0] == Approx(300));
}

TEST_CASE("where walls leave no room there is no answer", "[wild]") {
    Quadratic squeezed = on_a_line({1, 1}, {{0, -1}, {1, 0}, {1, -1}});
    squeezed.h.coeffRef(1, 2) = -1;  // a wall above that comes down, and a floor that does not
    squeezed.bias[2] = -0.5;
    CHECK_FALSE(solve(squeezed).room);
    squeezed.bias[2] = 0.5;
    CHECK(solve(squeezed).room);
}

TEST_CASE("the verdict sees a small component beside a large one", "[wild]") {
    Captured found;
    found.problem = on_a_line({1e6, 1}, {{0, -1}, {1, -1}});
    found.problem.component = found.problem.contact_component = {0, 1};
    found.problem.components = 2;
    const Answer answer = solve(found.problem);
    found.v = answer.v, found.r = answer.r;
    found.work = Vector::Zero(2);
    CHECK(judge(found, answer).component < 1e-7);
    found.v[1] = -0.5;  // half of its change is missing
    const Verdict verdict = judge(found, answer);
    CHECK(verdict.component == Approx(0.5));
    CHECK(verdict.distance == Approx(0.5e-3).epsilon(1e-3));
    found.work[1] = 0.1;
    CHECK(judge_energy(found).made_component == Approx(0.1 / 0.25));
}

TEST_CASE("round-off of the velocities that a solve began with is no distance", "[wild]") {
    Captured found;
    found.problem = on_a_line({1}, {{0, -1}});
    found.problem.free[0] = -1e-9;
    const Answer answer = solve(found.problem);
    found.r = answer.r, found.work = Vector::Zero(1);
    found.v = Vector::Constant(1, -1e-9);  // nothing has been solved
    CHECK(judge(found, answer).component == Approx(1));
    found.start = Vector::Constant(1, 1e3);
    CHECK(judge(found, answer).component == Approx(1e-9 / 1e-7));
    found.start[0] = 1;  // round-off of that is too small to hide it
    CHECK(judge(found, answer).component == Approx(1));
}
