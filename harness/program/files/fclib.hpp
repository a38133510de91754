// FCLIB files, the exchange format for contact problems between codes (kernel/REFERENCES.md, [FCLIB]).
//
// /fclib_local has W, q and mu, /fclib_global M, H, f, w and mu; /solution has r, u and, of global problems, v.
// Components of a contact: N, T(, S). Units are those of the problem's author; ours are velocities and impulses.
// With rolling resistance a contact has the couple about T(, S) besides, so that spacedim is 3 or 5, and there is mu_r.
// The group is then /fclib_global_rolling, as FCLIB has it. FCLIB has no local one: ours is /fclib_local_rolling.
#pragma once

#include <Eigen/SparseCore>
#include <string>
#include <variant>
#include <vector>

#include "files/error.hpp"
#include "files/replace_file.hpp"

namespace nscdd {

// u = W r + q of n contacts.
struct LocalProblem {
    int dim = 0;                    // of space, 2 or 3
    Eigen::SparseMatrix<double> w;  // (n size, n size)
    Eigen::VectorXd q;              // (n size)
    Eigen::VectorXd friction;       // (n) mu, >= 0
    Eigen::VectorXd rolling = {};   // (n) mu_r, >= 0; empty without rolling resistance
    bool rolls() const { return rolling.size() > 0; }
    int size() const { return rolls() ? 2 * dim - 1 : dim; }  // components of a contact
};

// M v = H r + f, u = H^T v + w.
struct GlobalProblem {
    int dim = 0;
    Eigen::SparseMatrix<double> m;  // (dof, dof), invertible
    Eigen::SparseMatrix<double> h;  // (dof, n size)
    Eigen::VectorXd f;              // (dof)
    Eigen::VectorXd w;              // (n size)
    Eigen::VectorXd friction;       // (n)
    Eigen::VectorXd rolling = {};   // (n) or empty
    bool rolls() const { return rolling.size() > 0; }
    int size() const { return rolls() ? 2 * dim - 1 : dim; }
};

using FclibProblem = std::variant<LocalProblem, GlobalProblem>;

inline Eigen::VectorXd to_vector(const std::vector<double>& values) {
    return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

struct FclibSolution {
    Eigen::VectorXd r, u;  // (n size)
    Eigen::VectorXd v;     // (dof), empty for a local problem
    double natural_map = 0, eta = 0;
    std::string solver;
};

struct FclibInfo {
    std::string title, description, math_info;
};

// Matrices by columns, by rows, or as triplets, where i holds the rows and p the columns as in published files, unless
// only the other way round fits. Throws InputError naming file and dataset: missing, damaged, a size or index that does
// not fit, not finite, or bilateral constraints (V, G), which are not supported.
FclibProblem read_fclib(const std::string& path);

// /solution/r of a file whose problem has so many components. Throws InputError as read_fclib does.
Eigen::VectorXd read_fclib_impulses(const std::string& path, Eigen::Index components);

// W = H^T M^-1 H, q = w + H^T M^-1 f. Throws std::runtime_error when M is singular.
LocalProblem condense(const GlobalProblem& problem);

// v = M^-1 (H r + f).
Eigen::VectorXd body_velocities(const GlobalProblem& problem, const Eigen::VectorXd& r);

// Both write the solution's error as attributes of the problem's group `info`. Throw OutputError; an old file is then
// left as it was.
void write_fclib(const std::string& path, const FclibProblem& problem, const FclibSolution& solution,
                 const FclibInfo& info);
// The problem is that of the file `source`, copied as it is.
void write_fclib_solution(FileSet& files, const std::string& path, const std::string& source,
                          const FclibSolution& solution);

}  // namespace nscdd
