// The kernel as a project with strict warnings reads it, by a plain -I, where macros have taken names of the standard
// library and of the kernel, as windows.h and Apple's AssertMacros.h do (foreign.cmake). Compiled only.
#include "others.hpp"  // all that the kernel includes of other libraries

#define min(a, b) not_the_kernels(a, b)
#define max(a, b) not_the_kernels(a, b)
#define check(assertion) not_the_kernels(assertion)
#define verify(assertion) not_the_kernels(assertion)
#define require(assertion, label) not_the_kernels(assertion, label)

#include <nscdd/reference.hpp>
#if __has_include(<metis.h>)
#include <nscdd/partition/metis.hpp>
#endif
#if __has_include(<mpi.h>)
#include <nscdd/comm/mpi.hpp>
#endif

namespace {

template <class M>
void use(nscdd::Communicator& comm) {
    using namespace nscdd;
    SimulationSettings<M> settings;
    settings.partition = by_bisection<M>();
#if __has_include(<metis.h>)
    settings.partition = by_metis<M>();
#endif
    Simulation<M> simulation(comm, settings, std::vector<Grain<M>>{});
    simulation.step(by_nlgs<M>({}));
    simulation.step(by_newton<M>({}));
    simulation.step(by_gradient<M>({}, Descent::spectral));
    simulation.step(by_nscdd<Ccs<M>>({}));
    simulation.step(by_nscdd<Dcs<M, ClosedForm>>({}));
    gather_broad_phase(simulation);
    gather_contacts(simulation);
    observe(simulation);
    ContactProblem<M> problem;
    nlgs(problem, {});
}

}  // namespace

int main() {
    nscdd::InProcess comm(2);
    use<nscdd::Model<2, nscdd::Frictionless>>(comm);
    use<nscdd::Model<3, nscdd::Coulomb>>(comm);
#if __has_include(<mpi.h>)
    nscdd::Mpi ranks;
    use<nscdd::Model<2, nscdd::Coulomb>>(ranks);
#endif
}
