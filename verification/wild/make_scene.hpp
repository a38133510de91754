// From a seed to a scene: a family, often a heavily loaded bystander far away, and a start.
#pragma once

#include <array>

#include "built_to_fool.hpp"

namespace wild {

template <class M>
struct NamedFamily {
    const char* name;
    Family<M> build;
};

template <class M>
constexpr std::array all_families{
    NamedFamily<M>{"row", families::row<M>},
    NamedFamily<M>{"row beside column", families::row_beside_column<M>},
    NamedFamily<M>{"lid beside column", families::lid_beside_column<M>},
    NamedFamily<M>{"crowded box", families::crowded_box<M>},
    NamedFamily<M>{"gas", families::gas<M>},
    NamedFamily<M>{"overlapped", families::overlapped<M>},
    NamedFamily<M>{"heap", families::heap<M>},
    NamedFamily<M>{"moving walls", families::moving_walls<M>},
    NamedFamily<M>{"arch", families::arch<M>},
    NamedFamily<M>{"masses", families::masses<M>},
    NamedFamily<M>{"sizes", families::sizes<M>},
    NamedFamily<M>{"ring", families::ring<M>},
    NamedFamily<M>{"perimeter", families::perimeter<M>},
    NamedFamily<M>{"tree", families::tree<M>},
    NamedFamily<M>{"cradle", families::cradle<M>},
    NamedFamily<M>{"anchored chain", families::anchored_chain<M>},
    NamedFamily<M>{"graded chain", families::graded_chain<M>},
    NamedFamily<M>{"wedge", families::wedge<M>},
    NamedFamily<M>{"flat chain", families::flat_chain<M>},
    NamedFamily<M>{"flat box", families::flat_box<M>},
    NamedFamily<M>{"sheet", families::sheet<M>},
    NamedFamily<M>{"comb", families::comb<M>},
};

// Two grains that a load presses together, far from all others where walls leave room: they fill norms of the scene.
template <class M>
void add_bystander(Builder<M>& b) {
    typename M::Vec low = b.scene.grains[0].position, high = low;
    for (const auto& grain : b.scene.grains) low = low.cwiseMin(grain.position), high = high.cwiseMax(grain.position);
    const double away = 20 + (high - low).norm();
    for (const auto& place :
         {b.at(high[0] + away, high[M::dim - 1] + away), b.at(low[0] - away, high[M::dim - 1] + away),
          b.at(0.5 * (low[0] + high[0]), high[M::dim - 1] + away)}) {
        const auto& walls = b.scene.settings.walls;
        if (std::ranges::any_of(walls, [&](const auto& wall) { return wall.distance(place) < 5; })) continue;
        const double usual = b.speed + b.scene.settings.h * b.scene.settings.gravity.norm();
        const double change = usual * b.draw.log_uniform(1e-2, 3e4), density = b.draw.log_uniform(1, 1e6);
        for (const double side : {-1.0, 1.0}) {
            auto& grain = b.grain(0.5, density, place + 0.5 * side * b.at(1, 0));
            grain.load[0] = -side * grain.mass * change / b.scene.settings.h;
        }
        return;
    }
}

// only: the family's name; empty: any.
template <class M>
Scene<M> make_scene(std::uint64_t seed, const std::string& only = {}) {
    Draw draw(seed);
    auto at = static_cast<std::size_t>(draw.integer(0, static_cast<int>(all_families<M>.size()) - 1));
    for (std::size_t k = 0; k < all_families<M>.size(); ++k)
        if (all_families<M>[k].name == only) at = k;
    Builder<M> builder(draw, all_families<M>[at].name);
    all_families<M>[at].build(builder);
    if (draw.chance(0.5)) add_bystander(builder);
    Scene<M>& scene = builder.scene;
    if constexpr (M::friction) scene.settings.materials.set(0, 0, {draw.uniform(0, 1), 0});
    if (draw.chance(0.3)) scene.warm_steps = draw.integer(1, 4);
    scene.tight = draw.chance(0.7);
    scene.forget = scene.warm_steps > 0 && draw.chance(0.3);
    if (draw.chance(0.1)) scene.judged_steps = 3;
    return scene;
}

}  // namespace wild
