// The solvers of a model, compiled once for all test programs (compiled_solvers.cpp.in): they are most of what
// compiling one costs. Not where a program compiles the kernel in a way of its own.
#pragma once

#include "nscdd/nscdd.hpp"

// prefix: extern, or nothing; then the model.
#define COMPILED_SOLVERS(prefix, ...)                                                                           \
    namespace nscdd {                                                                                           \
    prefix template SolveReport nlgs(ContactProblem<__VA_ARGS__>&, const SolveOptions&, Sweeper<__VA_ARGS__>&); \
    prefix template NewtonReport newton_solve<SparseLU>(ContactProblem<__VA_ARGS__>&, const NewtonOptions&);    \
    prefix template SolveReport projected_gradient(ContactProblem<__VA_ARGS__>&, const SolveOptions&, Descent); \
    prefix template StepSolver<__VA_ARGS__> by_nlgs(const SolveOptions&);                                       \
    prefix template StepSolver<__VA_ARGS__> by_newton(const NewtonOptions&);                                    \
    prefix template StepSolver<__VA_ARGS__> by_gradient(const SolveOptions&, Descent);                          \
    prefix template StepSolver<__VA_ARGS__> by_nscdd<Ccs<__VA_ARGS__, ClosedForm>>(const SolveOptions&);        \
    prefix template StepSolver<__VA_ARGS__> by_nscdd<Dcs<__VA_ARGS__, ClosedForm>>(const SolveOptions&);        \
    prefix template StepSolver<__VA_ARGS__> by_nscdd<Ccs<__VA_ARGS__, Factorised<>>>(const SolveOptions&);      \
    prefix template StepSolver<__VA_ARGS__> by_nscdd<Dcs<__VA_ARGS__, Factorised<>>>(const SolveOptions&);      \
    }

#ifndef EIGEN_DONT_VECTORIZE
COMPILED_SOLVERS(extern, Model<2, Frictionless, KinematicWalls>)
COMPILED_SOLVERS(extern, Model<2, Frictionless, DrivenWalls>)
COMPILED_SOLVERS(extern, Model<2, Coulomb, KinematicWalls>)
COMPILED_SOLVERS(extern, Model<2, Coulomb, DrivenWalls>)
COMPILED_SOLVERS(extern, Model<3, Frictionless, KinematicWalls>)
COMPILED_SOLVERS(extern, Model<3, Frictionless, DrivenWalls>)
COMPILED_SOLVERS(extern, Model<3, Coulomb, KinematicWalls>)
COMPILED_SOLVERS(extern, Model<3, Coulomb, DrivenWalls>)
#endif
