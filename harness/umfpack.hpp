// What the Newton methods factorise with: matrices of symmetric pattern, whose values are not symmetric.
#pragma once

#include <Eigen/UmfPackSupport>

namespace nscdd {

struct UmfPack : Eigen::UmfPackLU<Eigen::SparseMatrix<double>> {
    UmfPack() {  // METIS: 2.5 times as fast as AMD on 5,000 spheres
        umfpackControl()(UMFPACK_STRATEGY) = UMFPACK_STRATEGY_SYMMETRIC;
        umfpackControl()(UMFPACK_ORDERING) = UMFPACK_ORDERING_METIS;
    }
};

}  // namespace nscdd
