#include "files/fclib.hpp"

#include <fmt/format.h>

#include <Eigen/SparseLU>
#include <algorithm>
#include <vector>

#include "files/hdf5.hpp"

namespace nscdd {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr int by_columns = -1, by_rows = -2;  // values of nz; >= 0: triplets, and how many

std::size_t length(const hdf5::Reader& file, const std::string& dataset) {
    const hdf5::Shape shape = file.shape(dataset);
    if (shape.size() != 1)
        throw file.error(dataset, fmt::format("must be a vector, found shape {}", hdf5::to_string(shape)));
    return shape[0];
}

int scalar(const hdf5::Reader& file, const std::string& dataset) {
    const hdf5::Shape shape = file.shape(dataset);
    return file.read<int>(dataset, shape.empty() ? shape : hdf5::Shape{1})[0];
}

Eigen::VectorXd vector(const hdf5::Reader& file, const std::string& dataset, Eigen::Index size) {
    const auto values = file.read<double>(dataset, {static_cast<hsize_t>(size)});
    return Eigen::Map<const Eigen::VectorXd>(values.data(), size);
}

// True if all values of `indices` are within [0, bound).
bool fit(const std::vector<int>& indices, int bound) {
    return std::all_of(indices.begin(), indices.end(), [=](int k) { return k >= 0 && k < bound; });
}

Sparse matrix(const hdf5::Reader& file, const std::string& group, Eigen::Index rows, Eigen::Index columns) {
    const int m = scalar(file, group + "/m"), n = scalar(file, group + "/n"), nz = scalar(file, group + "/nz");
    if (m != rows || n != columns)  // before anything of that size is made
        throw file.error(group + "/m", fmt::format("must be {} by {}, found {} by {}", rows, columns, m, n));
    if (nz < by_rows) throw file.error(group + "/nz", fmt::format("must be -1, -2 or a count, found {}", nz));
    auto i = file.read<int>(group + "/i", {length(file, group + "/i")});
    auto p = file.read<int>(group + "/p", {length(file, group + "/p")});
    auto x = file.read<double>(group + "/x", {length(file, group + "/x")});

    const auto majors = static_cast<std::size_t>(nz == by_columns ? n : m);
    if (nz < 0 && (p.size() != majors + 1 || p.front() != 0 || !std::is_sorted(p.begin(), p.end())))
        throw file.error(group + "/p", fmt::format("must rise from 0 over {} entries", majors + 1));
    const auto used = static_cast<std::size_t>(nz < 0 ? p.back() : nz);
    for (const auto& [name, size] : {std::pair("/i", i.size()), {"/x", x.size()}, {"/p", nz < 0 ? used : p.size()}})
        if (size < used) throw file.error(group + name, fmt::format("must have {} entries, found {}", used, size));
    if (nz < 0) {
        std::vector<int> majors_of_entries;
        for (std::size_t major = 0; major < majors; ++major)
            majors_of_entries.resize(static_cast<std::size_t>(p[major + 1]), static_cast<int>(major));
        p = std::move(majors_of_entries);
    }
    i.resize(used), p.resize(used);
    if (nz == by_rows || (nz >= 0 && !(fit(i, m) && fit(p, n)))) std::swap(i, p);
    if (!fit(i, m) || !fit(p, n))
        throw file.error(group + "/i", fmt::format("an index is outside the matrix, {} by {}", m, n));

    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(used);
    for (std::size_t k = 0; k < used; ++k) triplets.emplace_back(i[k], p[k], x[k]);
    Sparse out(m, n);
    out.setFromTriplets(triplets.begin(), triplets.end());
    return out;
}

// The group that a problem has in its file.
struct Kind {
    const char* group;
    bool global, rolls;
};
constexpr Kind kinds[] = {{"fclib_local", false, false},
                          {"fclib_local_rolling", false, true},
                          {"fclib_global", true, false},
                          {"fclib_global_rolling", true, true}};

const Kind& kind_of(const hdf5::Reader& file, const std::string& path) {
    for (const Kind& kind : kinds)
        if (file.has(kind.group)) return kind;
    throw InputError(path + ": is not an FCLIB file: it has neither fclib_local nor fclib_global");
}

std::string group_for(bool global, bool rolls) {
    return std::ranges::find_if(kinds, [=](const Kind& k) { return k.global == global && k.rolls == rolls; })->group;
}

template <class Problem>
Problem read_contacts(const hdf5::Reader& file, const Kind& kind) {
    const std::string group = kind.group, spacedim = group + "/spacedim", mu = group + "/vectors/mu", mu_r = mu + "_r";
    Problem problem;
    const int components = scalar(file, spacedim), in_2d = kind.rolls ? 3 : 2, in_3d = kind.rolls ? 5 : 3;
    if (components != in_2d && components != in_3d)
        throw file.error(spacedim, fmt::format("must be {} or {}, found {}", in_2d, in_3d, components));
    problem.dim = components == in_2d ? 2 : 3;
    problem.friction = vector(file, mu, static_cast<Eigen::Index>(length(file, mu)));
    if (problem.friction.size() == 0) throw file.error(mu, "there are no contacts");
    if (problem.friction.minCoeff() < 0) throw file.error(mu, "must not be negative");
    if (kind.rolls) {
        problem.rolling = vector(file, mu_r, problem.friction.size());
        if (problem.rolling.minCoeff() < 0) throw file.error(mu_r, "must not be negative");
    } else if (file.has(mu_r)) {
        throw file.error(mu_r, fmt::format("belongs to a group '{}_rolling'", group));
    }
    return problem;
}

LocalProblem read_local(const hdf5::Reader& file, const Kind& kind) {
    const std::string group = kind.group;
    auto problem = read_contacts<LocalProblem>(file, kind);
    const Eigen::Index size = problem.size() * problem.friction.size();
    problem.w = matrix(file, group + "/W", size, size);
    problem.q = vector(file, group + "/vectors/q", size);
    return problem;
}

GlobalProblem read_global(const hdf5::Reader& file, const Kind& kind) {
    const std::string group = kind.group;
    auto problem = read_contacts<GlobalProblem>(file, kind);
    const Eigen::Index size = problem.size() * problem.friction.size();
    const auto dof = static_cast<Eigen::Index>(length(file, group + "/vectors/f"));
    if (dof == 0) throw file.error(group + "/vectors/f", "is empty: there is nothing that moves");
    problem.f = vector(file, group + "/vectors/f", dof);
    problem.m = matrix(file, group + "/M", dof, dof);
    problem.h = matrix(file, group + "/H", dof, size);
    problem.w = vector(file, group + "/vectors/w", size);
    return problem;
}

// M need not be symmetric: gyroscopic terms are not.
class Masses {
  public:
    explicit Masses(const Sparse& m) {
        bool empty = false;  // SparseLU does not end with many of these
        for (Eigen::Index column = 0; column < m.cols(); ++column) empty |= !Sparse::InnerIterator(m, column);
        if (!empty) lu_.compute(m);
        if (empty || lu_.info() != Eigen::Success) throw std::runtime_error("the mass matrix M is singular");
    }
    auto solve(const auto& right) { return lu_.solve(right); }

  private:
    Eigen::SparseLU<Sparse> lu_;
};

void write_matrix(hdf5::Writer& file, const std::string& group, Sparse m) {
    m.makeCompressed();
    const auto entries = static_cast<std::size_t>(m.nonZeros());
    const auto scalar = [&](const char* name, Eigen::Index value) {
        file.write<int>(group + name, {static_cast<int>(value)}, {1});
    };
    scalar("/nzmax", m.nonZeros());
    scalar("/m", m.rows());
    scalar("/n", m.cols());
    scalar("/nz", by_columns);
    const std::vector<int> p(m.outerIndexPtr(), m.outerIndexPtr() + m.cols() + 1),
        i(m.innerIndexPtr(), m.innerIndexPtr() + entries);
    file.write(group + "/p", p, {p.size()});
    file.write(group + "/i", i, {entries});
    file.write(group + "/x", std::vector<double>(m.valuePtr(), m.valuePtr() + entries), {entries});
}

void write_vector(hdf5::Writer& file, const std::string& dataset, const Eigen::VectorXd& values) {
    file.write(dataset, std::vector<double>(values.begin(), values.end()), {static_cast<hsize_t>(values.size())});
}

void add_solution(hdf5::Writer& file, const std::string& info, const FclibSolution& solution) {
    if (solution.v.size() > 0) write_vector(file, "solution/v", solution.v);
    write_vector(file, "solution/u", solution.u);
    write_vector(file, "solution/r", solution.r);
    file.attribute("solution_natural_map", solution.natural_map, info);
    file.attribute("solution_eta", solution.eta, info);
    file.attribute("solution_solver", solution.solver, info);
}

}  // namespace

FclibProblem read_fclib(const std::string& path) {
    const hdf5::Reader file(path);
    const Kind& kind = kind_of(file, path);
    const std::string bilateral = std::string(kind.group) + (kind.global ? "/G" : "/V");
    if (file.has(bilateral)) throw file.error(bilateral, "bilateral constraints are not supported");
    if (kind.global) return read_global(file, kind);
    return read_local(file, kind);
}

Eigen::VectorXd read_fclib_impulses(const std::string& path, Eigen::Index components) {
    return vector(hdf5::Reader(path), "solution/r", components);
}

LocalProblem condense(const GlobalProblem& problem) {
    if (problem.m.rows() == 0)  // SparseLU divides by it
        return {problem.dim, Sparse(problem.w.size(), problem.w.size()), problem.w, problem.friction, problem.rolling};
    Masses masses(problem.m);
    const Sparse moved = masses.solve(problem.h);
    const Sparse transposed = problem.h.transpose();
    LocalProblem local;
    local.dim = problem.dim;
    local.w = transposed * moved;
    local.q = problem.w + transposed * Eigen::VectorXd(masses.solve(problem.f));
    local.friction = problem.friction;
    local.rolling = problem.rolling;
    return local;
}

Eigen::VectorXd body_velocities(const GlobalProblem& problem, const Eigen::VectorXd& r) {
    if (problem.m.rows() == 0) return {};
    return Masses(problem.m).solve(Eigen::VectorXd(problem.h * r + problem.f));
}

void write_fclib(const std::string& path, const FclibProblem& problem, const FclibSolution& solution,
                 const FclibInfo& info) {
    hdf5::Writer file(path);
    const auto* global = std::get_if<GlobalProblem>(&problem);
    const std::string group = std::visit([&](const auto& any) { return group_for(global, any.rolls()); }, problem);
    std::visit(
        [&](const auto& any) {
            file.write<int>(group + "/spacedim", {any.size()}, {1});
            write_vector(file, group + "/vectors/mu", any.friction);
            if (any.rolls()) write_vector(file, group + "/vectors/mu_r", any.rolling);
        },
        problem);
    if (global) {
        write_matrix(file, group + "/M", global->m);
        write_matrix(file, group + "/H", global->h);
        write_vector(file, group + "/vectors/f", global->f);
        write_vector(file, group + "/vectors/w", global->w);
    } else {
        const auto& local = std::get<LocalProblem>(problem);
        write_matrix(file, group + "/W", local.w);
        write_vector(file, group + "/vectors/q", local.q);
    }
    file.text(group + "/info/title", info.title);
    file.text(group + "/info/description", info.description);
    file.text(group + "/info/math_info", info.math_info);
    add_solution(file, group + "/info", solution);
    file.save();
}

void write_fclib_solution(FileSet& files, const std::string& path, const std::string& source,
                          const FclibSolution& solution) {
    const hdf5::Reader from(source);
    const std::string group = kind_of(from, source).group;
    hdf5::Writer file(files, path);
    file.copy(from, group);
    add_solution(file, group + "/info", solution);
    file.save();
}

}  // namespace nscdd
