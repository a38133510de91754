#include "small_scenes.hpp"

namespace scenes {

SMALL_SCENES_RUNS(, SmoothSpheres)
SMALL_SCENES_RUNS(, SmoothSpheresDriven)
SMALL_SCENES_RUNS(, Spheres)
SMALL_SCENES_RUNS(, SpheresDriven)

}  // namespace scenes
