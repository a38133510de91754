// The state of a simulation on disk: it comes to rank 0 by ranges of grains, so that no process ever has all of it.
#pragma once

#include <optional>

#include "model/build_scene.hpp"
#include "nscdd/comm/throw_collectively.hpp"
#include "nscdd/step/gather.hpp"

namespace nscdd {

// Time of the scene at the end of the last step [s].
template <class M>
double time_now(const Simulation<M>& simulation, const RunRequest&) {
    return simulation.time();
}

// All of the state but its rows.
template <class M>
State state_head(const Simulation<M>& simulation, const RunRequest& request) {
    State head;
    const auto append = [](auto& to, const auto& vector) {
        to.insert(to.end(), vector.data(), vector.data() + vector.size());
    };
    const auto rows_of = [](const typename M::Gradient& matrix) {
        return typename M::Gradient(matrix.transpose());
    };  // in C order
    head.packing.dim = M::dim;
    const typename M::Vec edges = box_edges<M>(simulation.settings());
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
    for (std::size_t o = 0; o < request.scene.obstacles.size(); ++o) {
        head.obstacles.name.push_back(request.scene.obstacles[o].name);
        head.obstacles.facets.push_back(static_cast<int>(simulation.settings().obstacles[o].surface->size()));
    }
    for (const auto& material : request.scene.materials) {
        head.materials.name.push_back(material.name);
        head.materials.density.push_back(material.density);
    }
    const BroadPhaseState<M> broad_phase = detail::last_broad_phase(simulation);
    if (const Cell<M>& cell = simulation.settings().cell; cell.repeats()) {
        append(head.cell.periodic, cell.periodic);
        append(head.cell.size, cell.size);
        append(head.cell.tilt, rows_of(cell.tilt));
        append(head.cell.gradient, rows_of(cell.gradient));
        append(head.cell.broad_phase_size, broad_phase.cell.size);
        append(head.cell.broad_phase_tilt, rows_of(broad_phase.cell.tilt));
        append(head.cell.stretch, rows_of(broad_phase.stretch));
    }
    head.contacts.have_couples = M::rolling;
    head.broad_phase.kind = broad_phase.kind;
    head.broad_phase.partition = broad_phase.partition;
    head.broad_phase.imbalance = broad_phase.imbalance;
    head.broad_phase.offset = broad_phase.offsets;
    head.broad_phase.skin = broad_phase.skin;
    head.broad_phase.steps_since = broad_phase.steps_since;
    head.so_far = request.so_far;
    head.has_fixed = request.has_fixed;
    head.broad_phase.time = broad_phase.time;
    head.step = request.start_step + simulation.steps();
    head.time = time_now(simulation, request);
    head.scene = request.scene.name;
    return head;
}

// Rows of these grains.
template <class M>
State grain_rows(const std::vector<GatheredGrain<M>>& grains) {
    State rows;
    const auto append = [](std::vector<double>& to, const auto& vector) {
        to.insert(to.end(), vector.data(), vector.data() + vector.size());
    };
    for (const auto& g : grains) {
        append(rows.packing.x, g.grain.position);
        rows.packing.radius.push_back(g.grain.radius);
        append(rows.velocity, typename M::Vec(g.grain.velocity.template head<M::dim>()));
        if constexpr (M::friction)
            append(rows.spin, typename M::Spin(g.grain.velocity.template tail<M::spins>()));
        else
            rows.spin.resize(rows.spin.size() + (M::dim == 3 ? 3 : 1), 0.0);
        rows.material.push_back(g.grain.material);
        rows.packing.fixed.push_back(g.grain.fixed());
        rows.subdomain.push_back(g.subdomain);
        rows.multiplicity.push_back(g.multiplicity);
        append(rows.broad_phase.x, g.broad_phase_position);
    }
    return rows;
}

// Rows of the contacts whose first grain has one of these ids; on the process that hosts rank 0, nothing elsewhere.
// Collective.
template <class M>
State::Contacts gather_contact_rows(const Simulation<M>& simulation, detail::Ids ids = {}) {
    State::Contacts rows;
    rows.have_couples = M::rolling;
    const auto append = [](std::vector<double>& to, const typename M::Vec& vector) {
        to.insert(to.end(), vector.data(), vector.data() + M::dim);
    };
    for (const auto& c : gather_contacts(simulation, ids)) {
        rows.i.push_back(c.i);
        rows.j.push_back(c.j);
        rows.subdomain.push_back(c.subdomain);
        rows.gap.push_back(c.gap);
        rows.normal_impulse.push_back(c.normal_impulse);
        append(rows.normal, c.normal);
        append(rows.impulse, c.impulse);
        rows.couple.insert(rows.couple.end(), c.couple.data(), c.couple.data() + M::couples);
    }
    return rows;
}

// Rows of the grains with these ids as well; as above.
template <class M>
State gather_rows(const Simulation<M>& simulation, detail::Ids ids) {
    State rows = grain_rows(gather_grains(simulation, ids));
    rows.contacts = gather_contact_rows(simulation, ids);
    return rows;
}

// Writing by the process that hosts rank 0; the others learn of its failure at the end.
class Writing {
  public:
    explicit Writing(Communicator& comm) : comm_(comm), complaints_(comm.ranks().size()) {}

    bool here() const { return comm_.ranks()[0] == 0; }
    void write(auto&& some) {
        if (!here() || !complaints_[0].empty()) return;
        try {
            some();
        } catch (const std::exception& error) {
            complaints_[0] = error.what();
        }
    }
    // Collective. Throws std::invalid_argument, the same on every process, where something could not be written.
    void end() const {
        const double failed =
            reduce(comm_, 0, [this](std::size_t k) { return Buffer{double(!complaints_[k].empty())}; })[0];
        if (failed > 0) detail::throw_collectively(comm_, complaints_);
    }

  private:
    Communicator& comm_;
    std::vector<std::string> complaints_;
};

// some() by the process that hosts rank 0. Collective. Throws as Writing::end() does.
void write_on_first(Communicator& comm, auto&& some) {
    Writing writing(comm);
    writing.write(some);
    writing.end();
}

// Contacts of the last step in the whole scene. Collective.
template <class M>
std::size_t count_contacts(const Simulation<M>& simulation) {
    return static_cast<std::size_t>(reduce(simulation.comm(), 1, [&simulation](std::size_t k) {
        return Buffer{double(simulation.parts()[k].problem.contact_count())};
    })[0]);
}

inline constexpr int rows_at_once = 16384;  // grains of which rank 0 has the rows, of a scene that is written

// visit(ids) for one range of grains after the other. Grains have the ids from 0 on.
template <class M>
void visit_ranges(const Simulation<M>& simulation, int grains_at_once, auto&& visit) {
    const auto grains = static_cast<std::int64_t>(simulation.grain_count());
    for (std::int64_t begin = 0; begin < grains; begin += grains_at_once) {
        const std::int64_t end = std::min(begin + grains_at_once, grains);
        visit(detail::Ids{static_cast<int>(begin), static_cast<int>(end)});
    }
}

// Collective; the process that hosts rank 0 writes. Throws std::invalid_argument, the same on every process, where that
// one could not write.
template <class M>
void write_state(const Simulation<M>& simulation, const State& head, FileSet& files, const std::string& path,
                 int grains_at_once = rows_at_once, StateWriter::For use = StateWriter::For::pictures) {
    Writing writing(simulation.comm());
    std::optional<StateWriter> writer;
    const std::size_t contacts = count_contacts(simulation);
    writing.write([&] { writer.emplace(files, path, head, simulation.grain_count(), contacts, use); });
    visit_ranges(simulation, grains_at_once, [&](detail::Ids ids) {
        const State rows = gather_rows(simulation, ids);
        writing.write([&] { writer->append(rows); });
    });
    writing.write([&] { writer->save(); });
    writing.end();
}

// Writes the state with which the run goes on: it replaces the one before, or on failure that one stays. Collective;
// throws as write_state does.
template <class M>
void write_checkpoint(const Simulation<M>& simulation, const RunRequest& request, int steps_left) {
    State head = state_head(simulation, request);
    head.steps_left = steps_left;
    FileSet files;
    write_state(simulation, head, files, *request.outputs.checkpoint, rows_at_once, StateWriter::For::going_on);
    write_on_first(simulation.comm(), [&] { files.commit(); });
}

}  // namespace nscdd
