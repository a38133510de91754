#include "small_scenes.hpp"

namespace scenes {

SMALL_SCENES_RUNS(, SmoothDisks)
SMALL_SCENES_RUNS(, SmoothDisksDriven)
SMALL_SCENES_RUNS(, Disks)
SMALL_SCENES_RUNS(, DisksDriven)

}  // namespace scenes
