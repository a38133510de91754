// What of walls and cell a frame draws: planes as far as the scene reaches.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "files/frames.hpp"
#include "nscdd/comm/reduce.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd {
namespace frame_detail {

// The scene's box, of which reduce() finds the corners. In 2D the third component is 0.
struct Extent {
    using Corner = Eigen::Vector3d;
    Corner minus_low = Corner::Constant(-HUGE_VAL), high = minus_low;  // [m]
    auto summed() { return std::tuple<>(); }
    auto largest() { return std::tie(minus_low, high); }
};

template <class M>
Eigen::Vector3d in_space(const typename M::Vec& v) {
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    out.head<M::dim>() = v;
    return out;
}

template <class M>
Extent grains_extent(const Simulation<M>& simulation) {
    return reduce<Extent>(simulation.comm(), [&](std::size_t k) {
        Extent own;
        for (const auto& g : simulation.parts()[k].grains) {
            const Eigen::Vector3d x = in_space<M>(g.position);
            own.minus_low = own.minus_low.cwiseMax(-(x.array() - g.radius).matrix());
            own.high = own.high.cwiseMax((x.array() + g.radius).matrix());
        }
        return own;
    });
}

inline std::array<double, 3> list(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

// visit(a, b) for each edge of the box with this corner and these sides.
template <int dim>
void each_edge(const Eigen::Vector3d& corner, const std::array<Eigen::Vector3d, dim>& sides, auto&& visit) {
    for (unsigned from = 0; from < 1U << dim; ++from) {
        Eigen::Vector3d a = corner;
        for (unsigned d = 0; d < dim; ++d)
            if (from >> d & 1U) a += sides[d];
        for (unsigned d = 0; d < dim; ++d)
            if (!(from >> d & 1U)) visit(a, Eigen::Vector3d(a + sides[d]));
    }
}

// Corners of a plane within a box, in order about the normal; fewer than `dim` where it passes by.
template <int dim>
std::vector<std::array<double, 3>> section(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                                           const Eigen::Vector3d& normal, double offset) {
    std::array<Eigen::Vector3d, dim> sides;
    for (int d = 0; d < dim; ++d) sides[static_cast<std::size_t>(d)] = (high - low)[d] * Eigen::Vector3d::Unit(d);
    std::vector<Eigen::Vector3d> points;
    each_edge<dim>(low, sides, [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        const double of_a = normal.dot(a) - offset, of_b = normal.dot(b) - offset;
        if ((of_a <= 0) != (of_b <= 0)) points.push_back(a + of_a / (of_a - of_b) * (b - a));
    });
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const auto& p : points) centre += p / static_cast<double>(points.size());
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    const auto angle = [&](const Eigen::Vector3d& p) { return std::atan2(v.dot(p - centre), u.dot(p - centre)); };
    std::ranges::sort(points, {}, angle);
    std::vector<std::array<double, 3>> corners;
    for (const auto& p : points) corners.push_back(list(p));
    return corners;
}

// The corners of its facets, or a cylinder as flat pieces: round about, as long as the box if it has no ends.
template <class M>
void add_obstacle(std::vector<FrameShape>& shapes, int number, const Obstacle<M>& obstacle, double time,
                  const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const detail::Frame<M> frame = detail::Frame<M>::at(obstacle, time);
    const auto placed = [&](const typename M::Vec& x) { return list(in_space<M>(frame.place(x))); };
    for (const auto& facet : obstacle.surface->facets()) {
        FrameShape& shape = shapes.emplace_back(FrameShape{number, {}});
        for (const auto& corner : facet) shape.corners.push_back(placed(corner));
    }
    if (!obstacle.surface->cylinder()) return;
    const Cylinder<M>& cylinder = *obstacle.surface->cylinder();
    const Eigen::Vector3d axis = M::dim == 3 ? in_space<M>(cylinder.axis) : Eigen::Vector3d::UnitZ(),
                          u = axis.unitOrthogonal(), v = axis.cross(u);
    const double half = std::isfinite(cylinder.length) ? cylinder.length / 2 : (high - low).norm();
    constexpr int pieces = 48;
    const auto point = [&](int k, double along) {
        const double angle = 2 * std::numbers::pi * k / pieces;
        const Eigen::Vector3d x = cylinder.radius * (std::cos(angle) * u + std::sin(angle) * v) + along * axis;
        return placed(cylinder.centre + typename M::Vec(x.head<M::dim>()));
    };
    for (int k = 0; k < pieces; ++k) {
        if constexpr (M::dim == 3)
            shapes.push_back({number, {point(k, -half), point(k + 1, -half), point(k + 1, half), point(k, half)}});
        else
            shapes.push_back({number, {point(k, 0), point(k + 1, 0)}});
    }
}

}  // namespace frame_detail

// At the time of the scene [s]; obstacles are numbered behind the walls. Collective.
template <class M>
std::vector<FrameShape> frame_shapes(const Simulation<M>& simulation, double time) {
    using namespace frame_detail;
    if (simulation.grain_count() == 0) return {};  // it reaches nowhere
    const Extent extent = grains_extent(simulation);
    Eigen::Vector3d low = -extent.minus_low, high = extent.high;
    for (const auto& wall : simulation.walls())  // up to walls across an axis
        for (int d = 0; d < M::dim; ++d)
            if (std::abs(wall.normal[d]) == 1) {
                low[d] = std::min(low[d], wall.offset * wall.normal[d]);
                high[d] = std::max(high[d], wall.offset * wall.normal[d]);
            }
    std::vector<FrameShape> shapes;
    int number = 0;
    for (const auto& wall : simulation.walls()) {
        FrameShape shape{number++, section<M::dim>(low, high, in_space<M>(wall.normal), wall.offset)};
        if (shape.corners.size() >= M::dim) shapes.push_back(std::move(shape));
    }
    for (const auto& obstacle : simulation.settings().obstacles)
        add_obstacle<M>(shapes, number++, obstacle, time, low, high);
    const Cell<M>& cell = simulation.settings().cell;
    if (!cell.repeats()) return shapes;
    std::array<Eigen::Vector3d, M::dim> sides;
    for (int d = 0; d < M::dim; ++d) {
        const bool along = cell.periodic[static_cast<std::size_t>(d)];
        if (along) low[d] = cell.low[d];
        sides[static_cast<std::size_t>(d)] =
            (along ? cell.size[d] : high[d] - low[d]) * Eigen::Vector3d::Unit(d) + in_space<M>(cell.tilt.col(d));
    }
    each_edge<M::dim>(low, sides, [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        shapes.push_back({-1, {list(a), list(b)}});
    });
    return shapes;
}

}  // namespace nscdd
