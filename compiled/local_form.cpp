#include "compiled_kernel.hpp"

namespace nscdd {
COMPILED_DIMENSION(, 2)
COMPILED_DIMENSION(, 3)
}  // namespace nscdd
