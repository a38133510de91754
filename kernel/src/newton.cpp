#include "nscdd/compiled.hpp"

namespace nscdd {
NSCDD_COMPILED_NEWTON(, 1)
NSCDD_COMPILED_NEWTON(, 2)
NSCDD_COMPILED_NEWTON(, 3)
}  // namespace nscdd
