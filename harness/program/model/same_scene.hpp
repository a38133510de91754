// Whether a packing or a state fits this scene, and whether a state is one of it.
#pragma once

#include <string>

#include "files/state.hpp"
#include "model/scene.hpp"

namespace nscdd {

// Turns the packing's materials, if it has any, into rows of the scene's. Throws InputError, one line, for a packing of
// another dimension, with a material that the scene lacks, or with spins that the scene's law would not see.
void fit_packing(Packing& packing, const std::string& packing_file, const Scene& scene);

// Throws InputError, one line, for a state that the scene cannot go on from: of another dimension, with other numbers
// of walls or too few grains, or with materials that the scene lacks.
void require_fitting_state(const State& state, const std::string& state_file, const Scene& scene);

// Makes a fitting state of another scene one of this: its materials become those of the same names, or go by their
// order where the scene has none of the names. Throws InputError, one line, where some names say one thing and the
// order another.
void adopt_state(State& state, const std::string& state_file, const Scene& scene);

// Throws InputError, one line, for a state of another scene: names what differs, with the value of the state and that
// of the scene. Compared are the names of the scene, its materials and walls, densities, normals, and the grains'
// number, radii and materials; `packing` is that of the scene, empty where it is not known, and of the state's rows.
// What a run may change when it goes on is not compared: forces and motions, friction, restitution, h, the solver.
void require_same_scene(const State& state, const std::string& state_file, const Scene& scene, const Packing& packing);

}  // namespace nscdd
