// What SuiteSparse factorises in the program: Newton's steps by UMFPACK, interface operators by CHOLMOD.
#pragma once

#include <Eigen/CholmodSupport>
#include <Eigen/UmfPackSupport>

#include "nscdd/compiled.hpp"

namespace nscdd {

// Matrices of symmetric pattern, whose values are not symmetric.
struct UmfPack : Eigen::UmfPackLU<Eigen::SparseMatrix<double>> {
    UmfPack() {  // 2.4 times as fast on 5,000 spheres as what UMFPACK chooses by itself
        umfpackControl()(UMFPACK_STRATEGY) = UMFPACK_STRATEGY_SYMMETRIC;
        umfpackControl()(UMFPACK_ORDERING) = UMFPACK_ORDERING_METIS;
    }
};

using Cholmod = Factorised<Eigen::CholmodSimplicialLDLT<Eigen::SparseMatrix<double>>>;

// compiled in suitesparse.cpp
extern template class detail::FactorsBy<UmfPack>;
extern template class Factorised<Eigen::CholmodSimplicialLDLT<Eigen::SparseMatrix<double>>>;

}  // namespace nscdd
