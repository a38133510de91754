// What every test program needs of the kernel in a model, compiled once for all of them (compiled_kernel.cpp.in): it is
// most of what compiling one costs. Not where a program compiles the kernel in a way of its own.
#pragma once

#include "nscdd/nscdd.hpp"

namespace scenes {

// Smooth: frictionless.
using SmoothDisks = nscdd::Model<2, nscdd::Frictionless>;
using Disks = nscdd::Model<2, nscdd::Coulomb>;
using SmoothSpheres = nscdd::Model<3, nscdd::Frictionless>;
using Spheres = nscdd::Model<3, nscdd::Coulomb>;

}  // namespace scenes

// prefix: extern, or nothing; M: a name for the model.
#define COMPILED_KERNEL(prefix, M)                                                                                     \
    prefix template class Simulation<M>;                                                                               \
    prefix template void repartition(std::vector<Subdomain<M>>&, Communicator&, const Grid<M>&,                        \
                                     std::span<const Wall<M>>, double, double);                                        \
    prefix template Overlap detect_contacts(Subdomain<M>&, std::span<const Wall<M>>, const Materials&, double,         \
                                            double);                                                                   \
    prefix template Unseen find_unseen(Subdomain<M>&, std::span<const Wall<M>>, const Materials&, double, double,      \
                                       double);                                                                        \
    prefix template void agree_on_multiplicities(std::vector<Subdomain<M>>&, Communicator&, std::span<const Wall<M>>); \
    prefix template void split_masses(std::vector<Subdomain<M>>&, std::span<const Wall<M>>, const M::Vec&, double);    \
    prefix template Measures<M> measure(const Simulation<M>&);                                                         \
    prefix template std::vector<GatheredGrain<M>> gather_grains(const Simulation<M>&);                                 \
    prefix template std::vector<GatheredContact<M>> gather_contacts(const Simulation<M>&);                             \
    prefix template SolveReport nlgs(ContactProblem<M>&, const SolveOptions&, Sweeper<M>&);                            \
    prefix template NewtonReport newton_solve<SparseLU>(ContactProblem<M>&, const NewtonOptions&);                     \
    prefix template SolveReport projected_gradient(ContactProblem<M>&, const SolveOptions&, Descent);                  \
    prefix template StepSolver<M> by_nlgs(const SolveOptions&);                                                        \
    prefix template StepSolver<M> by_newton(const NewtonOptions&);                                                     \
    prefix template StepSolver<M> by_gradient(const SolveOptions&, Descent);                                           \
    prefix template StepSolver<M> by_nscdd<Ccs<M, ClosedForm>>(const SolveOptions&);                                   \
    prefix template StepSolver<M> by_nscdd<Dcs<M, ClosedForm>>(const SolveOptions&);                                   \
    prefix template StepSolver<M> by_nscdd<Ccs<M, Factorised<>>>(const SolveOptions&);                                 \
    prefix template StepSolver<M> by_nscdd<Dcs<M, Factorised<>>>(const SolveOptions&);

#ifndef EIGEN_DONT_VECTORIZE
namespace nscdd {
COMPILED_KERNEL(extern, scenes::SmoothDisks)
COMPILED_KERNEL(extern, scenes::Disks)
COMPILED_KERNEL(extern, scenes::SmoothSpheres)
COMPILED_KERNEL(extern, scenes::Spheres)
}  // namespace nscdd
#endif
