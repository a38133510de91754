#include "registry/factors.hpp"

namespace nscdd {

template class detail::FactorsBy<NewtonFactors>;
template class Factorised<Eigen::CholmodSimplicialLDLT<Eigen::SparseMatrix<double>>>;

}  // namespace nscdd
