/// @file
/// Motion of a simulation: grains, walls on their paths, obstacles and the cell; and what is refused of it.
#pragma once

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "nscdd/core/two_digits.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

template <class M>
void Simulation<M>::drift(double dt, double since, double begin, double end) {
    Cell<M>& cell = settings_.cell;
    const bool flows = cell.flows();
    const typename M::Gradient flow = cell.gradient_after(since);
    comm_.each_rank([&](std::size_t k) {
        for (auto& g : parts_[k].grains) {
            typename M::Vec v = g.velocity.template head<M::dim>();
            if (flows) v += detail::flow_over<M>(flow, g.position - cell.low - since * v);
            g.position += dt * v;
        }
    });
    for (auto& wall : settings_.walls)
        wall.offset +=
            wall.path ? wall.normal.dot(wall.path(time(end)) - wall.path(time(begin))) : dt * wall.normal_speed();
    place_obstacles(time(end));
    if (!flows) return;
    broad_.flow(flow, dt);
    cell.move_images(flow, dt);
    for (auto& part : parts_) part.cell = cell;
}

template <class M>
void Simulation<M>::place_obstacles(double now) {
    if (settings_.obstacles.empty()) return;
    detail::PlacedObstacles<M> placed =
        parts_[0].obstacles
            ? *parts_[0].obstacles
            : detail::PlacedObstacles<M>(std::make_shared<const std::vector<Obstacle<M>>>(settings_.obstacles),
                                         settings_.walls.size());
    const double detection = 1 - settings_.theta;
    placed.move_to(now);
    placed.begin_step(time(detection - 1), time(detection + 1), settings_.h);
    const auto shared = std::make_shared<const detail::PlacedObstacles<M>>(std::move(placed));
    for (auto& part : parts_) part.obstacles = shared;
}

template <class M>
void Simulation<M>::follow_paths() {
    const double detection = 1 - settings_.theta, h = settings_.h;
    for (auto& wall : settings_.walls) {
        if (!wall.path) continue;
        const typename M::Vec before = wall.path(time(detection - 1)), now = wall.path(time(detection)),
                              next = wall.path(time(detection + 1));
        wall.velocity = (next - now) / h;
        wall.change = wall.velocity - (now - before) / h;
    }
}

template <class M>
void Simulation<M>::check_sides() const {
    for (int d = 0; d < M::dim; ++d) {
        if (!settings_.cell.too_short(d, radii_.largest)) continue;
        std::string reason = "the side of the cell along ";
        reason += "xyz"[d];
        reason += " is ";
        reason += Cell<M>::shortest;
        refuse(std::move(reason));
    }
}

template <class M>
detail::Motion Simulation<M>::motion(Velocities which, double lookahead) {
    detail::Motion all =
        detail::find_motion<M>(parts_, comm_, settings_.walls, broad_.offsets(), broad_.stretch(), which, lookahead);
    all.speed += settings_.h * settings_.gravity.norm();
    if (const auto& obstacles = parts_[0].obstacles) {
        all.note(obstacles->moved(broad_.time(), obstacles->time() + lookahead),
                 obstacles->moved(obstacles->time(), obstacles->time() + settings_.h) / settings_.h);
    }
    if (settings_.cell.flows()) {
        all.moved += 0.5 * broad_.strained(settings_.cell.gradient, lookahead, radii_.largest);
        all.speed += M::dim * settings_.cell.gradient.cwiseAbs().maxCoeff() * (radii_.largest + 0.5 * broad_.skin());
    }
    if (!std::isfinite(all.moved + all.speed))
        throw std::runtime_error("step " + std::to_string(steps_ + 1) +
                                 ": positions or velocities are no longer finite");
    if (const double most = 0.2 * settings_.cell.least_size(); settings_.h * all.speed > most)
        refuse("grains move by more than a fifth of the cell within the step: take h <= " +
               detail::two_digits(0.999 * most / all.speed, std::floor) + " s");
    return all;
}

}}  // namespace nscdd::NSCDD_ABI
