/// @file
/// The kernel in four models, compiled once. A program that links nscdd::compiled includes this header in place of
/// nscdd.hpp, and compiles in seconds. The program itself compiles other models, laws and solvers.
/// NSCDD_WITHOUT_COMPILED_KERNEL leaves the names of the models alone.
#pragma once

#include "nscdd/reference.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Models that nscdd::compiled has.
namespace compiled {

using SmoothDisks = Model<2, Frictionless>;    ///< disks without friction
using Disks = Model<2, Coulomb>;               ///< disks
using SmoothSpheres = Model<3, Frictionless>;  ///< spheres without friction
using Spheres = Model<3, Coulomb>;             ///< spheres

}  // namespace compiled

// prefix: extern, or nothing; M: a name for the model.
#define NSCDD_COMPILED_MODEL(prefix, M)                                                                            \
    prefix template class Simulation<M>;                                                                           \
    prefix template class Sweeper<M>;                                                                              \
    prefix template void detail::repartition(std::vector<Subdomain<M>>&, Communicator&, const Partition<M>&,       \
                                             std::span<const Wall<M>>, double, double, bool);                      \
    prefix template detail::Overlap detail::detect_contacts(Subdomain<M>&, std::span<const Wall<M>>,               \
                                                            const Materials<M>&, double, const detail::Alert&);    \
    prefix template detail::Tunnelled detail::find_tunnelled(Subdomain<M>&, std::span<const Wall<M>>,              \
                                                             const Materials<M>&, double, double, double);         \
    prefix template void detail::agree_on_multiplicities(std::vector<Subdomain<M>>&, Communicator&,                \
                                                         std::span<const Wall<M>>, Multiplicity);                  \
    prefix template void detail::split_masses(std::vector<Subdomain<M>>&, std::span<const Wall<M>>, const M::Vec&, \
                                              double);                                                             \
    prefix template Measures<M> measure(const Simulation<M>&);                                                     \
    prefix template std::vector<GatheredGrain<M>> gather_grains(const Simulation<M>&, detail::Ids);                \
    prefix template std::vector<GatheredContact<M>> gather_contacts(const Simulation<M>&, detail::Ids);            \
    prefix template SolveReport nlgs(ContactProblem<M>&, const SolveOptions&, Sweeper<M>&);                        \
    prefix template SolveReport detail::nlgs_of_valid(ContactProblem<M>&, const SolveOptions&, Sweeper<M>&,        \
                                                      detail::NothingElse, Meter*);                                \
    prefix template void sweep(ContactProblem<M>&);                                                                \
    prefix template NewtonReport newton_solve(ContactProblem<M>&, const NewtonOptions&);                           \
    prefix template Partitioner<M> by_grid(const detail::GridCells<M::dim>&);                                      \
    prefix template Partitioner<M> by_bisection(double);                                                           \
    prefix template SolveReport nscdd_solve(std::span<Subdomain<M>>, Communicator&, CommunicationScheme<M>&,       \
                                            const SolveOptions&, PhaseSeconds&, detail::HandOver<M>);              \
    prefix template detail::LinearContactsOf<M> linear_contacts(ContactProblem<M>);                                \
    prefix template SolveReport projected_gradient(ContactProblem<M>&, const SolveOptions&, Descent);              \
    prefix template class Ccs<M, ClosedForm>;                                                                      \
    prefix template class Dcs<M, ClosedForm>;                                                                      \
    prefix template class Ccs<M, Factorised<>>;                                                                    \
    prefix template class Dcs<M, Factorised<>>;                                                                    \
    prefix template detail::HandedOver detail::hand_over(                                                          \
        std::span<Subdomain<M>>, Communicator&, std::span<detail::DistanceSums<M>>, detail::JoinedComponents<M>&,  \
        const ResidualParts&, const SolveOptions&);                                                                \
    prefix template AnyStepSolver<M> by_nlgs(const SolveOptions&, detail::HandOver<M>);                            \
    prefix template AnyStepSolver<M> by_newton(const NewtonOptions&);                                              \
    prefix template AnyStepSolver<M> by_gradient(const SolveOptions&, Descent);                                    \
    prefix template AnyStepSolver<M> by_nscdd<Ccs<M, ClosedForm>>(const SolveOptions&, detail::HandOver<M>);       \
    prefix template AnyStepSolver<M> by_nscdd<Dcs<M, ClosedForm>>(const SolveOptions&, detail::HandOver<M>);       \
    prefix template AnyStepSolver<M> by_nscdd<Ccs<M, Factorised<>>>(const SolveOptions&, detail::HandOver<M>);     \
    prefix template AnyStepSolver<M> by_nscdd<Dcs<M, Factorised<>>>(const SolveOptions&, detail::HandOver<M>);

// Of problems with a stored W.
#define NSCDD_COMPILED_DIMENSION(prefix, dim)                                                                    \
    prefix template double detail::stopping_error(const DelassusProblem<dim>&,                                   \
                                                  const std::vector<DelassusProblem<dim>::Vec>&);                \
    prefix template ErrorMeasures error_measures(const DelassusProblem<dim>&,                                    \
                                                 const std::vector<DelassusProblem<dim>::Vec>&);                 \
    prefix template SolveReport block_nlgs(const DelassusProblem<dim>&, std::vector<DelassusProblem<dim>::Vec>&, \
                                           const BlockOptions&);                                                 \
    prefix template LinearContacts<dim> linear_contacts(const DelassusProblem<dim>&);

// Of the Newton methods, by the size of an impulse.
#define NSCDD_COMPILED_NEWTON(prefix, size)                                                                            \
    prefix template void detail::newton_solve(const LinearContacts<size>&, const NewtonOptions&,                       \
                                              const detail::NewFactors&, Eigen::VectorXd&, const detail::NewtonJudge&, \
                                              NewtonReport&);

#ifndef NSCDD_WITHOUT_COMPILED_KERNEL
NSCDD_COMPILED_MODEL(extern, compiled::SmoothDisks)
NSCDD_COMPILED_MODEL(extern, compiled::Disks)
NSCDD_COMPILED_MODEL(extern, compiled::SmoothSpheres)
NSCDD_COMPILED_MODEL(extern, compiled::Spheres)
NSCDD_COMPILED_DIMENSION(extern, 2)
NSCDD_COMPILED_DIMENSION(extern, 3)
NSCDD_COMPILED_NEWTON(extern, 1)
NSCDD_COMPILED_NEWTON(extern, 2)
NSCDD_COMPILED_NEWTON(extern, 3)
#endif

}}  // namespace nscdd::NSCDD_ABI
