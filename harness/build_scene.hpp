// From a scene and a packing or state, as read, to what the kernel steps.
#pragma once

#include "nscdd/partition/bisection.hpp"
#include "nscdd/partition/metis.hpp"
#include "nscdd/step/simulation.hpp"
#include "run.hpp"

namespace nscdd {

template <class M>
struct BuiltScene {
    std::vector<Grain<M>> grains;
    SimulationSettings<M> settings;
    std::vector<PairImpulse<M>> impulses;
    std::optional<RoughDetection<M>> rough;  // of a state to go on from
};

// The partitions that --partition offers: a line for each.
template <class M>
Partitioner<M> choose_partition(const RunRequest& request) {
    const double imbalance = request.imbalance;
    if (request.partition == "bisection") return by_bisection<M>(imbalance);
    if (request.partition == "metis") return by_metis<M>(imbalance);
    GridCells<M::dim> cells{};
    if (!request.grid.empty()) {
        if (request.grid.size() != M::dim) throw InputError("--grid needs " + std::to_string(M::dim) + " numbers");
        std::copy(request.grid.begin(), request.grid.end(), cells.begin());
    }
    return by_grid<M>(cells);
}

namespace build_detail {

template <class M>
std::vector<Grain<M>> scene_grains(const RunRequest& request) {
    const Scene& scene = request.scene;
    std::vector<Grain<M>> grains;
    const auto add = [&](double radius, int material, const typename M::Vec& position) -> Grain<M>& {
        const double density = scene.materials[static_cast<std::size_t>(material)].density;
        return grains.emplace_back(make_grain<M>(static_cast<int>(grains.size()), radius, density, position, material));
    };
    const State& from = request.from;
    const Packing& packing = from.packing.size() ? from.packing : request.packing;
    for (std::size_t g = 0; g < packing.size(); ++g) {
        const bool restart = from.packing.size() > 0;
        Grain<M>& grain = add(packing.radius[g], restart ? from.material[g] : scene.packing_material,
                              Eigen::Map<const typename M::Vec>(packing.x.data() + g * M::dim));
        if (!restart) continue;
        grain.velocity.template head<M::dim>() = Eigen::Map<const typename M::Vec>(from.velocity.data() + g * M::dim);
        if constexpr (M::friction)
            grain.velocity.template tail<M::spins>() =
                Eigen::Map<const typename M::Spin>(from.spin.data() + g * M::spins);
    }
    const std::size_t before =
        from.packing.size() ? grains.size() - std::min(grains.size(), scene.grains.size()) : grains.size();
    for (std::size_t k = 0; k < scene.grains.size(); ++k) {  // a state has them already, but for their loads
        const SceneGrain& single = scene.grains[k];
        Grain<M>& grain =
            from.packing.size() ? grains.at(before + k) : add(single.radius, single.material, single.position);
        grain.load.template head<M::dim>() = single.force;
        if constexpr (M::friction) grain.load.template tail<M::spins>() = single.torque;
        if (from.packing.size()) continue;
        grain.velocity.template head<M::dim>() = single.velocity;
        if constexpr (M::friction) grain.velocity.template tail<M::spins>() = single.spin;
    }
    return grains;
}

}  // namespace build_detail

// What this process passes of the scene: grains and contacts by their rows in the files.
template <class M>
void keep_slice(BuiltScene<M>& built, int process, int processes) {
    const auto keep = [process, processes](auto& rows) {
        const std::size_t n = rows.size(), p = static_cast<std::size_t>(process),
                          all = static_cast<std::size_t>(processes);
        rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(n * (p + 1) / all), rows.end());
        rows.erase(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(n * p / all));
    };
    keep(built.grains);
    keep(built.impulses);
    if (built.rough) keep(built.rough->positions);
}

// Throws InputError for what only shows once scene and packing meet.
template <class M>
BuiltScene<M> build_scene(const RunRequest& request) {
    const Scene& scene = request.scene;
    BuiltScene<M> built{build_detail::scene_grains<M>(request), {}, {}, {}};
    if (built.grains.empty())
        throw InputError(scene.file + ": no grains: give a [packing], [[grain]]s, or --packing FILE");
    double mass = 0;
    for (const auto& g : built.grains) mass += g.mass;

    SimulationSettings<M>& settings = built.settings;
    settings.h = scene.step.h;
    settings.theta = scene.step.theta;
    settings.rough_every = scene.step.rough_every;
    settings.gravity = scene.gravity;
    settings.materials = Materials(static_cast<int>(scene.materials.size()));
    for (const auto& pair : scene.pairs) settings.materials.set(pair.a, pair.b, {pair.friction, pair.restitution});
    settings.partition = choose_partition<M>(request);
    const State& from = request.from;
    for (std::size_t w = 0; w < scene.walls.size(); ++w) {
        const SceneWall& source = scene.walls[w];
        Wall<M>& wall = settings.walls.emplace_back();
        wall.material = source.material;
        wall.normal = source.normal;
        wall.driven = source.motion == WallMotion::Force || source.motion == WallMotion::Pressure;
        wall.velocity = source.velocity;
        if (wall.driven) {
            wall.velocity -= wall.velocity.dot(wall.normal) * wall.normal;
            wall.mass = source.mass.value_or(mass);
            wall.force = source.force;
        }
        if (from.packing.size()) {
            wall.offset = from.walls.offset[w];
            if (wall.driven) wall.speed = from.walls.normal_speed[w];
        } else {
            wall.offset = wall.normal.dot(typename M::Vec(wall_point(scene, source, request.packing.box)));
        }
    }
    for (std::size_t c = 0; c < from.contacts.i.size(); ++c) {
        const typename M::Vec impulse = Eigen::Map<const typename M::Vec>(from.contacts.impulse.data() + c * M::dim);
        if constexpr (M::friction)
            built.impulses.push_back({from.contacts.i[c], from.contacts.j[c], impulse});
        else
            built.impulses.push_back(
                {from.contacts.i[c], from.contacts.j[c], typename M::Impulse{from.contacts.normal_impulse[c]}});
    }
    if (from.packing.size()) {
        RoughDetection<M>& rough = built.rough.emplace();
        rough.kind = from.rough.kind;
        rough.partition = from.rough.partition;
        rough.imbalance = from.rough.imbalance;
        rough.skin = from.rough.skin;
        rough.steps_since = from.rough.steps_since;
        for (std::size_t g = 0; g < from.packing.size(); ++g)
            rough.positions.emplace_back(Eigen::Map<const typename M::Vec>(from.rough.x.data() + g * M::dim));
        rough.offsets = from.rough.offset;
    }
    return built;
}

// Distance between the two walls of each axis; 0 where there are not two.
template <class M>
typename M::Vec box_edges(std::span<const Wall<M>> walls) {
    typename M::Vec low = M::Vec::Constant(NAN), high = low, edges;
    for (const auto& wall : walls)
        for (int d = 0; d < M::dim; ++d) {
            if (wall.normal[d] == 1) low[d] = wall.offset;
            if (wall.normal[d] == -1) high[d] = -wall.offset;
        }
    for (int d = 0; d < M::dim; ++d) edges[d] = std::isnan(high[d] - low[d]) ? 0 : high[d] - low[d];
    return edges;
}

// Forces of the walls under pressure for the box as it is now.
template <class M>
void push_walls(const Scene& scene, std::span<Wall<M>> walls) {
    const typename M::Vec edges = box_edges<M>(walls);
    for (std::size_t w = 0; w < walls.size(); ++w) {
        if (scene.walls[w].motion != WallMotion::Pressure) continue;
        double area = 1;
        for (int d = 0; d < M::dim; ++d)
            if (std::abs(walls[w].normal[d]) != 1) area *= edges[d];
        walls[w].force = scene.walls[w].pressure * area;
    }
}

}  // namespace nscdd
