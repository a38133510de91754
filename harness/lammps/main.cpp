// nscdd-lammps: LAMMPS with one style more, `fix nscdd`. Command line and input are those of lmp.
#include <lammps/input.h>
#include <lammps/lammps.h>
#include <lammps/modify.h>
#include <mpi.h>

#include "fix_nscdd.hpp"

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    {
        LAMMPS_NS::LAMMPS lammps(argc, argv, MPI_COMM_WORLD);
        (*lammps.modify->fix_map)["nscdd"] = [](LAMMPS_NS::LAMMPS* lmp, int count, char** words) -> LAMMPS_NS::Fix* {
            return new nscdd::FixNscdd(lmp, count, words);
        };
        lammps.input->file();
    }
    MPI_Barrier(MPI_COMM_WORLD);
    MPI_Finalize();
}
