// The models that a test case is compiled in where it might differ between them.
#pragma once

#include "nscdd/compiled.hpp"

namespace scenes {
using namespace nscdd::compiled;
}

// The two that have nothing in common; all four for `scripts/test --full`, at twice the price.
#ifdef NSCDD_FULL_TESTS
#define EVERY_MODEL scenes::SmoothDisks, scenes::Disks, scenes::SmoothSpheres, scenes::Spheres
#else
#define EVERY_MODEL scenes::SmoothDisks, scenes::Spheres
#endif
