// The table of one material without friction, for scenes in which it does not matter.
#pragma once

#include "nscdd/core/materials.hpp"

namespace nscdd {

template <class M>
Materials<M> smooth() {
    Materials<M> table;
    table.set(0, 0, {});
    return table;
}

}  // namespace nscdd
