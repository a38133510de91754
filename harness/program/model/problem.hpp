// What the steps of a run are asked to solve, whoever solves it: counted over all processes before the first step. And
// the checksum of what has come out.
#pragma once

#include <fmt/format.h>

#include <cstring>

#include "files/replace_file.hpp"
#include "model/build_scene.hpp"

namespace nscdd {

struct Problem {
    std::vector<double> grains_of;  // their number by material
    std::string
        checksum;  // of grains with their motion, walls, loads, coefficients, h and theta; of no solver, no rank
};

namespace problem_detail {

inline void add(std::string& bytes, double value) {
    char eight[sizeof value];
    std::memcpy(eight, &value, sizeof value);
    bytes.append(eight, sizeof value);
}
void add(std::string& bytes, const auto& values)
    requires requires { values.size(); }
{
    for (const double value : values) add(bytes, value);
}

inline void add_path(std::string& bytes, const ScenePath& path) {
    for (const double value : {path.frequency, path.phase}) add(bytes, value);
    add(bytes, path.velocity);
    add(bytes, path.amplitude);
    add(bytes, path.times);
    for (const Eigen::VectorXd& place : path.places) add(bytes, place);
}

// Adds up the checksums of items, modulo 2^64, so that their order does not count. Sums of 16 bits are exact.
constexpr std::size_t pieces = 4;
inline void add_item(std::span<double> sums, std::string_view bytes) {
    const std::uint64_t own = std::stoull(checksum(bytes), nullptr, 16);
    for (std::size_t k = 0; k < pieces; ++k) sums[k] += static_cast<double>(own >> (16 * k) & 0xffff);
}
inline std::uint64_t total(std::span<const double> sums) {
    std::uint64_t sum = 0;
    for (std::size_t k = 0; k < pieces; ++k) sum += static_cast<std::uint64_t>(sums[k]) << (16 * k);
    return sum;
}

}  // namespace problem_detail

// Collective; each process passes its share of the grains.
template <class M>
Problem problem_of(const BuiltScene<M>& built, const Scene& scene, Communicator& comm) {
    using problem_detail::add, problem_detail::add_path, problem_detail::pieces;
    const std::size_t materials = scene.materials.size();
    Buffer mine(materials + pieces);
    for (const Grain<M>& grain : built.grains) {
        ++mine[static_cast<std::size_t>(grain.material)];
        std::string bytes;
        for (const double value : {double(grain.id), double(grain.material), grain.radius, grain.mass})
            add(bytes, value);
        add(bytes, grain.position);
        add(bytes, grain.velocity);
        add(bytes, grain.load);
        problem_detail::add_item(std::span(mine).subspan(materials), bytes);
    }
    const std::span<const double> all = reduce(comm, mine.size(), [&](std::size_t k) {  //
        return k == 0 ? mine : Buffer(mine.size());
    });
    Problem problem;
    problem.grains_of.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(materials));
    const std::uint64_t sum = problem_detail::total(all.subspan(materials));
    for (const SceneInsertion& insertion : scene.exchange.insertions)  // those that will come can touch each other
        problem.grains_of[static_cast<std::size_t>(insertion.material)] += 2;

    const SimulationSettings<M>& settings = built.settings;
    std::string bytes = fmt::format("{} {:x}", M::Law::name, sum);
    for (const double value : {settings.h, settings.theta}) add(bytes, value);
    add(bytes, settings.gravity);
    for (int d = 0; d < M::dim; ++d)
        if (settings.cell.periodic[static_cast<std::size_t>(d)])
            for (const double value : {double(d), settings.cell.size[d]}) add(bytes, value);
    if (settings.cell.flows())
        for (const typename M::Gradient& matrix : {settings.cell.gradient, settings.cell.tilt})
            add(bytes, std::vector<double>(matrix.data(), matrix.data() + matrix.size()));
    if (settings.cell.any_driven()) {
        add(bytes, settings.cell.stress);
        add(bytes, std::vector<double>(settings.cell.driven.begin(), settings.cell.driven.end()));
        add(bytes, settings.cell.mass);
    }
    for (std::size_t w = 0; w < settings.walls.size(); ++w) {
        const Wall<M>& wall = settings.walls[w];
        for (const double value : {double(wall.material), wall.offset, wall.mass, wall.force, wall.speed,
                                   scene.walls[w].pressure, double(scene.walls[w].motion)})
            add(bytes, value);
        add(bytes, wall.normal);
        const ScenePath& path = scene.walls[w].path;
        if (path.kind == ScenePath::Kind::None)
            add(bytes, wall.velocity);
        else
            add_path(bytes, path);
    }
    for (const SceneObstacle& obstacle : scene.obstacles) {
        for (const auto& facet : obstacle.facets)
            for (const auto& corner : facet) add(bytes, corner);
        if (const auto& c = obstacle.cylinder) {
            add(bytes, c->centre);
            add(bytes, c->axis);
            for (const double value : {c->radius, c->length.value_or(0)}) add(bytes, value);
        }
        add_path(bytes, obstacle.path);
        add(bytes, obstacle.turn.centre);
        add(bytes, obstacle.turn.axis);
        for (const double value : {obstacle.turn.rate, double(obstacle.material)}) add(bytes, value);
    }
    for (const ScenePair& pair : scene.pairs) {
        if (pair.restitution == 0 &&
            std::ranges::all_of(pair.coefficients, [](const auto& c) { return c.second == 0; }))
            continue;  // as if it were not given
        bytes += fmt::format(" {} {} {}", pair.a, pair.b, pair.restitution);
        for (const auto& [key, value] : pair.coefficients) bytes += fmt::format(" {} {}", key, value);
    }
    bytes += scene.exchange.text();
    problem.checksum = checksum(bytes);
    return problem;
}

// Checksum of the answer to the last bit: positions and velocities of grains and driven walls, and impulses of
// contacts, whatever subdomains they are on. Collective.
template <class M>
std::string answer_checksum(const Simulation<M>& simulation) {
    using problem_detail::add;
    const std::span<const double> all = reduce(simulation.comm(), problem_detail::pieces, [&simulation](std::size_t k) {
        const auto& part = simulation.parts()[k];
        const auto id = [&part](int g) { return double(part.grains[static_cast<std::size_t>(g)].id); };
        Buffer mine(problem_detail::pieces);
        const auto add_item = [&mine](std::initializer_list<double> names, const auto&... values) {
            std::string bytes;
            for (const double name : names) add(bytes, name);
            (add(bytes, values), ...);
            problem_detail::add_item(mine, bytes);
        };
        for (std::size_t g = 0; g < part.grains.size(); ++g)
            if (part.primary(g)) add_item({id(static_cast<int>(g))}, part.grains[g].position, part.grains[g].velocity);
        for (const auto& c : part.problem.contacts) add_item({id(c.i), id(c.j)}, c.r);
        for (const auto& c : part.problem.wall_contacts)
            add_item({id(c.i), -1.0 - part.number_of(c, simulation.walls().size())}, c.r);
        return mine;
    });
    std::string bytes = fmt::format("{:x}", problem_detail::total(all));
    for (const Wall<M>& wall : simulation.walls())
        for (const double value : {wall.offset, wall.speed}) add(bytes, value);
    return checksum(bytes);
}

}  // namespace nscdd
