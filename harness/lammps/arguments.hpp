// What stands behind `fix ID group nscdd`: coefficients, gravity, walls and how steps are solved.
#pragma once

#include <lammps/lammps.h>

#include <string>
#include <vector>

#include "nscdd/compiled.hpp"

namespace nscdd {

struct FixArguments {
    using M = compiled::Spheres;

    SimulationSettings<M> settings;  // row t-1 of the materials is atom type t, the last row the walls
    std::vector<std::string> wall_names, obstacle_names;  // each obstacle is a cylinder
    SolveOptions options;                                 // as the program has them by default
    bool bricks = false;                                  // subdomains are LAMMPS' own, else those of the program

    int wall_material() const { return settings.materials.count() - 1; }
    // LAMMPS' axes are 0 to 2. Grains are on the side that the normal points to, or inside of the cylinder.
    void add_plane(const std::string& name, const M::Vec& normal, double offset);
    void add_cylinder(const std::string& name, const M::Vec& centre, int axis, double radius);
};

// Reads the words from the fourth on. Ends by LAMMPS' error->all() for those that make no sense.
FixArguments read_arguments(LAMMPS_NS::LAMMPS* lmp, int count, char** words);

// Adds the surfaces of a region that grains are inside of: planes of a block, a plane, a cylinder with its ends. Ends
// by error->all() for another region.
void add_region(LAMMPS_NS::LAMMPS* lmp, const std::string& id, FixArguments& to);

}  // namespace nscdd
