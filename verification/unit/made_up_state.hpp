// A state with something in every dataset, and whether two are the same.
#pragma once

#include <vector>

#include "../catch.hpp"
#include "files/state.hpp"

namespace nscdd::test {

inline State made_up_state(int dim, int grains) {
    const auto n = static_cast<std::size_t>(grains), d = static_cast<std::size_t>(dim);
    const auto ramp = [](std::size_t count, double from) {
        std::vector<double> values(count);
        for (std::size_t k = 0; k < count; ++k) values[k] = from + 0.1 * static_cast<double>(k);
        return values;
    };
    State state;
    state.packing = {.dim = dim, .x = ramp(n * d, 1), .radius = ramp(n, 2), .box = ramp(d, 3)};
    state.velocity = ramp(n * d, -4);
    state.spin = ramp(n * (dim == 3 ? 3 : 1), -5);
    state.material.assign(n, 1);
    state.subdomain.assign(n, 2);
    state.multiplicity.assign(n, 3);
    state.walls = {.name = {"floor", "\xc3\xa9"},
                   .offset = ramp(2, 6),
                   .normal = ramp(2 * d, 7),
                   .velocity = ramp(2 * d, 8),
                   .normal_speed = ramp(2, 12)};
    state.materials = {.name = {"glass", ""}, .density = ramp(2, 13)};
    state.broad_phase = {.kind = "grid",
                         .partition = ramp(5, 17),
                         .imbalance = 1.2,
                         .x = ramp(n * d, 14),
                         .offset = ramp(2, 15),
                         .skin = 0.3,
                         .steps_since = 7};
    state.contacts = {.i = {0, 1, 1},
                      .j = {1, -1, -2},
                      .impulse = ramp(3 * d, 9),
                      .normal = ramp(3 * d, 10),
                      .gap = ramp(3, -11),
                      .subdomain = {0, 1, 0},
                      .normal_impulse = ramp(3, 16)};
    state.time = 0.25;
    state.step = 5'000'000'000;
    state.steps_left = 12;
    state.scene = "drop & <roll> \xc3\xa9";
    return state;
}

inline void check_equal(const State& a, const State& b) {
    CHECK(a.packing.dim == b.packing.dim);
    CHECK(a.packing.x == b.packing.x);
    CHECK(a.packing.radius == b.packing.radius);
    CHECK(a.packing.box == b.packing.box);
    CHECK(a.velocity == b.velocity);
    CHECK(a.spin == b.spin);
    CHECK(a.material == b.material);
    CHECK(a.subdomain == b.subdomain);
    CHECK(a.multiplicity == b.multiplicity);
    CHECK(a.walls.offset == b.walls.offset);
    CHECK(a.walls.normal == b.walls.normal);
    CHECK(a.walls.velocity == b.walls.velocity);
    CHECK(a.walls.name == b.walls.name);
    CHECK(a.walls.normal_speed == b.walls.normal_speed);
    CHECK(a.materials.name == b.materials.name);
    CHECK(a.materials.density == b.materials.density);
    CHECK(a.broad_phase.kind == b.broad_phase.kind);
    CHECK(a.broad_phase.partition == b.broad_phase.partition);
    CHECK(a.broad_phase.imbalance == b.broad_phase.imbalance);
    CHECK(a.broad_phase.x == b.broad_phase.x);
    CHECK(a.broad_phase.offset == b.broad_phase.offset);
    CHECK(a.broad_phase.skin == b.broad_phase.skin);
    CHECK(a.broad_phase.steps_since == b.broad_phase.steps_since);
    CHECK(a.contacts.normal_impulse == b.contacts.normal_impulse);
    CHECK(a.contacts.i == b.contacts.i);
    CHECK(a.contacts.j == b.contacts.j);
    CHECK(a.contacts.impulse == b.contacts.impulse);
    CHECK(a.contacts.normal == b.contacts.normal);
    CHECK(a.contacts.gap == b.contacts.gap);
    CHECK(a.contacts.subdomain == b.contacts.subdomain);
    CHECK(a.time == b.time);
    CHECK(a.step == b.step);
    CHECK(a.steps_left == b.steps_left);
    CHECK(a.scene == b.scene);
}

}  // namespace nscdd::test
