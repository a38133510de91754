#include "registry/suitesparse.hpp"

namespace nscdd {

template class detail::FactorsBy<UmfPack>;
template class Factorised<Eigen::CholmodSimplicialLDLT<Eigen::SparseMatrix<double>>>;

}  // namespace nscdd
