#include "model/notes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <thread>

#include "nscdd/comm/allowed_cores.hpp"

namespace nscdd {
namespace {

// The materials that can touch and have no [[pair]], as a line; empty where there are none.
std::string unpaired(const Scene& scene, const std::vector<double>& grains_of) {
    std::set<std::pair<int, int>> paired;
    for (const ScenePair& pair : scene.pairs) paired.insert({pair.a, pair.b});
    std::set<int> of_walls;
    for (const SceneWall& wall : scene.walls) of_walls.insert(wall.material);
    for (const SceneObstacle& obstacle : scene.obstacles) of_walls.insert(obstacle.material);

    const int shown = 3, materials = static_cast<int>(scene.materials.size());
    int count = 0;
    std::string names;
    for (int a = 0; a < materials; ++a)
        for (int b = a; b < materials; ++b) {
            const double mine = grains_of[static_cast<std::size_t>(a)], theirs = grains_of[static_cast<std::size_t>(b)];
            const bool grains = a == b ? mine > 1 : mine > 0 && theirs > 0;
            const bool wall = (mine > 0 && of_walls.contains(b)) || (theirs > 0 && of_walls.contains(a));
            if (paired.contains({a, b}) || !(grains || wall) || count++ >= shown) continue;
            names +=
                fmt::format("{}'{}'-'{}'", names.empty() ? "" : ", ", scene.materials[static_cast<std::size_t>(a)].name,
                            scene.materials[static_cast<std::size_t>(b)].name);
        }
    if (count == 0) return "";
    if (count > shown) names += fmt::format(" and {} more", count - shown);
    return fmt::format("{}: no [[pair]] of {}, which can touch: friction and restitution are 0 there", scene.file,
                       names);
}

// Names of fixed walls behind which the whole box of an [[insert]] lies.
std::vector<std::string> walls_before_insertions(const RunRequest& request) {
    std::vector<std::string> names;
    if (request.goes_on()) return names;
    for (const SceneInsertion& insertion : request.scene.exchange.insertions)
        for (const SceneWall& wall : request.scene.walls) {
            const Eigen::VectorXd point = wall_point(request.scene, wall, request.box),
                                  farthest = (wall.normal.array() > 0).select(insertion.box.high, insertion.box.low);
            if (wall.motion == WallMotion::Fixed && wall.normal.dot(farthest - point) <= 0) names.push_back(wall.name);
        }
    return names;
}

}  // namespace

std::vector<std::string> notes(const RunRequest& request, const std::vector<double>& grains_of) {
    const Scene& scene = request.scene;
    std::vector<std::string> lines;
    if (const std::string line = unpaired(scene, grains_of); !line.empty()) lines.push_back(line);
    if (scene.step.automatic)
        lines.push_back(fmt::format(
            "{}: h = {:g} s by \"auto\": the smallest grain moves by {:g} % of its radius in a step{}, or less",
            scene.file, scene.step.h, 100 * scene.automatic_way(), scene.rebounds() ? " where grains rebound" : ""));
    if (!scene.gravity.isZero(0) && scene.exchange.removals.empty() && scene.obstacles.empty() &&
        std::ranges::none_of(scene.walls, [&](const SceneWall& wall) { return wall.normal.dot(scene.gravity) < 0; }))
        lines.push_back(
            fmt::format("{}: gravity, and no [[wall]] faces it: nothing but friction stops a fall", scene.file));
    for (const std::string& wall : walls_before_insertions(request))
        lines.push_back(fmt::format("{}: an [[insert]] lies behind wall '{}': no grain of it comes", scene.file, wall));
    for (std::size_t axis = 0; axis < request.packing.periodic.size(); ++axis)
        if (request.packing.periodic[axis] && std::ranges::count(scene.cell.axes, static_cast<int>(axis)) == 0)
            lines.push_back(
                fmt::format("{}: the packing repeats along {}, and no [cell] does: its sides are free there",
                            scene.file, "xyz"[axis]));
    if (request.undivided)
        lines.push_back(
            fmt::format("--scheme {} without -n: one subdomain, so nothing is decomposed", *request.scheme));
    if (const int cores = detail::allowed_cores(); cores > 0 && request.threads.value_or(1) > cores) {
        const bool bound = request.over_mpi && cores < static_cast<int>(std::thread::hardware_concurrency());
        lines.push_back(fmt::format(
            "--threads {}: this process may use {} core{}, and more threads than cores are slower{}", *request.threads,
            cores, cores == 1 ? "" : "s", bound ? ": mpirun --bind-to none lets it use all" : ""));
    }
    if (request.thread_a_core && request.over_mpi)
        lines.emplace_back("--threads auto is one over MPI: give the number of threads of a process");
    if (!Packet::fuses)
        lines.push_back("this program has no fused products: last digits and counts are not those of other machines");
    return lines;
}

}  // namespace nscdd
