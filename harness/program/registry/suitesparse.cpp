#include "registry/suitesparse.hpp"

namespace nscdd {

template class FactorsBy<UmfPack>;
template class Factorised<Eigen::CholmodSimplicialLDLT<Eigen::SparseMatrix<double>>>;

}  // namespace nscdd
