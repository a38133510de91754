// FCLIB files, the exchange format for contact problems between codes (kernel/REFERENCES.md, [FCLIB]).
//
// /fclib_local has W, q and mu, /fclib_global M, H, f, w and mu; /solution has r, u and, of global problems, v.
// Components of a contact: N, T(, S). Units are those of the problem's author; ours are velocities and impulses.
#pragma once

#include <Eigen/SparseCore>
#include <string>
#include <variant>

#include "files/error.hpp"
#include "files/replace_file.hpp"

namespace nscdd {

// u = W r + q of n contacts.
struct LocalProblem {
    int dim = 0;                    // 2 or 3
    Eigen::SparseMatrix<double> w;  // (n dim, n dim)
    Eigen::VectorXd q;              // (n dim)
    Eigen::VectorXd friction;       // (n) mu, >= 0
};

// M v = H r + f, u = H^T v + w.
struct GlobalProblem {
    int dim = 0;
    Eigen::SparseMatrix<double> m;  // (dof, dof), invertible
    Eigen::SparseMatrix<double> h;  // (dof, n dim)
    Eigen::VectorXd f;              // (dof)
    Eigen::VectorXd w;              // (n dim)
    Eigen::VectorXd friction;       // (n)
};

struct FclibSolution {
    Eigen::VectorXd r, u;  // (n dim)
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
std::variant<LocalProblem, GlobalProblem> read_fclib(const std::string& path);

// /solution/r of a file whose problem has so many components. Throws InputError as read_fclib does.
Eigen::VectorXd read_fclib_impulses(const std::string& path, Eigen::Index components);

// W = H^T M^-1 H, q = w + H^T M^-1 f. Throws std::runtime_error when M is singular.
LocalProblem condense(const GlobalProblem& problem);

// v = M^-1 (H r + f).
Eigen::VectorXd body_velocities(const GlobalProblem& problem, const Eigen::VectorXd& r);

// Both write the solution's error as attributes of the problem's group `info`. Throw OutputError; an old file is then
// left as it was.
void write_fclib(const std::string& path, const LocalProblem& problem, const FclibSolution& solution,
                 const FclibInfo& info);
// The problem is that of the file `source`, copied as it is.
void write_fclib_solution(FileSet& files, const std::string& path, const std::string& source,
                          const FclibSolution& solution);

}  // namespace nscdd
