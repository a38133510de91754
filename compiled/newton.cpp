#include "compiled_kernel.hpp"

namespace nscdd {
COMPILED_NEWTON(, 1)
COMPILED_NEWTON(, 2)
COMPILED_NEWTON(, 3)
}  // namespace nscdd
