// Families of random scenes: what loose rows, columns, boxes, arches and heaps do within one step.
#pragma once

#include "scene.hpp"

namespace wild {

template <class M>
using Family = void (*)(Builder<M>&);

namespace families {

// A column at rest on the floor, or pressed together by its fall.
template <class M>
void column(Builder<M>& b, int grains, double x, double density = 1) {
    b.row(
        grains, b.at(x, 0.5), b.at(0, 1), 0, [](int) { return 0.5; }, [=](int) { return density; },
        [](double) -> typename M::Vec { return M::Vec::Zero(); });
}

// A row along the floor, or in the air.
template <class M>
void loose_row(Builder<M>& b, int grains, double x, double y) {
    const auto profile = b.profile();
    b.row(
        grains, b.at(x, y), b.at(1, 0), b.small_gap(), [](int) { return 0.5; }, [](int) { return 1.0; },
        [&](double s) { return b.at(profile(s), 0); });
}

template <class M>
void row(Builder<M>& b) {
    loose_row(b, b.count, 0, 0.5);
    if (b.draw.chance(0.5)) b.floor(), b.gravity(10);
}

template <class M>
void row_beside_column(Builder<M>& b) {
    b.floor(), b.gravity(10);
    if (b.draw.chance(0.5)) b.speed = b.draw.log_uniform(1e-4, 1e-1);
    const int height = b.draw.integer(3, 80);
    column(b, height, 0, b.draw.chance(0.5) ? 1 : b.draw.log_uniform(1, 1e4));
    loose_row(b, b.count, 4, b.draw.chance(0.7) ? 0.5 : 2.0);
}

// A lid pushed onto one column; others stand beside it.
template <class M>
void lid_beside_column(Builder<M>& b) {
    b.floor(), b.gravity(b.draw.chance(0.8) ? 10 : 0);
    const int height = b.draw.integer(2, 60);
    column(b, height, 0);
    auto& lid = b.wall(b.at(0, -1), b.at(0, height + b.draw.uniform(0, 1e-3)));
    lid.driven = true;
    lid.mass = b.draw.log_uniform(1e-2, 1e4);
    lid.force = b.draw.log_uniform(1, 1e7);
    for (int left = b.count, k = 1; left > 0; ++k) {
        const int beside = std::min(left, b.draw.integer(2, std::max(2, height)));
        column(b, std::min(beside, height), 3.0 * k);
        left -= beside;
    }
}

// Grains on a square lattice that fills a box; walls at rest, moving, or driven.
template <class M>
void box(Builder<M>& b, double spacing, double radius_spread, double shake) {
    const int side = std::max(2, static_cast<int>(std::round(std::pow(b.count, 1.0 / M::dim))));
    int total = 1;
    for (int d = 0; d < M::dim; ++d) total *= side;
    for (int k = 0; k < total; ++k) {
        typename M::Vec x;
        for (int d = 0, rest = k; d < M::dim; ++d, rest /= side) x[d] = 0.5 + spacing * (rest % side);
        const double radius = 0.5 * (1 - radius_spread * b.draw.uniform(0, 1));
        b.grain(radius, 1, x + b.draw.template vector<typename M::Vec>(shake),
                b.draw.template vector<typename M::Vec>(b.speed));
    }
    const double edge = 1 + spacing * (side - 1);
    for (int d = 0; d < M::dim; ++d)
        for (const double sign : {1.0, -1.0}) {
            const typename M::Vec axis = M::Vec::Unit(d);
            auto& wall = b.wall(sign * axis, sign > 0 ? typename M::Vec(M::Vec::Zero()) : typename M::Vec(edge * axis));
            const double kind = b.draw.uniform(0, 1);
            if (kind < 0.2) {
                wall.velocity = b.draw.template vector<typename M::Vec>(0.1 * b.speed);
                // inwards only sometimes: else there is often no room
                if (wall.normal_speed() > 0 && b.draw.chance(0.5)) wall.velocity = -wall.velocity;
            } else if (kind < 0.45) {
                wall.driven = true;
                wall.mass = b.draw.log_uniform(0.1, 1e3);
                wall.force = b.draw.log_uniform(1, 1e5);
            }
        }
}

template <class M>
void crowded_box(Builder<M>& b) {
    b.gravity(10);
    box(b, b.draw.uniform(0.95, 1.0), b.draw.chance(0.5) ? 0 : 0.05, 3e-4);
}

template <class M>
void gas(Builder<M>& b) {
    b.scene.settings.h = 0.2 / (4 * b.speed);
    box(b, b.draw.uniform(1.01, 1.2), 0.2, 0.005);
    // else walls that fly by all grains in a step make a contact of every pair
    for (auto& wall : b.scene.settings.walls)
        if (wall.driven) wall.force = std::min(wall.force, 4 * b.speed * wall.mass / b.scene.settings.h);
}

// Grains that overlap by up to a quarter of a radius, at rest or not.
template <class M>
void overlapped(Builder<M>& b) {
    b.gravity(b.draw.chance(0.5) ? 10 : 0);
    if (b.draw.chance(0.3)) b.speed = 0;
    box(b, b.draw.uniform(0.88, 0.97), 0.1, 0.01);
}

// It has been falling for some steps, or lies.
template <class M>
void heap(Builder<M>& b) {
    b.gravity(10);
    b.speed = b.draw.log_uniform(1e-3, 1);
    b.scene.settings.h = b.draw.log_uniform(1e-3, 1e-2);
    box(b, b.draw.uniform(0.99, 1.02), 0.1, 0.005);
    b.scene.warm_steps = b.draw.integer(5, 40);
}

// Walls that close in while others give way.
template <class M>
void moving_walls(Builder<M>& b) {
    b.speed = b.draw.log_uniform(1e-3, 1);
    box(b, b.draw.uniform(0.98, 1.001), 0.1, 0.003);
    auto& walls = b.scene.settings.walls;
    walls[0].driven = walls[1].driven = false;
    walls[0].velocity = b.at(b.draw.log_uniform(1e-2, 10), 0);
    walls[1].velocity = b.draw.chance(0.5) ? walls[0].velocity : typename M::Vec(M::Vec::Zero());
    if (walls[1].velocity.norm() == 0) {
        walls[1].driven = true;
        walls[1].mass = b.draw.log_uniform(0.1, 1e3);
        walls[1].force = b.draw.log_uniform(1, 1e4);
    }
}

// A half circle of grains between two walls, with a load on its crown.
template <class M>
void arch(Builder<M>& b) {
    b.gravity(10);
    const double part = b.draw.log_uniform(0.05, 1);  // of the half circle: flat arches push hardest
    const int n = std::max(3, b.count / 2);
    const double pi = std::numbers::pi, angle = part * pi / n, radius = 0.5 / std::sin(angle / 2);
    const auto outwards = [&](int k) { return 0.5 * (pi - part * pi) + (k + 0.5) * angle; };
    const double base = radius * std::sin(outwards(0)), reach = radius * std::cos(outwards(0));
    for (int k = 0; k < n; ++k)
        b.grain(0.5, 1, b.at(radius * std::cos(outwards(k)), radius * std::sin(outwards(k)) - base + 0.5),
                b.at(0, b.draw.chance(0.5) ? -b.speed * b.draw.uniform(0, 1) : 0));
    b.wall(b.at(1, 0), b.at(-reach - 0.5, 0)), b.wall(b.at(-1, 0), b.at(reach + 0.5, 0)), b.floor();
    if (b.draw.chance(0.7))
        b.grain(0.5, b.draw.log_uniform(1, 1e6), b.at(0.0, radius - base + 1.5 - (n % 2 ? 0 : 0.1)), b.at(0, -b.speed));
}

// Heavy grains on light ones: columns and boxes with densities to 1e8.
template <class M>
void masses(Builder<M>& b) {
    const double ratio = b.draw.log_uniform(10, 1e8);
    b.gravity(10);
    if (b.draw.chance(0.5)) {
        b.floor();
        b.count = std::min(b.count, 60);
        b.row(
            b.count, b.at(0, 0.5), b.at(0, 1), 0, [](int) { return 0.5; },
            [&](int k) { return k + 1 == b.count     ? ratio
                                : b.draw.chance(0.2) ? b.draw.log_uniform(1, ratio)
                                                     : 1.0; },
            [&](double) { return b.at(0, b.draw.chance(0.5) ? 0 : b.speed * b.draw.normal()); });
    } else {
        box(b, b.draw.uniform(0.97, 1.001), 0.1, 0.003);
        for (auto& grain : b.scene.grains) grain.mass *= b.draw.chance(0.5) ? b.draw.log_uniform(1, ratio) : 1.0;
    }
}

// Radii to 1 : 100: small grains beneath and around a large one, and a row of all sizes.
template <class M>
void sizes(Builder<M>& b) {
    const double ratio = b.draw.log_uniform(3, 100);
    b.floor(), b.gravity(10);
    const double small = 0.5, large = small * ratio;
    const int beneath = std::min(b.count, static_cast<int>(ratio) + 3);
    for (int k = 0; k < beneath; ++k) {  // on the floor, beneath the large one as far as they have room
        const double x = (k - 0.5 * (beneath - 1)) * (1 + 1e-6), rise = large + small;
        if (std::abs(x) < rise) b.grain(small, 1, b.at(x, small), b.at(-0.1 * b.speed * x / beneath, 0));
    }
    b.grain(large, 1, b.at(0.0, large + 2 * small), b.at(0, -b.speed));
    b.row(
        std::max(2, b.count - beneath), b.at(2 * large + 100, 1.5 * large), b.at(1, 0), b.small_gap(),
        [&](int) { return b.draw.log_uniform(small, large); }, [](int) { return 1.0; },
        [&](double s) { return b.at(-b.speed * s, 0); });
}

}  // namespace families

}  // namespace wild
