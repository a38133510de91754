/// @file
/// Factorisations for the Newton methods, by any sparse solver of Eigen's interface, behind one type. So the methods
/// are compiled once for all solvers. A virtual call costs nothing beside a factorisation.
#pragma once

#include <Eigen/SparseCore>
#include <functional>
#include <memory>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// A factorisation of square matrices that need not be symmetric.
class SparseFactors {
  public:
    using Matrix = Eigen::SparseMatrix<double>;  ///< compressed by columns
    virtual ~SparseFactors() = default;
    virtual void analyze(const Matrix& pattern) = 0;   ///< before the first factorize(), and where the pattern changes
    virtual bool factorize(const Matrix& matrix) = 0;  ///< false where it fails
    virtual Eigen::VectorXd solve(const Eigen::VectorXd& right) const = 0;  ///< solves by the last matrix factorised
};

using NewFactors = std::function<std::unique_ptr<SparseFactors>()>;  ///< makes one that has no matrix yet

/// Factors by a solver with analyzePattern(), factorize(), info() and solve(), such as Eigen::SparseLU.
template <class Factorisation>
class FactorsBy final : public SparseFactors {
  public:
    void analyze(const Matrix& pattern) override { factors_.analyzePattern(pattern); }
    bool factorize(const Matrix& matrix) override {
        factors_.factorize(matrix);
        return factors_.info() == Eigen::Success;
    }
    Eigen::VectorXd solve(const Eigen::VectorXd& right) const override { return factors_.solve(right); }

    static std::unique_ptr<SparseFactors> create() { return std::make_unique<FactorsBy>(); }  ///< a NewFactors

  private:
    Factorisation factors_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
