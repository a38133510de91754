#include <limits>

#include <fmt/format.h>

#include "commands/pack_generators.hpp"
#include "files/progress.hpp"
#include "model/build_scene.hpp"
#include "nscdd/compiled.hpp"

namespace nscdd {

namespace {

template <class M>
Generated pack_model(const PackSpecification& spec, bool quiet) {
    typename M::Vec box;
    const std::vector<Grain<M>> grains = throw_grains<M>(spec, box);
    const double mass = total_mass(grains);

    // Unit density and pressure. The walls weigh as much as the sample; a step is a small part of the time in which
    // the pressure moves a grain by its size.
    SimulationSettings<M> settings;
    settings.h = 0.02 * 2 * spec.radius;
    for (int d = 0; d < M::dim; ++d)
        for (const bool upper : {false, true}) {
            Wall<M>& wall = settings.walls.emplace_back();
            wall.normal = (upper ? -1 : 1) * M::Vec::Unit(d);
            wall.offset = upper ? -box[d] : 0;
            wall.driven = true;
            wall.mass = mass;
        }
    InProcess comm(1);
    const double h = settings.h;
    Simulation<M> simulation(comm, std::move(settings), grains);
    SolveOptions options = SolveOptions{}.accelerated();  // else steps end at the cap, and walls creep on
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
        const typename M::Vec edges = box_edges<M>(simulation.walls());
        for (auto& wall : simulation.walls()) {
            wall.force = 1;
            for (int d = 0; d < M::dim; ++d)
                if (wall.normal[d] == 0) wall.force *= edges[d];
        }
        const StepReport report = simulation.step(by_nlgs<M>(options));
        ++step;
        double fastest = 0;
        for (const auto& wall : simulation.walls()) fastest = std::max(fastest, std::abs(wall.speed));
        fraction = mass / box_edges<M>(simulation.walls()).prod();
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
    const typename M::Vec edges = box_edges<M>(simulation.walls());
    Packing packing{.dim = M::dim, .x = {}, .radius = {}, .box = {edges.data(), edges.data() + M::dim}};
    for (const auto& g : gather_grains(simulation)) {
        const typename M::Vec x = g.grain.position - low;
        packing.x.insert(packing.x.end(), x.data(), x.data() + M::dim);
        packing.radius.push_back(g.grain.radius);
    }
    return {std::move(packing), fmt::format("our own contact dynamics, {} steps", step)};
}

}  // namespace

Generated pack_by_walls(const PackSpecification& spec, bool quiet) {
    return spec.dimension == 3 ? pack_model<Model<3, Frictionless>>(spec, quiet)
                               : pack_model<Model<2, Frictionless>>(spec, quiet);
}

}  // namespace nscdd
