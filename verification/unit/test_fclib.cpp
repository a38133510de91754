// FCLIB files written and read back, and the ways between them and the kernel's blocks.
#include "files/fclib.hpp"

#include <limits>

#include "../catch.hpp"
#include "files/hdf5.hpp"
#include "made_up_contacts.hpp"
#include "model/global_form.hpp"
#include "model/local_form.hpp"
#include "scratch.hpp"

using namespace nscdd;
using namespace nscdd::test;

namespace {

// Two contacts of one body with two translations and a spin, u = H^T v + w; M is not symmetric.
GlobalProblem two_contacts() {
    GlobalProblem problem;
    problem.dim = 2;
    Eigen::MatrixXd m(3, 3), h(3, 4);
    m << 2, 0.5, 0, -0.5, 2, 0, 0, 0, 1;
    h << 1, 0, 0, 1, 0, 1, 1, 0, 0, 0.5, 0.2, -0.5;
    problem.m = m.sparseView();
    problem.h = h.sparseView();
    problem.f = Eigen::Vector3d(-1, -2, 0.5);
    problem.w = Eigen::Vector4d(0.1, 0.2, -0.3, 0.4);
    problem.friction = Eigen::Vector2d(0.3, 0.7);
    return problem;
}

bool equal(const LocalProblem& a, const LocalProblem& b) {
    return a.dim == b.dim && a.q == b.q && a.friction == b.friction && a.rolling == b.rolling &&
           Eigen::MatrixXd(a.w) == Eigen::MatrixXd(b.w);
}

}  // namespace

TEST_CASE("A global problem is condensed, and its velocities come back", "[fclib]") {
    const GlobalProblem global = two_contacts();
    const LocalProblem local = condense(global);
    const Eigen::Vector4d r(1, 0.2, 0.5, -0.3);
    const Eigen::VectorXd v = body_velocities(global, r);
    CHECK((global.m * v - global.h * r - global.f).norm() < 1e-14);
    CHECK((local.w * r + local.q - global.h.transpose() * v - global.w).norm() < 1e-14);

    GlobalProblem singular = global;
    singular.m *= 0;
    CHECK(complaint<std::runtime_error>([&] { condense(singular); }) == "the mass matrix M is singular");
}

TEST_CASE("Blocks and sparse matrices hold the same problem", "[fclib]") {
    const LocalProblem local = condense(two_contacts());
    const DelassusProblem<2> blocks = to_blocks<2>(local);
    CHECK(blocks.contact_count() == 2);
    CHECK(blocks.blocks[1] == Eigen::MatrixXd(local.w).topRightCorner(2, 2));
    CHECK(equal(to_sparse(blocks), local));

    LocalProblem stuck = local;
    stuck.w.coeffRef(2, 2) = 0;
    CHECK(complaint<std::runtime_error>([&] { to_blocks<2>(stuck); }).starts_with("contact 1: W_NN is 0"));
}

TEST_CASE("A local problem and its solution are written and read", "[fclib]") {
    const Scratch scratch;
    const std::string path = scratch.path("problem.hdf5"), solved = scratch.path("solved.hdf5");
    const LocalProblem local = condense(two_contacts());
    FclibSolution solution;
    solution.r = Eigen::Vector4d(1, 2, 3, 4);
    solution.u = local.w * solution.r + local.q;
    solution.natural_map = 0.25;
    solution.solver = "first";
    write_fclib(path, local, solution, {"a title", "a description", ""});
    CHECK(equal(std::get<LocalProblem>(read_fclib(path)), local));
    CHECK(scratch.files() == std::vector<std::string>{"problem.hdf5"});

    solution.r *= 2;
    solution.natural_map = 0.5;
    solution.solver = "second";
    {
        FileSet files;
        write_fclib_solution(files, solved, path, solution);  // replaces the solution and its error
        files.commit();
    }
    CHECK(equal(std::get<LocalProblem>(read_fclib(solved)), local));
    const hdf5::Reader file(solved);
    CHECK(file.read<double>("solution/r", {4}) == std::vector<double>{2, 4, 6, 8});
    CHECK(!file.has("solution/v"));
    CHECK(!file.has("nowhere/v"));

    const auto refused = complaint<InputError>([&] { read_fclib(scratch.write("text.hdf5", "no HDF5")); });
    CHECK(refused.find("text.hdf5") != std::string::npos);
    CHECK(!complaint<OutputError>([&] { write_fclib(scratch.path("no/folder"), local, solution, {}); }).empty());
}

TEMPLATE_TEST_CASE("The global form of a model is condensed to its local one, and is read as it was written", "[fclib]",
                   SmoothDisks, FrictionSpheres, (Model<2, Rolling>), (Model<3, Rolling>)) {
    using M = TestType;
    Random random(7);
    const ContactProblem<M> problem = made_up_contacts<M>(random);
    const LocalProblem local = to_sparse(assemble(problem));
    const GlobalProblem global = global_form(problem);
    CHECK(global.f.size() == 5 * M::dof + 1);  // one body is fixed, one wall driven
    const auto same = [&](const LocalProblem& other) {
        CHECK((Eigen::MatrixXd(other.w) - Eigen::MatrixXd(local.w)).norm() < 1e-13 * local.w.norm());
        CHECK((other.q - local.q).norm() < 1e-13 * local.q.norm());
        CHECK(other.friction == local.friction);
        CHECK(other.rolling == local.rolling);
        CHECK(other.size() == detail::LocalForm<M>::size);
    };
    same(condense(global));
    // velocities with the impulses are those that the bodies have
    const Eigen::VectorXd v = body_velocities(global, flat(local_impulses(problem)));
    for (int b = 0; b < 5; ++b)
        CHECK((v.segment<M::dof>(b * M::dof) - problem.bodies[static_cast<std::size_t>(b)].v).norm() < 1e-13);
    CHECK(v[v.size() - 1] == Approx(problem.walls[1].speed));

    const Scratch scratch;
    const std::string path = scratch.path("problem.hdf5");
    FclibSolution solution;
    solution.r = solution.u = local.q, solution.v = v;
    write_fclib(path, global, solution, {});
    const auto read = std::get<GlobalProblem>(read_fclib(path));
    CHECK(Eigen::MatrixXd(read.m) == Eigen::MatrixXd(global.m));
    CHECK(Eigen::MatrixXd(read.h) == Eigen::MatrixXd(global.h));
    CHECK((read.f == global.f && read.w == global.w && read.rolling == global.rolling && read.dim == M::dim));
    CHECK(hdf5::Reader(path).has(M::rolling ? "fclib_global_rolling" : "fclib_global"));
    write_fclib(path, local, solution, {});
    CHECK(equal(std::get<LocalProblem>(read_fclib(path)), local));
    CHECK(hdf5::Reader(path).has(M::rolling ? "fclib_local_rolling" : "fclib_local"));
}

TEST_CASE("A matrix that promises more than it holds is refused before it is made", "[fclib][bad-input]") {
    const Scratch scratch;
    const std::string path = scratch.path("problem.hdf5");
    struct Scalars {
        int m = 2, n = 2, nz = -1;
        std::vector<int> p{0, 1, 2};
    };
    const auto refused = [&](const Scalars& w, bool global = false) {
        hdf5::Writer file(path);
        const std::string group = global ? "fclib_global" : "fclib_local";
        file.write<int>(group + "/spacedim", {2}, {1});
        file.write<double>(group + "/vectors/mu", {0.3}, {1});
        if (global) file.write<double>(group + "/vectors/f", {}, {0});
        file.write<double>(group + "/vectors/q", {-1, 0}, {2});
        for (const auto& [name, value] : {std::pair("m", w.m), {"n", w.n}, {"nz", w.nz}})
            file.write<int>(group + "/W/" + name, {value}, {1});
        file.write<int>(group + "/W/i", {0, 1}, {2});
        file.write<int>(group + "/W/p", w.p, {w.p.size()});
        file.write<double>(group + "/W/x", {1, 1}, {2});
        file.save();
        return complaint<InputError>([&] { read_fclib(path); });
    };
    constexpr int most = std::numeric_limits<int>::max();
    CHECK(refused({}) == "");
    CHECK(refused({.m = most, .n = most, .nz = 2}) ==
          path + ": dataset 'fclib_local/W/m': must be 2 by 2, found 2147483647 by 2147483647");
    CHECK(refused({.nz = most}) == path + ": dataset 'fclib_local/W/i': must have 2147483647 entries, found 2");
    CHECK(refused({.p = {0, 1, most}}) == path + ": dataset 'fclib_local/W/i': must have 2147483647 entries, found 2");
    CHECK(refused({.p = {}}) == path + ": dataset 'fclib_local/W/p': must rise from 0 over 3 entries");
    CHECK(refused({.p = {0, 2, 1}}) == path + ": dataset 'fclib_local/W/p': must rise from 0 over 3 entries");
    CHECK(refused({}, true) == path + ": dataset 'fclib_global/vectors/f': is empty: there is nothing that moves");
}
