// What factorises in the program: Newton's steps, and interface operators by CHOLMOD.
#pragma once

#include <Eigen/CholmodSupport>
#include <Eigen/SparseLU>
#include <Eigen/UmfPackSupport>

#include "nscdd/compiled.hpp"

namespace nscdd {

// Matrices of symmetric pattern, whose values are not symmetric. Small ones by Eigen, as fast and with the same bits
// everywhere; large ones by UMFPACK, up to ten times as fast in 3D. Its last digits are those of the installed BLAS.
class NewtonFactors {
  public:
    using Matrix = Eigen::SparseMatrix<double>;
    NewtonFactors() {  // 2.4 times as fast on 5,000 spheres as what UMFPACK chooses by itself
        large_.umfpackControl()(UMFPACK_STRATEGY) = UMFPACK_STRATEGY_SYMMETRIC;
        large_.umfpackControl()(UMFPACK_ORDERING) = UMFPACK_ORDERING_METIS;
    }
    void analyzePattern(const Matrix& matrix) {
        is_small_ = matrix.nonZeros() <= most_of_small;
        is_small_ ? small_.analyzePattern(matrix) : large_.analyzePattern(matrix);
    }
    void factorize(const Matrix& matrix) { is_small_ ? small_.factorize(matrix) : large_.factorize(matrix); }
    Eigen::ComputationInfo info() const { return is_small_ ? small_.info() : large_.info(); }
    Eigen::VectorXd solve(const Eigen::VectorXd& right) const {
        if (is_small_) return small_.solve(right);
        return large_.solve(right);
    }

  private:
    static constexpr Eigen::Index most_of_small = 130'000;  // entries, of some 1,000 spheres in a column
    bool is_small_ = true;
    Eigen::SparseLU<Matrix> small_;
    Eigen::UmfPackLU<Matrix> large_;
};

using Cholmod = Factorised<Eigen::CholmodSimplicialLDLT<Eigen::SparseMatrix<double>>>;

// compiled in factors.cpp
extern template class detail::FactorsBy<NewtonFactors>;
extern template class Factorised<Eigen::CholmodSimplicialLDLT<Eigen::SparseMatrix<double>>>;

}  // namespace nscdd
