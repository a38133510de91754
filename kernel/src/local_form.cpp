#include "nscdd/compiled.hpp"

namespace nscdd {
NSCDD_COMPILED_DIMENSION(, 2)
NSCDD_COMPILED_DIMENSION(, 3)
}  // namespace nscdd
