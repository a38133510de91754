/// @file
/// The energy balance of one step: the works of gravity, walls and contacts beside the kinetic energy. Collective.
#pragma once

#include "nscdd/comm/reduce.hpp"
#include "nscdd/core/wall.hpp"
#include "nscdd/step/report.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// In: a solved step, whose velocities are in the problems and not yet in grains and walls. gravity [m/s^2], h [s].
template <class M>
StepReport::Energy step_energy(const std::vector<Subdomain<M>>& parts, Communicator& comm,
                               std::span<const Wall<M>> walls, const typename M::Vec& gravity, double h) {
    StepReport::Energy total = reduce<StepReport::Energy>(comm, [&](std::size_t k) {
        const Subdomain<M>& part = parts[k];
        StepReport::Energy e;
        ContactProblem<M> mean;
        const bool flows = part.cell.flows();
        mean.flow = part.problem.flow;
        mean.bodies = part.problem.bodies;
        mean.walls = part.problem.walls;
        for (std::size_t g = 0; g < part.grains.size(); ++g) {
            const Grain<M>& grain = part.grains[g];
            Body<M>& body = mean.bodies[g];
            Grain<M> after = grain;
            after.velocity = body.v;
            body.v = 0.5 * (body.v + grain.velocity);
            if (!part.primary(g) || grain.fixed()) continue;
            e.before += grain.kinetic_energy();
            e.kinetic += after.kinetic_energy();
            e.external += h * (grain.load.dot(body.v) + grain.mass * gravity.dot(body.linear()));
            if (flows)
                e.walls -= h * grain.mass *
                           body.linear().dot(flow_over<M>(part.cell.gradient, grain.velocity.template head<M::dim>()));
        }
        for (std::size_t w = 0; w < walls.size(); ++w)
            if (walls[w].driven) mean.walls[w].speed = 0.5 * (walls[w].speed + mean.walls[w].speed);
        mean.each_side([&](WallBody<M>& side, int d) {
            side.speed = 0.5 * (side.speed + part.cell.gradient(d, d) * part.cell.length);
        });
        const auto add = [&](const Contact<M>& c, auto kind) {
            const typename M::Impulse v = relative_velocity(mean, c, kind);
            if constexpr (M::friction) {
                const double normal = force_of<M>(c.r).dot(c.normal) * force_of<M>(v).dot(c.normal);
                e.normal += normal;
                e.friction += c.r.dot(v) - normal;
            } else {
                e.normal += c.r[0] * v[0];
            }
        };
        for (const auto& c : part.problem.contacts) {
            add(c, BetweenGrains{});
            if constexpr (M::friction)
                if (flows)
                    e.walls -= (c.lever_i + c.lever_j) *
                               force_of<M>(c.r).dot(flow_over<M>(part.problem.flow->gradient, c.normal));
        }
        for (const auto& c : part.problem.wall_contacts) {
            add(c, WithWall{});
            const WallBody<M>& wall = part.problem.walls[static_cast<std::size_t>(c.j)];
            e.walls += impulse_vector<M>(c.r, c.normal).dot(wall.prescribed);
            if constexpr (M::rolling) e.walls += couple_of<M>(c.r).dot(wall.spin.value);
        }
        return e;
    });
    for (std::size_t w = 0; w < walls.size(); ++w) {
        if (!walls[w].driven) continue;
        const double after = parts[0].problem.walls[w].speed;
        total.before += 0.5 * walls[w].mass * walls[w].speed * walls[w].speed;
        total.kinetic += 0.5 * walls[w].mass * after * after;
        total.walls += h * walls[w].force * 0.5 * (walls[w].speed + after);
    }
    ContactProblem<M> sides;
    sides.flow = parts[0].problem.flow;
    sides.walls = parts[0].problem.walls;
    const Cell<M>& cell = parts[0].cell;
    sides.each_side([&](const WallBody<M>& side, int d) {
        const double before = cell.gradient(d, d) * cell.length;
        total.before += 0.5 * cell.mass * before * before;
        total.kinetic += 0.5 * cell.mass * side.speed * side.speed;
        total.walls -= h * cell.force(d) * 0.5 * (before + side.speed);
    });
    return total;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
