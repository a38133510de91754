// The time step of a scene that leaves it to the program: h = "auto".
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/run_request.hpp"
#include "nscdd/comm/reduce.hpp"
#include "nscdd/core/two_digits.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd {

namespace automatic_detail {

// Of the grains: the smallest and the fastest, the extent of the scene, and the least density.
template <class M>
struct Survey {
    double minus_least = -std::numeric_limits<double>::infinity(), speed = 0, minus_density = minus_least;
    typename M::Vec minus_low = M::Vec::Constant(minus_least), high = minus_low;
    auto summed() { return std::tie(); }
    auto largest() { return std::tie(minus_least, speed, minus_density, minus_low, high); }
};

// The largest [m/s].
inline double speed_of(const ScenePath& path) {
    double most = path.kind == ScenePath::Kind::Oscillating
                      ? 2 * std::numbers::pi * std::abs(path.frequency) * path.amplitude.norm()
                  : path.kind == ScenePath::Kind::Steady ? path.velocity.norm()
                                                         : 0;
    for (std::size_t k = 1; k < path.times.size(); ++k)
        most = std::max(most, (path.places[k] - path.places[k - 1]).norm() / (path.times[k] - path.times[k - 1]));
    return most;
}

// visit(place) for the points of an obstacle at the start that lie farthest from others: corners, and of a cylinder
// those of a box round it; not along an axis without an end.
template <class M>
void visit_ends(const Obstacle<M>& obstacle, auto&& visit) {
    for (const Facet<M>& facet : obstacle.surface->facets())
        for (const auto& corner : facet) visit(corner);
    const auto& cylinder = obstacle.surface->cylinder();
    if (!cylinder) return;
    typename M::Vec reach = M::Vec::Constant(cylinder->radius);
    for (int d = 0; M::dim == 3 && d < M::dim; ++d) {
        const double along = std::abs(cylinder->axis[d]);
        reach[d] *= std::sqrt(std::max(0.0, 1 - along * along));
        if (std::isfinite(cylinder->length)) reach[d] += 0.5 * cylinder->length * along;
    }
    for (const double sign : {-1.0, 1.0}) visit(typename M::Vec(cylinder->centre + sign * reach));
}

// The largest of an obstacle that turns, beside its path [m/s].
template <class M>
double turning_speed(const Obstacle<M>& obstacle) {
    double arm = 0;
    visit_ends(obstacle, [&](const typename M::Vec& end) {
        typename M::Vec way = end - obstacle.turn.centre;
        if constexpr (M::dim == 3) way -= way.dot(obstacle.turn.axis) * obstacle.turn.axis;
        arm = std::max(arm, way.norm());
    });
    return std::abs(obstacle.turn.rate) * arm;
}

}  // namespace automatic_detail

// The step in which the smallest grain moves by automatic_way() of its radius at the speed that is to be expected.
// That speed is the largest of grains, walls, obstacles and grains to come at
// the start; what a fall through the scene adds to it; what a pressure or stress gives a grain, sqrt(pressure /
// density); and what a wall gains that a force drives, over a radius. Rounded down to two digits [s]. Collective;
// `mine`: grains of this process.
template <class M>
double automatic_step(const Scene& scene, std::span<const Grain<M>> mine, const SimulationSettings<M>& settings,
                      Communicator& comm) {
    using Survey = automatic_detail::Survey<M>;
    const Survey all = reduce<Survey>(comm, [&mine](std::size_t k) {
        Survey own;
        if (k > 0) return own;
        for (const Grain<M>& grain : mine) {
            own.minus_least = std::max(own.minus_least, -grain.radius);
            own.speed = std::max(own.speed, grain.velocity.template head<M::dim>().norm());
            own.minus_low = own.minus_low.cwiseMax(-grain.position);
            own.high = own.high.cwiseMax(grain.position);
        }
        return own;
    });
    double least = -all.minus_least, speed = all.speed, density = std::numeric_limits<double>::infinity();
    typename M::Vec low = -all.minus_low, high = all.high;
    for (const SceneMaterial& material : scene.materials) density = std::min(density, material.density);
    for (const SceneInsertion& insertion : scene.exchange.insertions) {
        least = std::min(least, insertion.radii ? insertion.radii->least : insertion.radius);
        speed = std::max(speed, insertion.velocity.norm());
        low = low.cwiseMin(typename M::Vec(insertion.box.low));
        high = high.cwiseMax(typename M::Vec(insertion.box.high));
    }
    double pressure = 0, pushed = 0;
    for (const auto& [axis, stress] : scene.cell.stress) pressure = std::max(pressure, stress);
    for (std::size_t w = 0; w < scene.walls.size(); ++w) {
        pressure = std::max(pressure, scene.walls[w].pressure);
        const Wall<M>& wall = settings.walls[w];
        const double path = automatic_detail::speed_of(scene.walls[w].path);
        speed = std::max(speed, wall.velocity.norm() + std::abs(wall.speed) + path);
        if (wall.driven) pushed = std::max(pushed, std::sqrt(2 * std::abs(wall.force) / wall.mass * least));
        const double height = wall.offset;  // a wall is as far as a fall may go
        for (int d = 0; d < M::dim; ++d) {
            if (wall.normal[d] == 1) low[d] = std::min(low[d], height);
            if (wall.normal[d] == -1) high[d] = std::max(high[d], -height);
        }
    }
    for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
        const Obstacle<M>& obstacle = settings.obstacles[o];
        speed = std::max(
            speed, automatic_detail::speed_of(scene.obstacles[o].path) + automatic_detail::turning_speed(obstacle));
        automatic_detail::visit_ends(obstacle, [&](const typename M::Vec& end) {  // a fall may end there
            for (int d = 0; d < M::dim; ++d) {
                if (scene.gravity[d] < 0) low[d] = std::min(low[d], end[d]);
                if (scene.gravity[d] > 0) high[d] = std::max(high[d], end[d]);
            }
        });
    }
    speed += std::sqrt(2 * scene.gravity.cwiseAbs().dot(Eigen::VectorXd(high - low)));
    speed += std::sqrt(pressure / density) + pushed;
    speed += 2 * least * settings.cell.gradient.cwiseAbs().maxCoeff();
    if (!(speed > 0) || !std::isfinite(speed))
        throw InputError(scene.file + ": step: h = \"auto\" finds nothing that moves: give h as a number");
    const double h = scene.automatic_way() * least / speed;
    const double unit = std::pow(10, std::floor(std::log10(h)) - 1);
    return std::floor(h / unit * (1 + 1e-12)) * unit;
}

}  // namespace nscdd
