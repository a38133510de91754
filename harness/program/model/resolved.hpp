// Motions that the steps of a scene do not see.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "files/toml_table.hpp"
#include "model/scene.hpp"

namespace nscdd {

// Refuses oscillations and turns of which a step is half a period or more: it would see a slower motion, or none.
// Tables of walls and obstacles are in the order of the scene.
inline void require_resolved(const Scene& scene, const std::vector<TomlTable>& walls,
                             const std::vector<TomlTable>& obstacles) {
    const double h = scene.step.h;  // 0 where the program chooses it
    const auto require = [h](const TomlTable& table, const char* key, double frequency) {
        if (2 * std::abs(frequency) * h >= 1)
            table.fail(key, fmt::format("is of a period of {:.3g} s, and a step of {:g} s does not see it: choose h "
                                        "well below {:.2g} s",
                                        1 / std::abs(frequency), h, 0.5 / std::abs(frequency)));
    };
    for (std::size_t w = 0; w < walls.size(); ++w) require(walls[w], "frequency", scene.walls[w].path.frequency);
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
        require(obstacles[o], "frequency", scene.obstacles[o].path.frequency);
        require(obstacles[o], "rate", scene.obstacles[o].turn.rate / (2 * std::numbers::pi));
    }
}

}  // namespace nscdd
