#include "model/region.hpp"

#include <fmt/format.h>

#include <cmath>

namespace nscdd {

Region read_box(TomlTable& table, int dimension) {
    Region region;
    region.low = table.vector("low", dimension);
    region.high = table.vector("high", dimension);
    if (!((region.high - region.low).minCoeff() > 0)) table.fail("high", "must be above low along each axis");
    return region;
}

Region read_region(TomlTable& table, int dimension) {
    const bool plane = table.has("normal");
    if (table.has("low") == plane) table.fail("", "needs low and high, or normal and through");
    if (!plane) return read_box(table, dimension);
    Region region;
    region.normal = table.vector("normal", dimension);
    if (const double length = region.normal.norm(); !(std::abs(length - 1) <= 1e-9))
        table.fail("normal", fmt::format("must have length 1, found {}", length));
    region.through = table.vector("through", dimension);
    return region;
}

}  // namespace nscdd
