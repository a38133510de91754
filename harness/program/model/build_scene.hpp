// From a scene and a packing or state, as read, to what the kernel steps.
#pragma once

#include <ranges>

#include "model/automatic_step.hpp"
#include "model/exact_sum.hpp"
#include "model/run_request.hpp"
#include "nscdd/step/simulation.hpp"
#include "registry/laws.hpp"
#include "registry/partitions.hpp"

namespace nscdd {

template <class M>
struct BuiltScene {  // of grains, impulses and positions the share of one process
    std::vector<Grain<M>> grains;
    SimulationSettings<M> settings;
    std::vector<PairImpulse<M>> impulses;
    std::optional<BroadPhaseState<M>> broad_phase;  // of a state to go on from
    std::vector<std::string> notes;                 // on what only shows once scene and packing meet
};

namespace build_detail {

// Grains of a packing or a state, with the motion that it has.
template <class M>
std::vector<Grain<M>> stored_grains(const RunRequest& request) {
    const Scene& scene = request.scene;
    const State& from = request.from;
    const Packing& packing = request.goes_on() ? from.packing : request.packing;
    const auto& materials = request.goes_on() ? from.material : packing.material;
    const auto& velocity = request.goes_on() ? from.velocity : packing.velocity;
    const auto& spin = request.goes_on() ? from.spin : packing.spin;
    std::vector<Grain<M>> grains;
    for (std::size_t g = 0; g < packing.size(); ++g) {
        const int material = materials.empty() ? scene.packing_material : materials[g];
        Grain<M>& grain = grains.emplace_back(
            make_grain<M>(static_cast<int>(packing.before + g), packing.radius[g],
                          scene.materials[static_cast<std::size_t>(material)].density,
                          Eigen::Map<const typename M::Vec>(packing.x.data() + g * M::dim), material));
        if (!request.masses.empty()) {
            grain.inertia *= request.masses[g] / grain.mass;
            grain.mass = request.masses[g];
        }
        if (!velocity.empty())
            grain.velocity.template head<M::dim>() = Eigen::Map<const typename M::Vec>(velocity.data() + g * M::dim);
        if constexpr (M::friction)
            if (!spin.empty())
                grain.velocity.template tail<M::spins>() =
                    Eigen::Map<const typename M::Spin>(spin.data() + g * M::spins);
        if (!packing.fixed.empty() && packing.fixed[g] != 0) fix(grain);
    }
    return grains;
}

template <class M>
void load(Grain<M>& grain, const SceneGrain& single) {
    grain.load.template head<M::dim>() = single.force;
    if constexpr (M::friction) grain.load.template tail<M::spins>() = single.torque;
}

template <class M>
detail::Path<M> path_of(const ScenePath& path) {
    if (path.kind == ScenePath::Kind::Steady) return steady<M>(typename M::Vec(path.velocity));
    if (path.kind == ScenePath::Kind::Oscillating)
        return oscillation<M>(typename M::Vec(path.amplitude), path.frequency, path.phase);
    if (path.kind == ScenePath::Kind::Table)
        return along_table<M>(path.times, {path.places.begin(), path.places.end()});
    return {};
}

// Throws InputError for one that is no surface.
template <class M>
Obstacle<M> obstacle_of(const SceneObstacle& source, const std::string& scene_file) {
    Obstacle<M> obstacle;
    obstacle.material = source.material;
    obstacle.path = path_of<M>(source.path);
    obstacle.turn = {source.turn.centre, source.turn.axis, source.turn.rate};
    try {
        if (source.cylinder) {
            Cylinder<M> cylinder{.centre = source.cylinder->centre, .radius = source.cylinder->radius};
            cylinder.axis = source.cylinder->axis;
            if (source.cylinder->length) cylinder.length = *source.cylinder->length;
            obstacle.surface = make_surface<M>(cylinder);
            return obstacle;
        }
        std::vector<Facet<M>> facets;
        for (const auto& corners : source.facets) {
            Facet<M>& facet = facets.emplace_back();
            for (std::size_t k = 0; k < facet.size(); ++k) facet[k] = corners[k];
        }
        obstacle.surface = make_surface<M>(std::move(facets));
    } catch (const std::invalid_argument& error) {
        throw InputError(fmt::format("{}: obstacle '{}': {}", scene_file, source.name, error.what()));
    }
    return obstacle;
}

// Of obstacles a thousand times larger or smaller than the box of the grains: their unit may be another one.
// Collective.
template <class M>
std::vector<std::string> notes_on_units(const BuiltScene<M>& built, const Scene& scene, Communicator& comm) {
    if (scene.obstacles.empty()) return {};
    const std::span<const double> box = reduce(comm, 0, [&built](std::size_t k) {
        Buffer extent(2 * M::dim, -std::numeric_limits<double>::max());  // minus low corner, high corner
        if (k > 0) return extent;
        for (const Grain<M>& grain : built.grains)
            for (int d = 0; d < M::dim; ++d) {
                double &low = extent[static_cast<std::size_t>(d)], &high = extent[static_cast<std::size_t>(M::dim + d)];
                low = std::max(low, grain.radius - grain.position[d]);
                high = std::max(high, grain.position[d] + grain.radius);
            }
        return extent;
    });
    double grains = 0;
    for (std::size_t d = 0; d < M::dim; ++d) grains = std::max(grains, box[d] + box[M::dim + d]);
    std::vector<std::string> notes;
    if (!(grains > 0)) return notes;  // there are none as yet
    for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
        const SceneObstacle& source = scene.obstacles[o];
        Eigen::VectorXd low = Eigen::VectorXd::Constant(M::dim, infinite), high = -low;
        for (const auto& facet : source.facets)
            for (const Eigen::VectorXd& corner : facet) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
        const double size = source.cylinder ? 2 * source.cylinder->radius : (high - low).maxCoeff();
        if (size > 1000 * grains || 1000 * size < grains)
            notes.push_back(
                fmt::format("{}: obstacle '{}' has the size {:.2g}, the box of the grains {:.2g}: is its "
                            "unit of length another one?",
                            scene.file, source.name, size, grains));
    }
    return notes;
}

// Adds the scene's own grains behind those of the packing. A state has these grains already, but for their loads.
template <class M>
void add_own_grains(const RunRequest& request, std::vector<Grain<M>>& grains) {
    const Scene& scene = request.scene;
    const std::size_t own = scene.grains.size();
    if (request.goes_on()) {
        if (scene.exchange.any()) return;  // without loads, and a grain has no longer the id that it had
        const std::size_t packed = request.from.packing.total() - own;
        for (auto& grain : grains)
            if (const auto id = static_cast<std::size_t>(grain.id); id >= packed)
                load(grain, scene.grains[id - packed]);
        return;
    }
    const hdf5::Rows rows = Share{request.share.part, request.share.parts}.of(own);
    for (std::size_t k = rows.begin; k < rows.end; ++k) {
        const SceneGrain& single = scene.grains[k];
        Grain<M>& grain =
            grains.emplace_back(make_grain<M>(static_cast<int>(request.packing.total() + k), single.radius,
                                              scene.materials[static_cast<std::size_t>(single.material)].density,
                                              typename M::Vec(single.position), single.material));
        load(grain, single);
        grain.velocity.template head<M::dim>() = single.velocity;
        if constexpr (M::friction) grain.velocity.template tail<M::spins>() = single.spin;
        if (single.fixed) fix(grain);
    }
}

template <class M>
typename M::Vec vector_of(const std::vector<double>& stored) {
    return Eigen::Map<const typename M::Vec>(stored.data());
}

// Of rows in C order.
template <class M>
typename M::Gradient matrix_of(const std::vector<double>& stored) {
    return Eigen::Map<const typename M::Gradient>(stored.data()).transpose();
}

// Where the scene repeats, as it is at the start of the run.
template <class M>
Cell<M> cell_of(const RunRequest& request) {
    const SceneCell& source = request.scene.cell;
    Cell<M> cell;
    for (std::size_t k = 0; k < source.axes.size(); ++k) {
        const int axis = source.axes[k];
        cell.periodic[static_cast<std::size_t>(axis)] = true;
        cell.size[axis] = cell_side(request.scene, k, request.box);
    }
    for (std::size_t row = 0; row < source.gradient.size(); ++row)
        cell.gradient.row(static_cast<Eigen::Index>(row)) = source.gradient[row].transpose();
    for (const auto& [axis, stress] : source.stress) {
        cell.driven[static_cast<std::size_t>(axis)] = true;
        cell.stress[axis] = stress;
    }
    if (!request.packing.tilt.empty() && static_cast<int>(source.axes.size()) == M::dim)
        cell.tilt = matrix_of<M>(request.packing.tilt);
    const State::Cell& from = request.from.cell;
    if (!from.size.empty()) {
        cell.size = vector_of<M>(from.size);
        cell.tilt = matrix_of<M>(from.tilt);
        const typename M::Gradient gradient = matrix_of<M>(from.gradient);
        for (const auto& [axis, stress] : source.stress) cell.gradient(axis, axis) = gradient(axis, axis);
    }
    return cell;
}

}  // namespace build_detail

// Builds the share of this process. Collective. Throws InputError, the same on every process, for errors that only show
// once scene and packing meet.
template <class M>
BuiltScene<M> build_scene(const RunRequest& request, Communicator& comm) {
    const Scene& scene = request.scene;
    BuiltScene<M> built{build_detail::stored_grains<M>(request), {}, {}, {}, {}};
    SimulationSettings<M>& settings = built.settings;
    settings.cell = build_detail::cell_of<M>(request);
    build_detail::add_own_grains<M>(request, built.grains);
    if (!request.goes_on())  // a state says which grains are fixed
        for (const Region& region : scene.fixed)
            for (Grain<M>& grain : built.grains)
                if (region.contains(settings.cell.wrapped(grain.position))) fix(grain);
    if (request.has_fixed && (!scene.cell.gradient.empty() || !scene.cell.stress.empty()))
        throw InputError(scene.file + ": a grain is fixed, which a [cell] with a gradient or a stress would move");
    if (request.from.packing.total() + request.packing.total() + scene.grains.size() == 0 &&
        scene.exchange.insertions.empty() && !(request.goes_on() && scene.exchange.any()))
        throw InputError(scene.file + ": no grains: give a [packing], [[grain]]s, or --packing FILE");
    const double mass = sum_in_any_order(
        comm, std::views::transform(built.grains, [](const Grain<M>& g) { return g.fixed() ? 0 : g.mass; }));

    settings.h = scene.step.h;
    settings.theta = scene.step.theta;
    settings.may_be_empty = scene.exchange.any();
    settings.broad_phase_every = scene.step.broad_phase_every;
    settings.gravity = scene.gravity;
    settings.materials = Materials<M>(static_cast<int>(scene.materials.size()));
    if (scene.pairs.empty()) settings.materials.set(0, 0, make_pairing<typename M::Law>(0, {}));  // a note says so
    for (const auto& pair : scene.pairs)
        settings.materials.set(pair.a, pair.b, make_pairing<typename M::Law>(pair.restitution, pair.coefficients));
    settings.partition = choose_partition<M>(request.partition);
    settings.multiplicity = request.multiplicity;
    if (settings.cell.any_driven()) settings.cell.mass = scene.cell.mass.value_or(6 * mass);
    const State& from = request.from;
    for (std::size_t w = 0; w < scene.walls.size(); ++w) {
        const SceneWall& source = scene.walls[w];
        Wall<M>& wall = settings.walls.emplace_back();
        wall.material = source.material;
        wall.normal = source.normal;
        wall.driven = source.driven();
        wall.velocity = source.velocity;
        wall.path = build_detail::path_of<M>(source.path);
        if (wall.driven) {
            wall.velocity -= wall.velocity.dot(wall.normal) * wall.normal;
            wall.mass = source.mass.value_or(mass);
            wall.force = source.force;
        }
        if (request.goes_on()) {
            wall.offset = from.walls.offset[w];
            if (wall.driven) wall.speed = from.walls.normal_speed[w];
        } else {
            wall.offset = wall.normal.dot(typename M::Vec(wall_point(scene, source, request.box)));
        }
    }
    for (const SceneObstacle& obstacle : scene.obstacles)
        settings.obstacles.push_back(build_detail::obstacle_of<M>(obstacle, scene.file));
    built.notes = build_detail::notes_on_units(built, scene, comm);
    if (scene.step.automatic)
        settings.h =
            request.so_far.h.empty() ? automatic_step<M>(scene, built.grains, settings, comm) : request.so_far.h[0];
    // if the run goes on with the same h, the times of the uninterrupted run to the last bit
    if (request.start_time == double(request.start_step) * settings.h)
        settings.steps_before = request.start_step;
    else
        settings.start_time = request.start_time;
    for (std::size_t c = 0; c < from.contacts.i.size(); ++c) {
        const typename M::Vec impulse = Eigen::Map<const typename M::Vec>(from.contacts.impulse.data() + c * M::dim);
        typename M::Couple couple = M::Couple::Zero();  // of a state of another law
        if (!from.contacts.couple.empty() && M::rolling)
            couple = Eigen::Map<const typename M::Couple>(from.contacts.couple.data() + c * M::couples);
        if constexpr (M::friction)
            built.impulses.push_back({from.contacts.i[c], from.contacts.j[c], detail::with_couple<M>(impulse, couple)});
        else
            built.impulses.push_back(
                {from.contacts.i[c], from.contacts.j[c], typename M::Impulse{from.contacts.normal_impulse[c]}});
    }
    if (request.goes_on()) {
        BroadPhaseState<M>& broad_phase = built.broad_phase.emplace();
        broad_phase.kind = from.broad_phase.kind;
        broad_phase.partition = from.broad_phase.partition;
        broad_phase.imbalance = from.broad_phase.imbalance;
        broad_phase.skin = from.broad_phase.skin;
        broad_phase.steps_since = from.broad_phase.steps_since;
        for (std::size_t g = 0; g < from.packing.size(); ++g)
            broad_phase.positions.emplace_back(
                Eigen::Map<const typename M::Vec>(from.broad_phase.x.data() + g * M::dim));
        broad_phase.offsets = from.broad_phase.offset;
        broad_phase.time = from.broad_phase.time;
        broad_phase.cell = settings.cell;
        if (!from.cell.size.empty()) {
            broad_phase.cell.size = build_detail::vector_of<M>(from.cell.broad_phase_size);
            broad_phase.cell.tilt = build_detail::matrix_of<M>(from.cell.broad_phase_tilt);
            broad_phase.stretch = build_detail::matrix_of<M>(from.cell.stretch);
        }
    }
    return built;
}

// Notes the step that was chosen for a scene, as if it had been given.
template <class M>
void keep_automatic_step(RunRequest& request, const BuiltScene<M>& built) {
    if (!request.scene.step.automatic) return;
    request.scene.step.h = built.settings.h;
    request.so_far.h = {built.settings.h};
}

// The two walls across an axis, by number; -1 of none.
struct OppositeWalls {
    int low = -1, high = -1;
    bool both() const { return low >= 0 && high >= 0; }
};
template <class M>
std::array<OppositeWalls, M::dim> opposite_walls(std::span<const Wall<M>> walls) {
    std::array<OppositeWalls, M::dim> pairs;
    for (std::size_t w = 0; w < walls.size(); ++w)
        for (int d = 0; d < M::dim; ++d) {
            OppositeWalls& pair = pairs[static_cast<std::size_t>(d)];
            if (walls[w].normal[d] == 1) pair.low = static_cast<int>(w);
            if (walls[w].normal[d] == -1) pair.high = static_cast<int>(w);
        }
    return pairs;
}

// Side of the cell along each axis that repeats, else the distance between the two walls; 0 where there are not two.
template <class M>
typename M::Vec box_edges(const SimulationSettings<M>& settings) {
    const std::vector<Wall<M>>& walls = settings.walls;
    const auto pairs = opposite_walls<M>(walls);
    typename M::Vec edges = M::Vec::Zero();
    for (int d = 0; d < M::dim; ++d) {
        const OppositeWalls& pair = pairs[static_cast<std::size_t>(d)];
        if (settings.cell.periodic[static_cast<std::size_t>(d)])
            edges[d] = settings.cell.size[d];
        else if (pair.both())
            edges[d] =
                -walls[static_cast<std::size_t>(pair.high)].offset - walls[static_cast<std::size_t>(pair.low)].offset;
    }
    return edges;
}

// Forces of the walls under pressure for the box as it is now.
template <class M>
void push_walls(const Scene& scene, Simulation<M>& simulation) {
    const typename M::Vec edges = box_edges<M>(simulation.settings());
    const std::span<Wall<M>> walls = simulation.walls();
    for (std::size_t w = 0; w < walls.size(); ++w) {
        if (scene.walls[w].motion != WallMotion::Pressure) continue;
        double area = 1;
        for (int d = 0; d < M::dim; ++d)
            if (std::abs(walls[w].normal[d]) != 1) area *= edges[d];
        walls[w].force = scene.walls[w].pressure * area;
    }
}

}  // namespace nscdd
