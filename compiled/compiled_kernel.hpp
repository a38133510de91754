// What program and tests need of the kernel in a model, compiled once for all of them (CMakeLists.txt). Not where a
// program compiles the kernel in a way of its own.
#pragma once

#include "nscdd/nscdd.hpp"
#include "nscdd/reference/block_nlgs.hpp"

namespace scenes {

// Smooth: frictionless.
using SmoothDisks = nscdd::Model<2, nscdd::Frictionless>;
using Disks = nscdd::Model<2, nscdd::Coulomb>;
using SmoothSpheres = nscdd::Model<3, nscdd::Frictionless>;
using Spheres = nscdd::Model<3, nscdd::Coulomb>;

}  // namespace scenes

// prefix: extern, or nothing; M: a name for the model.
#define COMPILED_MODEL(prefix, M)                                                                                     \
    prefix template class Simulation<M>;                                                                              \
    prefix template class Sweeper<M>;                                                                                 \
    prefix template void repartition(std::vector<Subdomain<M>>&, Communicator&, const Partition<M>&,                  \
                                     std::span<const Wall<M>>, double, double, bool);                                 \
    prefix template Overlap detect_contacts(Subdomain<M>&, std::span<const Wall<M>>, const Materials&, double,        \
                                            double);                                                                  \
    prefix template Unseen find_unseen(Subdomain<M>&, std::span<const Wall<M>>, const Materials&, double, double,     \
                                       double);                                                                       \
    prefix template void agree_on_multiplicities(std::vector<Subdomain<M>>&, Communicator&, std::span<const Wall<M>>, \
                                                 Multiplicity);                                                       \
    prefix template void split_masses(std::vector<Subdomain<M>>&, std::span<const Wall<M>>, const M::Vec&, double);   \
    prefix template Measures<M> measure(const Simulation<M>&);                                                        \
    prefix template std::vector<GatheredGrain<M>> gather_grains(const Simulation<M>&, Ids);                           \
    prefix template std::vector<GatheredContact<M>> gather_contacts(const Simulation<M>&, Ids);                       \
    prefix template SolveReport nlgs(ContactProblem<M>&, const SolveOptions&, Sweeper<M>&);                           \
    prefix template SolveReport nlgs_of_valid(ContactProblem<M>&, const SolveOptions&, Sweeper<M>&, NothingElse);     \
    prefix template void sweep(ContactProblem<M>&);                                                                   \
    prefix template NewtonReport newton_solve(ContactProblem<M>&, const NewtonOptions&);                              \
    prefix template Partitioner<M> by_grid(const GridCells<M::dim>&);                                                 \
    prefix template Partitioner<M> by_bisection(double);                                                              \
    prefix template SolveReport nscdd_solve(std::span<Subdomain<M>>, Communicator&, CommunicationScheme<M>&,          \
                                            const SolveOptions&, PhaseSeconds&);                                      \
    prefix template LinearContactsOf<M> linear_contacts(ContactProblem<M>);                                           \
    prefix template SolveReport projected_gradient(ContactProblem<M>&, const SolveOptions&, Descent);                 \
    prefix template class Ccs<M, ClosedForm>;                                                                         \
    prefix template class Dcs<M, ClosedForm>;                                                                         \
    prefix template class Ccs<M, Factorised<>>;                                                                       \
    prefix template class Dcs<M, Factorised<>>;                                                                       \
    prefix template AnyStepSolver<M> by_nlgs(const SolveOptions&);                                                    \
    prefix template AnyStepSolver<M> by_newton(const NewtonOptions&);                                                 \
    prefix template AnyStepSolver<M> by_gradient(const SolveOptions&, Descent);                                       \
    prefix template AnyStepSolver<M> by_nscdd<Ccs<M, ClosedForm>>(const SolveOptions&);                               \
    prefix template AnyStepSolver<M> by_nscdd<Dcs<M, ClosedForm>>(const SolveOptions&);                               \
    prefix template AnyStepSolver<M> by_nscdd<Ccs<M, Factorised<>>>(const SolveOptions&);                             \
    prefix template AnyStepSolver<M> by_nscdd<Dcs<M, Factorised<>>>(const SolveOptions&);

// Of problems with a stored W.
#define COMPILED_DIMENSION(prefix, dim)                                                                          \
    prefix template double natural_map_error(const DelassusProblem<dim>&,                                        \
                                             const std::vector<DelassusProblem<dim>::Vec>&);                     \
    prefix template ErrorMeasures error_measures(const DelassusProblem<dim>&,                                    \
                                                 const std::vector<DelassusProblem<dim>::Vec>&);                 \
    prefix template SolveReport block_nlgs(const DelassusProblem<dim>&, std::vector<DelassusProblem<dim>::Vec>&, \
                                           const BlockOptions&);                                                 \
    prefix template LinearContacts<dim> linear_contacts(const DelassusProblem<dim>&);

// Of the Newton methods, by the size of an impulse.
#define COMPILED_NEWTON(prefix, size)                                                                               \
    prefix template void detail::newton_solve(const LinearContacts<size>&, const NewtonOptions&, const NewFactors&, \
                                              Eigen::VectorXd&, const detail::NewtonJudge&, NewtonReport&);

#ifndef NSCDD_WITHOUT_COMPILED_KERNEL
namespace nscdd {
COMPILED_MODEL(extern, scenes::SmoothDisks)
COMPILED_MODEL(extern, scenes::Disks)
COMPILED_MODEL(extern, scenes::SmoothSpheres)
COMPILED_MODEL(extern, scenes::Spheres)
COMPILED_DIMENSION(extern, 2)
COMPILED_DIMENSION(extern, 3)
COMPILED_NEWTON(extern, 1)
COMPILED_NEWTON(extern, 2)
COMPILED_NEWTON(extern, 3)
}  // namespace nscdd
#endif
