#include "model/scene_obstacle.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <cmath>
#include <filesystem>

#include "files/ranges.hpp"
#include "files/stl.hpp"

namespace nscdd {
namespace {

Eigen::VectorXd unit(TomlTable& table, const char* key, int dim, const Eigen::VectorXd& otherwise) {
    const Eigen::VectorXd direction = otherwise.size() > 0 ? table.vector(key, dim, otherwise) : table.vector(key, dim);
    if (!(direction.norm() > 0)) table.fail(key, "must not be 0");
    return direction.normalized();
}

// Faces become triangles from their first corner on, which fill a flat convex one and no other.
void check_face(const std::vector<Eigen::Vector3d>& corners, std::size_t number, const TomlTable& table) {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // times twice the area
    const std::size_t count = corners.size();
    for (std::size_t k = 1; k + 1 < count; ++k) normal += (corners[k] - corners[0]).cross(corners[k + 1] - corners[0]);
    const double area = normal.norm();
    for (std::size_t k = 0; k < count; ++k) {
        const Eigen::Vector3d &a = corners[k], &b = corners[(k + 1) % count], &c = corners[(k + 2) % count];
        if (std::abs(normal.dot(b - corners[0])) > 1e-6 * area * std::sqrt(area))
            table.fail("faces", fmt::format("must be flat and convex: face {} is not flat, give triangles", number));
        const bool fills = k == 0 || k + 1 == count || (a - corners[0]).cross(b - corners[0]).dot(normal) > 0;
        if (!fills || (b - a).cross(c - b).dot(normal) < -1e-9 * area * area)
            table.fail("faces", fmt::format("must be flat and convex: face {} is not convex, give triangles", number));
    }
}

// A line from point to point (2D), or faces that name their corners (3D): those of more than three become triangles.
void read_points(TomlTable& table, int dim, SceneObstacle& obstacle) {
    const std::vector<Eigen::VectorXd> points = table.points("points", dim, 2);
    const std::size_t count = points.size();
    if (dim == 2) {
        for (std::size_t k = 0; k + 1 < count; ++k) obstacle.facets.push_back({points[k], points[k + 1]});
        if (table.flag("closed", false)) obstacle.facets.push_back({points.back(), points.front()});
        return;
    }
    std::size_t number = 0;
    for (const std::vector<int>& face : table.index_lists("faces", 3, static_cast<int>(count))) {
        std::vector<Eigen::Vector3d> corners;
        for (const int corner : face) corners.emplace_back(points[static_cast<std::size_t>(corner)]);
        check_face(corners, number++, table);
        for (std::size_t k = 1; k + 1 < corners.size(); ++k)
            obstacle.facets.push_back({corners[0], corners[k], corners[k + 1]});
    }
}

void read_file(TomlTable& table, int dim, const std::string& scene_file, SceneObstacle& obstacle) {
    if (dim != 3) table.fail("stl", "is for three dimensions: give points");
    obstacle.file = (std::filesystem::path(scene_file).parent_path() / table.text("stl")).string();
    const double scale = table.number("scale", positive, 1.0);
    const Eigen::VectorXd shift = table.vector("shift", 3, Eigen::VectorXd::Zero(3));
    for (const StlTriangle& triangle : read_stl(obstacle.file)) {
        auto& facet = obstacle.facets.emplace_back();
        for (const Eigen::Vector3d& corner : triangle) facet.emplace_back(scale * corner + shift);
    }
}

void read_cylinder(TomlTable& table, int dim, SceneObstacle& obstacle) {
    SceneCylinder& cylinder = obstacle.cylinder.emplace();
    cylinder.centre = table.vector("centre", dim);
    cylinder.axis = dim == 3 ? unit(table, "axis", 3, {}) : Eigen::VectorXd(Eigen::VectorXd::Unit(2, 1));
    cylinder.radius = table.number("radius", positive);
    if (dim == 3 && table.has("length")) cylinder.length = table.number("length", positive);
    table.finish();
}

void read_turn(TomlTable& table, int dim, SceneObstacle& obstacle) {
    const auto& cylinder = obstacle.cylinder;
    SceneTurn& turn = obstacle.turn;
    turn.rate = table.number("rate", any_number);
    if (turn.rate == 0) table.fail("rate", "must not be 0");
    turn.centre = cylinder ? table.vector("centre", dim, cylinder->centre) : table.vector("centre", dim);
    if (dim == 3) turn.axis = unit(table, "axis", 3, cylinder ? cylinder->axis : Eigen::VectorXd());
}

}  // namespace

SceneObstacle read_obstacle(TomlTable& table, int dim, const std::string& scene_file) {
    SceneObstacle obstacle;
    const int shapes = table.has("points") + table.has("stl") + table.has("cylinder");
    if (shapes != 1) table.fail("", "needs one of points, stl and cylinder");
    if (table.has("points")) read_points(table, dim, obstacle);
    if (table.has("stl")) read_file(table, dim, scene_file, obstacle);
    if (auto cylinder = table.table("cylinder")) read_cylinder(*cylinder, dim, obstacle);
    obstacle.turn.centre = Eigen::VectorXd::Zero(dim);
    obstacle.turn.axis = Eigen::VectorXd::Unit(dim, dim - 1);
    switch (table.choice("motion", {"fixed", "velocity", "oscillating", "table", "rotating"})) {
        case 0:
            break;
        case 1:
            obstacle.path.kind = ScenePath::Kind::Steady;
            obstacle.path.velocity = table.vector("velocity", dim);
            break;
        case 2:
            obstacle.path = read_oscillation(table, dim, {});
            break;
        case 3:
            obstacle.path = read_path_table(table, dim, scene_file);
            break;
        default:
            read_turn(table, dim, obstacle);
    }
    if (obstacle.turn.rate != 0 && obstacle.cylinder && dim == 3 && !obstacle.cylinder->length &&
        std::abs(obstacle.turn.axis.dot(obstacle.cylinder->axis)) < 1 - 1e-12)
        table.fail("axis", "must be that of the cylinder, which has no length");
    return obstacle;
}

}  // namespace nscdd
