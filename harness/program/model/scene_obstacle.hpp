// Obstacles as the user writes them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "model/scene_motion.hpp"

namespace nscdd {

struct SceneCylinder {             // a circle in 2D
    Eigen::VectorXd centre, axis;  // (dim) [m], (dim) unit
    double radius = 0;             // [m], > 0
    std::optional<double> length;  // [m], > 0; without ends unless it is given
};

struct SceneTurn {
    Eigen::VectorXd centre, axis;  // (dim) [m], (dim) unit
    double rate = 0;               // [rad/s]; 0: it does not turn
};

struct SceneObstacle {
    std::string name;
    int material = 0;                                  // index into Scene::materials
    std::vector<std::vector<Eigen::VectorXd>> facets;  // of dim corners each, (dim) [m]
    std::optional<SceneCylinder> cylinder;             // in place of facets
    std::string file;                                  // that facets were read from; empty of others
    ScenePath path;
    SceneTurn turn;
};

// All keys of an [[obstacle]] but its name and material. Throws InputError, "file:line: thing: problem".
SceneObstacle read_obstacle(TomlTable& table, int dim, const std::string& scene_file);

}  // namespace nscdd
