// LAMMPS' input for packings: the text of cases/packings/pack.lmp, so that the program needs no file to be found.
#pragma once

namespace nscdd {

extern const char* const lammps_input;

}  // namespace nscdd
