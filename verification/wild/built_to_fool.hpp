// Families built to fool measures of convergence: slow modes that one sweep, a norm of the scene, or the line that an
// iteration draws does not show.
#pragma once

#include "families.hpp"

namespace wild::families {

// A closed ring that contracts: every contact closes by little, and impulses are many times a grain's.
template <class M>
void ring(Builder<M>& b) {
    const double pi = std::numbers::pi, angle = 2 * pi / b.count, radius = 0.5 / std::sin(angle / 2);
    const int waves = b.draw.integer(0, 6);
    for (int k = 0; k < b.count; ++k) {
        const auto outwards = b.at(std::cos(k * angle), std::sin(k * angle));
        b.grain(0.5, 1, radius * (1 + 1e-9) * outwards,
                -b.speed * (1 + (waves ? std::cos(waves * k * angle) : 0)) * outwards);
    }
}

// A chain along the inside of a box, four times as long as the box: round the corners it pushes on.
template <class M>
void perimeter(Builder<M>& b) {
    const int side = std::max(3, b.count / 4);
    const double edge = side - 1 + 2 * std::sqrt(0.5), step = 1;
    auto place = b.at(std::sqrt(0.5), 0);
    const auto profile = b.profile();
    int number = 0;
    for (int turn = 0; turn < 4; ++turn) {
        const double a = 0.5 * std::numbers::pi * turn;
        const auto along = b.at(std::cos(a), std::sin(a));
        for (int k = 0; k < side; ++k, ++number) {
            b.grain(0.5, 1, place + k * step * along, profile(double(number) / (4 * side)) * along);
        }
        place += (side - 1) * step * along + std::sqrt(0.5) * (along + b.at(-std::sin(a), std::cos(a)));
    }
    b.wall(b.at(1, 0), b.at(-0.5, 0)), b.wall(b.at(-1, 0), b.at(edge + 0.5, 0));
    b.wall(b.at(0, 1), b.at(0, -0.5)), b.wall(b.at(0, -1), b.at(0, edge + 0.5));
}

// Each grain carries two, each of which carries two: far in contacts, near in space.
template <class M>
void tree(Builder<M>& b) {
    b.gravity(b.draw.chance(0.5) ? 10 : 0);
    b.floor();
    const double shrink = b.draw.uniform(0.55, 0.95), ratio = b.draw.log_uniform(1, 30);
    struct Twig {
        typename M::Vec place;
        double radius, angle, spread, density;
    };
    std::vector<Twig> twigs{{b.at(0, 0.5), 0.5, 0.5 * std::numbers::pi, 0.7, 1}};
    for (std::size_t k = 0; k < twigs.size(); ++k) {
        const Twig t = twigs[k];
        b.grain(t.radius, t.density, t.place, b.at(0, -b.speed * b.draw.uniform(0, 1) * t.place[M::dim - 1]));
        if (static_cast<int>(twigs.size()) >= std::min(b.count, 250)) continue;
        for (const double side : {-1.0, 1.0}) {
            const double angle = t.angle + side * t.spread, radius = t.radius * shrink;
            const typename M::Vec place = t.place + (t.radius + radius) * b.at(std::cos(angle), std::sin(angle));
            const bool free = place[M::dim - 1] > radius && std::ranges::none_of(twigs, [&](const Twig& other) {
                                  return (other.place - place).norm() < (other.radius + radius) * (1 - 1e-9);
                              });
            if (free) twigs.push_back({place, radius, angle, 0.8 * t.spread + 0.1, t.density * ratio});
        }
    }
}

// Two heavy grains that close on each other through a chain of light ones.
template <class M>
void cradle(Builder<M>& b) {
    const double ratio = b.draw.log_uniform(1, 1e8);
    const int n = b.count;
    const auto profile = b.profile();
    const bool still = b.draw.chance(0.5);
    b.row(
        n, b.at(0, 0.5), b.at(1, 0), b.small_gap(), [](int) { return 0.5; },
        [&](int k) { return k == 0 || k + 1 == n ? ratio : 1.0; },
        [&](double s) {
            return b.at(s == 0 ? b.speed : s == 1 ? -b.speed : still ? 0 : profile(s), 0);
        });
}

// A light chain at the foot of a loaded heavy column: one component, of which the column is the norm.
template <class M>
void anchored_chain(Builder<M>& b) {
    b.floor(), b.gravity(10);
    const int height = b.draw.integer(2, 40);
    column(b, height, 0, b.draw.log_uniform(1, 1e4));
    loose_row(b, b.count, 1, 0.5);
}

// Masses that grow along a chain, so that each part of it has its own time.
template <class M>
void graded_chain(Builder<M>& b) {
    const double ratio = b.draw.log_uniform(10, 1e8), n = b.count;
    const auto profile = b.profile();
    const bool up = b.draw.chance(0.5);
    if (b.draw.chance(0.3)) b.wall(b.at(1, 0), b.at(-0.5, 0));
    b.row(
        b.count, b.at(0, 0.5), b.at(1, 0), b.small_gap(), [](int) { return 0.5; },
        [&](int k) { return std::pow(ratio, (up ? k : n - 1 - k) / (n - 1)); },
        [&](double s) { return b.at(profile(s), 0); });
}

// A grain in a flat wedge of two walls, with a column on top: impulses are long to grow, gaps hardly close.
template <class M>
void wedge(Builder<M>& b) {
    const double slope = b.draw.log_uniform(3e-3, 0.5), ratio = b.draw.log_uniform(1e-3, 1e3);
    b.gravity(10);
    const auto left = b.at(std::cos(slope), std::sin(slope)), right = b.at(-std::cos(slope), std::sin(slope));
    b.wall(left, -0.5 * left), b.wall(right, -0.5 * right);
    b.count = std::min(b.count, 100);
    const auto profile = b.profile();
    b.row(
        b.count, b.at(0, 0), b.at(0, 1), b.small_gap(), [](int) { return 0.5; },
        [&](int k) { return k == 0 ? 1.0 : ratio; }, [&](double s) { return b.at(0, -profile(s)); });
    b.scene.grains[0].velocity[M::dim - 1] -= b.speed;
}

// A nearly straight chain between two walls, bent and pushed upon.
template <class M>
void flat_chain(Builder<M>& b) {
    b.gravity(b.draw.chance(0.5) ? 10 : 0);
    const int n = std::min(b.count, 150);
    const double bend = b.draw.log_uniform(1e-4, 0.3), zigzag = b.draw.chance(0.3) ? b.draw.log_uniform(1e-3, 0.5) : 0;
    auto place = b.at(0, 0);
    for (int k = 0; k < n; ++k) {
        b.grain(0.5, 1, place, b.at(0, -b.speed * b.draw.uniform(0, 1)));
        const double angle = bend * (1 - 2.0 * (k + 1) / n) + (k % 2 ? zigzag : -zigzag);
        if (k + 1 < n) place += b.at(std::cos(angle), std::sin(angle));
    }
    b.wall(b.at(1, 0), b.at(-0.5, 0)), b.wall(b.at(-1, 0), place + b.at(0.5, 0));
    b.floor(-0.5 - zigzag);
}

// A few grains between two walls, so nearly in line that they stop far later than they would close a gap.
template <class M>
void flat_box(Builder<M>& b) {
    const int n = b.draw.integer(2, 12);
    const double slope = b.draw.log_uniform(1e-6, 3e-2), push = b.draw.log_uniform(1e-2, 1);
    const bool arch = b.draw.chance(0.3), alike = b.draw.chance(0.5);
    b.scene.settings.h = b.draw.log_uniform(1e-6, 1e-2) / b.speed;
    auto place = b.at(0, 0);
    double lowest = 0;
    for (int k = 0; k < n; ++k) {
        b.grain(0.5, alike ? 1 : b.draw.log_uniform(1e-3, 1e3), place,
                b.at(b.speed * push * b.draw.normal(), -b.speed));
        lowest = std::min(lowest, place[M::dim - 1]);
        const double angle = slope * (arch ? 1 - 2.0 * (k + 1) / n : b.draw.uniform(-1, 1));
        if (k + 1 < n) place += b.at(std::cos(angle), std::sin(angle));
    }
    b.wall(b.at(1, 0), b.at(-0.5, 0)), b.wall(b.at(-1, 0), place + b.at(0.5, 0));
    b.floor(lowest - 0.5);
}

// A sheet of grains that is pressed from one side.
template <class M>
void sheet(Builder<M>& b) {
    const double width = std::max(2.0, std::sqrt(b.count * b.draw.log_uniform(0.1, 1))), lift = std::sqrt(0.75);
    const auto columns = static_cast<int>(width), rows = std::max(1, b.count / columns);
    const auto profile = b.profile();
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
            b.grain(0.5 * (1 - 1e-4 * b.draw.uniform(0, 1)), 1, b.at(x + 0.5 * (y % 2), lift * y),
                    b.at(0, -profile(rows > 1 ? 1 - double(y) / (rows - 1) : 0)));
    b.floor(-0.5);
    if (b.draw.chance(0.5)) b.wall(b.at(1, 0), b.at(-0.5, 0)), b.wall(b.at(-1, 0), b.at(columns, 0));
    if (b.draw.chance(0.5)) return;
    auto& lid = b.wall(b.at(0, -1), b.at(0, lift * (rows - 1) + 0.5));
    lid.driven = true, lid.mass = b.draw.log_uniform(1, 1e4), lid.force = b.draw.log_uniform(1, 1e6);
}

// Rows of several lengths side by side, joined by one heavy grain that all push: one component with many times.
template <class M>
void comb(Builder<M>& b) {
    const int teeth = b.draw.integer(2, 12), longest = std::max(3, b.count / teeth);
    const double large = std::max(1.0, 0.7 * teeth), density = b.draw.log_uniform(1e-2, 1e4);
    const double least = b.draw.log_uniform(0.05, 1);
    b.grain(large, density, b.at(0, 0), b.at(b.draw.chance(0.5) ? b.speed : 0, 0));
    for (int k = 0; k < teeth; ++k) {
        const double angle = (k - 0.5 * (teeth - 1)) * 1.3 / large;
        const auto along = b.at(std::cos(angle), std::sin(angle));
        const auto profile = b.profile();
        const double weight = b.draw.log_uniform(0.1, 10);
        b.row(
            std::max(2, static_cast<int>(longest * b.draw.log_uniform(least, 1))), (large + 0.5) * along, along,
            b.small_gap(), [](int) { return 0.5; }, [=](int) { return weight; },
            [&](double s) -> typename M::Vec { return profile(s) * along; });
    }
}

}  // namespace wild::families
