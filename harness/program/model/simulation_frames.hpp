// Frames of a simulation on disk: they come to rank 0 by ranges of grains, as states do.
#pragma once

#include "files/frames.hpp"
#include "model/frame_shapes.hpp"
#include "model/simulation_state.hpp"

namespace nscdd {

// Of all contacts of the last step, along the normal [N]. Collective.
template <class M>
double largest_force(const Simulation<M>& simulation) {
    const double impulse = reduce(simulation.comm(), 0, [&simulation](std::size_t k) {
        Buffer largest{0};
        const auto take = [&largest](const auto& contacts) {
            for (const auto& c : contacts)
                largest[0] = std::max(largest[0], std::abs(detail::impulse_vector<M>(c.r, c.normal).dot(c.normal)));
        };
        take(simulation.parts()[k].problem.contacts);
        take(simulation.parts()[k].problem.wall_contacts);
        return largest;
    })[0];
    return impulse / simulation.settings().h;
}

// Rows of the grains with these ids, and of the contacts whose first grain is one of them; on the process that hosts
// rank 0, nothing elsewhere. Collective.
template <class M>
FrameRows gather_frame_rows(const Simulation<M>& simulation, detail::Ids ids) {
    FrameRows rows;
    const auto append = [](std::vector<double>& to, const typename M::Vec& vector) {
        to.insert(to.end(), vector.data(), vector.data() + M::dim);
        if constexpr (M::dim == 2) to.push_back(0);
    };
    const double h = simulation.settings().h;
    const std::vector<GatheredGrain<M>> grains = gather_grains(simulation, ids);
    for (const auto& g : grains) {
        append(rows.x, g.grain.position);
        rows.radius.push_back(g.grain.radius);
        append(rows.velocity, g.grain.velocity.template head<M::dim>());
        double spin[3] = {0, 0, 0};
        for (int k = 0; k < M::spins; ++k) spin[M::dim == 2 ? 2 : k] = g.grain.velocity[M::dim + k];
        rows.spin.insert(rows.spin.end(), spin, spin + 3);
        rows.subdomain.push_back(g.subdomain);
        rows.multiplicity.push_back(g.multiplicity);
    }
    for (const auto& c : gather_contacts(simulation, ids)) {
        const typename M::Vec& centre = grains[static_cast<std::size_t>(c.i - ids.begin)].grain.position;
        append(rows.contacts.ends, centre);
        append(rows.contacts.ends, centre - c.branch);
        rows.contacts.grains.insert(rows.contacts.grains.end(), {c.i, c.j});
        append(rows.contacts.force, c.impulse / h);
        rows.contacts.normal_force.push_back(c.normal_impulse / h);
        rows.contacts.gap.push_back(c.gap);
        rows.contacts.subdomain.push_back(c.subdomain);
    }
    return rows;
}

// Collective; the process that hosts rank 0 has the writers and writes. Throws as write_state does.
template <class M>
void write_frame(const Simulation<M>& simulation, const RunRequest& request,
                 std::vector<std::unique_ptr<FrameWriter>>& writers) {
    Writing writing(simulation.comm());
    FrameHead head{.step = request.start_step + simulation.steps(),
                   .time = time_now(simulation, request),
                   .grains = simulation.grain_count(),
                   .contacts = count_contacts(simulation),
                   .largest_force = largest_force(simulation),
                   .least_radius = simulation.least_radius(),
                   .shapes = frame_shapes(simulation, time_now(simulation, request))};
    const auto each = [&](auto&& visit) {
        writing.write([&] {
            for (auto& writer : writers) visit(*writer);
        });
    };
    each([&](FrameWriter& writer) { writer.begin(head); });
    visit_ranges(simulation, rows_at_once, [&](detail::Ids ids) {
        const FrameRows rows = gather_frame_rows(simulation, ids);
        each([&](FrameWriter& writer) { writer.append(rows); });
    });
    each([](FrameWriter& writer) { writer.end(); });
    writing.end();
}

}  // namespace nscdd
