#include "pack.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <random>

#include "build_scene.hpp"
#include "compiled_kernel.hpp"
#include "packing.hpp"
#include "progress.hpp"
#include "replace_file.hpp"
#include "toml_table.hpp"

namespace nscdd {

namespace {

struct PackSpecification {
    int dimension = 3, grains = 0, seed = 1;
    double radius = 0.5;        // mean
    double spread = 0;          // radii are uniform in radius (1 -+ spread)
    Eigen::VectorXd aspect;     // edges of the box at the start, relative
    double loose_fraction = 0;  // solid fraction at the start
    double solid_fraction = 0;  // to stop at; 0: go on until jammed
    double step_limit = 5000;
};

PackSpecification read_specification(const std::string& path) {
    const toml::table root = parse_toml(path);
    TomlTable table(root, path, "");
    PackSpecification spec;
    spec.dimension = table.integer("dimension", 2);
    if (spec.dimension > 3) table.fail("dimension", fmt::format("must be 2 or 3, found {}", spec.dimension));
    spec.grains = table.integer("grains", 1);
    spec.seed = table.integer("seed", 0, 1);
    spec.radius = table.number("radius", {"in [1e-50, 1e50]", [](double v) { return v >= 1e-50 && v <= 1e50; }}, 0.5);
    spec.spread = table.number("spread", {"in [0, 0.9]", [](double v) { return v >= 0 && v <= 0.9; }}, 0.0);
    spec.aspect = table.vector("aspect", spec.dimension, Eigen::VectorXd::Ones(spec.dimension));
    if (spec.aspect.minCoeff() <= 0) table.fail("aspect", "must be positive");
    spec.loose_fraction = spec.dimension == 3 ? 0.3 : 0.45;  // random placing gets slow above
    if (table.has("solid_fraction"))
        spec.solid_fraction = table.number("solid_fraction", {"above the loose start's 0.3 (0.45 in 2D) and below 0.9",
                                                              [](double v) { return v > 0.3 && v < 0.9; }});
    table.finish();
    return spec;
}

// Random sequential addition: a place is drawn until it is free. False when one is not found for a grain: beside walls
// the sample saturates at lower fractions than in bulk.
template <class M>
bool place_grains(std::vector<Grain<M>>& grains, const typename M::Vec& box, double cell, auto&& uniform) {
    constexpr int most_draws = 1'000'000;
    std::map<std::array<int, M::dim>, std::vector<const Grain<M>*>> cells;
    for (auto& grain : grains) {
        bool free = false;
        for (int draws = 0; !free; ++draws) {
            if (draws == most_draws) return false;
            std::array<int, M::dim> at{}, near{};
            for (int d = 0; d < M::dim; ++d) {
                grain.position[d] = grain.radius + uniform() * (box[d] - 2 * grain.radius);
                at[static_cast<std::size_t>(d)] = static_cast<int>(grain.position[d] / cell);
            }
            free = true;
            for (int n = 0; free && n < (M::dim == 3 ? 27 : 9); ++n) {
                for (int d = 0, rest = n; d < M::dim; ++d, rest /= 3)
                    near[static_cast<std::size_t>(d)] = at[static_cast<std::size_t>(d)] + rest % 3 - 1;
                if (const auto found = cells.find(near); found != cells.end())
                    for (const Grain<M>* other : found->second)
                        free &= (other->position - grain.position).norm() > other->radius + grain.radius;
            }
            if (free) cells[at].push_back(&grain);
        }
    }
    return true;
}

// Grains in a box of the loose fraction, or of less where they find no place in that. None where it is too narrow.
template <class M>
std::vector<Grain<M>> throw_grains(const PackSpecification& spec, typename M::Vec& box) {
    std::mt19937_64 random(static_cast<std::uint64_t>(spec.seed));
    const auto uniform = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };  // the same everywhere
    std::vector<Grain<M>> grains;
    double volume = 0;
    for (int id = 0; id < spec.grains; ++id) {
        const double radius = spec.radius * (1 + spec.spread * (2 * uniform() - 1));
        volume += grains.emplace_back(make_grain<M>(id, radius, 1.0, M::Vec::Zero())).mass;
    }
    box = spec.aspect * std::pow(volume / spec.loose_fraction / spec.aspect.prod(), 1.0 / M::dim);
    const double largest = 2 * spec.radius * (1 + spec.spread);
    if (!(box.minCoeff() >= 2 * largest)) return {};
    while (!place_grains<M>(grains, box, largest, uniform)) box *= 1.05;
    return grains;
}

template <class M>
int pack_model(const PackSpecification& spec, const PackArguments& arguments, const Provenance& provenance) {
    typename M::Vec box;
    const std::vector<Grain<M>> grains = throw_grains<M>(spec, box);
    double mass = 0;
    for (const auto& g : grains) mass += g.mass;
    if (grains.empty())
        throw InputError(fmt::format("{}: too few grains for a box of this aspect", arguments.specification));

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
    SolveOptions options;
    options.penetration = 1e-5;  // overlaps are never undone, and hundreds of steps add up
    options.max_iterations = 2000;

    Progress progress(!arguments.quiet, static_cast<int>(spec.step_limit));
    int quiet_steps = 0, step = 0;
    double fraction = spec.loose_fraction;
    bool done = false;
    while (!done && step < spec.step_limit) {
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
            throw InputError(fmt::format("{}: jammed at solid fraction {:.4f}, below the {} asked for",
                                         arguments.specification, fraction, spec.solid_fraction));
        progress.show(step, fmt::format("{} iterations, solid fraction {:.4f}, walls at {:.1e} r a step",
                                        report.solve.iterations, fraction, h * fastest / spec.radius));
    }
    if (!done) throw InputError(fmt::format("{}: not jammed after {} steps", arguments.specification, step));

    // Overlaps left by finite accuracy go by one common shrink of the radii.
    double shrink = 1;
    for (const auto& c : gather_contacts(simulation)) {
        const double sum = grains[static_cast<std::size_t>(c.i)].radius +
                           (c.j >= 0 ? grains[static_cast<std::size_t>(c.j)].radius : 0.0);
        shrink = std::min(shrink, 1 + c.gap / sum);
    }
    const Measures<M> measures = measure(simulation);
    typename M::Vec low = M::Vec::Zero();
    for (const auto& wall : simulation.walls())
        for (int d = 0; d < M::dim; ++d)
            if (wall.normal[d] == 1) low[d] = wall.offset;
    Packing packing;
    packing.dim = M::dim;
    const typename M::Vec edges = box_edges<M>(simulation.walls());
    packing.box.assign(edges.data(), edges.data() + M::dim);
    for (const auto& g : gather_grains(simulation)) {
        const typename M::Vec x = g.grain.position - low;
        packing.x.insert(packing.x.end(), x.data(), x.data() + M::dim);
        packing.radius.push_back(g.grain.radius * shrink);
    }
    const double coordination = measures.coordination();
    write_packing(arguments.output, packing,
                  {{"source", "nscdd pack"},
                   {"command", provenance.command},
                   {"commit", provenance.commit},
                   {"solid_fraction", fmt::format("{:.6f}", fraction)},
                   {"coordination", fmt::format("{:.4f}", coordination)}});
    fmt::print(
        "{}: {} grains, solid fraction {:.4f}, coordination {:.3f} without rattlers ({:.1f} %), radii shrunk by "
        "{:.1e}, {} steps\n",
        arguments.output, packing.size(), fraction, coordination,
        100 * (1 - measures.touched / static_cast<double>(packing.size())), 1 - shrink, step);
    return 0;
}

}  // namespace

int pack(const PackArguments& arguments, const Provenance& provenance) {
    const PackSpecification spec = read_specification(arguments.specification);
    check_outputs({{"--output", arguments.output, 40 * static_cast<std::uint64_t>(spec.grains)}},
                  {{"the specification", arguments.specification}});
    return spec.dimension == 3 ? pack_model<Model<3, Frictionless>>(spec, arguments, provenance)
                               : pack_model<Model<2, Frictionless>>(spec, arguments, provenance);
}

}  // namespace nscdd
