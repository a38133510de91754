// `fix nscdd`: in place of pair style and integrator. Each step of LAMMPS is one of the kernel.
#pragma once

#include <lammps/fix.h>

#include <optional>

#include "arguments.hpp"
#include "atom_links.hpp"
#include "nscdd/comm/mpi.hpp"

namespace nscdd {

class FixNscdd final : public LAMMPS_NS::Fix {
  public:
    using M = FixArguments::M;

    FixNscdd(LAMMPS_NS::LAMMPS* lammps, int count, char** words);

    int setmask() override;
    void init() override;
    void setup(int vflag) override;
    void setup_pre_neighbor() override { sorted_ = false; }
    void pre_neighbor() override { sorted_ = false; }
    void initial_integrate(int vflag) override;
    double compute_scalar() override;
    double compute_vector(int index) override;

  private:
    // Calls task(), and ends by LAMMPS' error where the kernel throws.
    void by_kernel(auto&& task);
    // Hands over what other fixes and commands have done since the last step.
    void take_atoms();
    // Makes a simulation of the atoms as they are, with the impulses of the last one.
    void make_simulation();
    Cell<M> cell() const;
    bool same_box() const;
    void note_virial(int vflag);

    const FixArguments arguments_;
    std::optional<Mpi> comm_;
    std::optional<Simulation<M>> simulation_;
    AnyStepSolver<M> solve_;
    AtomLinks links_;
    StepReport report_;
    bool sorted_ = false;     // atoms have the places and ranks that are in links_
    double time_ = 0;         // since the fix was made, for walls that move [s]
    double lost_ = 0;         // energy that contacts have taken since then [J]
    double unconverged_ = 0;  // steps since then
};

}  // namespace nscdd
