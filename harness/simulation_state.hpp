// The state of a simulation on disk: it comes to rank 0 by ranges of grains, so that no process ever has all of it.
#pragma once

#include <optional>

#include "build_scene.hpp"
#include "nscdd/comm/refuse.hpp"
#include "nscdd/step/gather.hpp"

namespace nscdd {

// All of the state but its rows.
template <class M>
State state_head(const Simulation<M>& simulation, const RunRequest& request) {
    State head;
    const auto append = [](std::vector<double>& to, const auto& vector) {
        to.insert(to.end(), vector.data(), vector.data() + vector.size());
    };
    head.packing.dim = M::dim;
    const typename M::Vec edges = box_edges<M>(simulation.walls());
    for (int d = 0; d < M::dim; ++d)
        head.packing.box.push_back(edges[d] > 0          ? edges[d]
                                   : request.box.empty() ? 1.0
                                                         : request.box[static_cast<std::size_t>(d)]);
    for (const auto& wall : simulation.walls()) {
        head.walls.offset.push_back(wall.offset);
        append(head.walls.normal, wall.normal);
        append(head.walls.velocity, typename M::Vec(wall.velocity + wall.speed * wall.normal));
        head.walls.normal_speed.push_back(wall.driven ? wall.speed : wall.normal_speed());
    }
    for (const auto& wall : request.scene.walls) head.walls.name.push_back(wall.name);
    for (const auto& material : request.scene.materials) {
        head.materials.name.push_back(material.name);
        head.materials.density.push_back(material.density);
    }
    const RoughDetection<M> rough = last_rough(simulation);
    head.rough.kind = rough.kind;
    head.rough.partition = rough.partition;
    head.rough.imbalance = rough.imbalance;
    head.rough.offset = rough.offsets;
    head.rough.skin = rough.skin;
    head.rough.steps_since = rough.steps_since;
    const double h = simulation.settings().h;
    head.step = request.start_step + simulation.steps();
    // of a run that goes on with the same step, that of the uninterrupted one to the last bit
    head.time = request.start_time == double(request.start_step) * h ? double(head.step) * h
                                                                     : request.start_time + simulation.steps() * h;
    head.scene = request.scene.name;
    return head;
}

// Grains, and the contacts of which they are the first; on the process that hosts rank 0, nothing elsewhere.
// Collective.
template <class M>
State gather_rows(const Simulation<M>& simulation, Ids ids) {
    State rows;
    const auto append = [](std::vector<double>& to, const auto& vector) {
        to.insert(to.end(), vector.data(), vector.data() + vector.size());
    };
    for (const auto& g : gather_grains(simulation, ids)) {
        append(rows.packing.x, g.grain.position);
        rows.packing.radius.push_back(g.grain.radius);
        append(rows.velocity, typename M::Vec(g.grain.velocity.template head<M::dim>()));
        if constexpr (M::friction)
            append(rows.spin, typename M::Spin(g.grain.velocity.template tail<M::spins>()));
        else
            rows.spin.resize(rows.spin.size() + (M::dim == 3 ? 3 : 1), 0.0);
        rows.material.push_back(g.grain.material);
        rows.subdomain.push_back(g.subdomain);
        rows.multiplicity.push_back(g.multiplicity);
        append(rows.rough.x, g.rough_position);
    }
    for (const auto& c : gather_contacts(simulation, ids)) {
        rows.contacts.i.push_back(c.i);
        rows.contacts.j.push_back(c.j);
        rows.contacts.subdomain.push_back(c.subdomain);
        rows.contacts.gap.push_back(c.gap);
        rows.contacts.normal_impulse.push_back(c.normal_impulse);
        append(rows.contacts.normal, c.normal);
        append(rows.contacts.impulse, c.impulse);
    }
    return rows;
}

// Collective; the process that hosts rank 0 writes. Grains have the ids from 0 on. Throws std::invalid_argument, the
// same on every process, where that one could not write: the others only learn of it at the end.
template <class M>
void write_state(const Simulation<M>& simulation, const State& head, FileSet& files, const std::string& path,
                 int grains_at_once = 16384) {
    Communicator& comm = simulation.comm();
    std::optional<StateWriter> writer;
    std::vector<std::string> complaints(comm.ranks().size());
    const auto write = [&](auto&& some) {
        if (comm.ranks()[0] != 0 || !complaints[0].empty()) return;
        try {
            some();
        } catch (const std::exception& error) {
            complaints[0] = error.what();
        }
    };
    const double contacts = reduce(comm, 1, [&simulation](std::size_t k) {
        return Buffer{double(simulation.parts()[k].problem.contact_count())};
    })[0];
    const auto grains = static_cast<std::int64_t>(simulation.grain_count());
    write([&] { writer.emplace(files, path, head, simulation.grain_count(), static_cast<std::size_t>(contacts)); });
    for (std::int64_t begin = 0; begin < grains; begin += grains_at_once) {
        const std::int64_t end = std::min(begin + grains_at_once, grains);
        const State rows = gather_rows(simulation, {static_cast<int>(begin), static_cast<int>(end)});
        write([&] { writer->append(rows); });
    }
    write([&] { writer->save(); });
    refuse_together(comm, complaints);
}

// The state with which the run goes on, in place of the one before or not at all. Collective; throws as write_state
// does.
template <class M>
void write_checkpoint(const Simulation<M>& simulation, const RunRequest& request, int steps_left) {
    Communicator& comm = simulation.comm();
    State head = state_head(simulation, request);
    head.steps_left = steps_left;
    FileSet files;
    write_state(simulation, head, files, request.checkpoint);
    std::vector<std::string> complaints(comm.ranks().size());
    if (comm.ranks()[0] == 0) try {
            files.commit();
        } catch (const OutputError& error) {
            complaints[0] = error.what();
        }
    refuse_together(comm, complaints);
}

}  // namespace nscdd
