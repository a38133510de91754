#include <limits>

#include <fmt/format.h>

#include "commands/pack_generators.hpp"
#include "files/progress.hpp"
#include "model/build_scene.hpp"
#include "nscdd/compiled.hpp"

namespace nscdd {

namespace {

// Where walls close in on a box that repeats along the other axes, its sides there stay what they are: it starts as
// much longer between the walls as they will close.
PackSpecification stretched(PackSpecification spec) {
    const auto walls = static_cast<double>(spec.dimension) - static_cast<double>(spec.periodic.size());
    if (spec.periodic.empty() || walls == 0) return spec;
    const double end = spec.solid_fraction > 0 ? spec.solid_fraction : spec.dimension == 3 ? 0.64 : 0.84;
    for (int d = 0; d < spec.dimension; ++d)
        if (std::ranges::count(spec.periodic, d) == 0) spec.aspect[d] *= std::pow(end / spec.loose_fraction, 1 / walls);
    return spec;
}

// Unit density and pressure. The walls weigh as much as the sample; a step is a small part of the time in which the
// pressure moves a grain by its size.
template <class M>
SimulationSettings<M> pressed(const PackSpecification& spec, const Cell<M>& cell, double mass) {
    SimulationSettings<M> settings;
    settings.materials.set(0, 0, {});  // without friction
    settings.h = 0.02 * 2 * spec.radius;
    settings.cell = cell;
    if (M::friction) {  // the model of cells that flow
        settings.cell.driven.fill(true);
        settings.cell.stress.setOnes();
        settings.cell.mass = 6 * mass;
        return settings;
    }
    for (int d = 0; d < M::dim; ++d)
        for (const bool upper : {false, true}) {
            if (cell.periodic[static_cast<std::size_t>(d)]) continue;
            Wall<M>& wall = settings.walls.emplace_back();
            wall.normal = (upper ? -1 : 1) * M::Vec::Unit(d);
            wall.offset = upper ? -cell.size[d] : 0;
            wall.driven = true;
            wall.mass = mass;
        }
    return settings;
}

template <class M>
Generated pack_model(const PackSpecification& spec, bool quiet) {
    Cell<M> cell;
    const std::vector<Grain<M>> grains = throw_grains<M>(stretched(spec), cell);
    const double mass = total_mass(grains), largest = 2 * spec.largest;
    const double dense = std::pow(mass / cell.size.prod() / (M::dim == 3 ? 0.7 : 0.9), 1.0 / M::dim);  // of each side
    for (const int axis : spec.periodic)
        if (dense * cell.size[axis] < 2 * largest)
            throw InputError(spec.path + ": too few grains for a box of this aspect that repeats");
    SimulationSettings<M> settings = pressed(spec, cell, mass);
    InProcess comm(1);
    const double h = settings.h;
    Simulation<M> simulation(comm, std::move(settings), grains);
    SolveOptions options = SolveOptions{}.accelerated();  // else steps end at the cap, and walls creep on
    options.check_every = 10;                             // packings stay the same, bit for bit
    options.bounds.max_penetration = 1e-5;                // overlaps are never undone, and hundreds of steps add up
    // a packing is judged by its gaps
    options.bounds.max_gap_error = options.bounds.max_distance = std::numeric_limits<double>::infinity();
    options.max_iterations = 2000;

    constexpr int step_limit = 10000;
    Progress progress(!quiet, step_limit);
    int quiet_steps = 0, step = 0;
    double fraction = spec.loose_fraction;
    bool done = false;
    while (!done && step < step_limit) {
        const typename M::Vec edges = box_edges<M>(simulation.settings());
        for (auto& wall : simulation.walls()) {
            wall.force = 1;
            for (int d = 0; d < M::dim; ++d)
                if (wall.normal[d] == 0) wall.force *= edges[d];
        }
        const StepReport report = simulation.step(by_nlgs<M>(options));
        ++step;
        double fastest = 0;
        for (const auto& wall : simulation.walls()) fastest = std::max(fastest, std::abs(wall.speed));
        const Cell<M>& now = simulation.settings().cell;
        for (int d = 0; d < M::dim; ++d) fastest = std::max(fastest, std::abs(now.gradient(d, d) * now.size[d]));
        fraction = mass / box_edges<M>(simulation.settings()).prod();
        quiet_steps = h * fastest < 2e-5 * spec.radius ? quiet_steps + 1 : 0;
        done = spec.solid_fraction > 0 ? fraction >= spec.solid_fraction : quiet_steps >= 20;
        if (spec.solid_fraction > 0 && quiet_steps >= 20)
            throw InputError(fmt::format("{}: jammed at solid fraction {:.4f}, below the {} asked for", spec.path,
                                         fraction, spec.solid_fraction));
        progress.show(step, fmt::format("{} iterations, solid fraction {:.4f}, walls at {:.1e} r a step",
                                        report.solve.iterations, fraction, h * fastest / spec.radius));
    }
    if (!done) throw InputError(fmt::format("{}: not jammed after {} steps", spec.path, step));

    typename M::Vec low = M::Vec::Zero();
    for (const auto& wall : simulation.walls())
        for (int d = 0; d < M::dim; ++d)
            if (wall.normal[d] == 1) low[d] = wall.offset;
    const typename M::Vec edges = box_edges<M>(simulation.settings());
    Packing packing{.dim = M::dim, .x = {}, .radius = {}, .box = {edges.data(), edges.data() + M::dim}};
    for (const auto& g : gather_grains(simulation)) {
        const typename M::Vec x = simulation.settings().cell.wrapped(g.grain.position) - low;
        packing.x.insert(packing.x.end(), x.data(), x.data() + M::dim);
        packing.radius.push_back(g.grain.radius);
    }
    note_periodic(cell, packing);
    return {std::move(packing), fmt::format("our own contact dynamics, {} steps", step)};
}

}  // namespace

Generated pack_by_walls(const PackSpecification& spec, bool quiet) {
    if (static_cast<int>(spec.periodic.size()) == spec.dimension)
        return spec.dimension == 3 ? pack_model<Model<3, Coulomb>>(spec, quiet)
                                   : pack_model<Model<2, Coulomb>>(spec, quiet);
    return spec.dimension == 3 ? pack_model<Model<3, Frictionless>>(spec, quiet)
                               : pack_model<Model<2, Frictionless>>(spec, quiet);
}

}  // namespace nscdd
