// A scene as the user writes it (TOML), checked and completed, before any choice of kernel template.
// Units are free but must be coherent; SI words are used here.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "files/error.hpp"
#include "files/ranges.hpp"
#include "model/exchange.hpp"
#include "model/material_mix.hpp"
#include "model/scene_obstacle.hpp"
#include "model/solve_settings.hpp"
#include "model/stop.hpp"

namespace nscdd {

struct SceneMaterial {
    std::string name;
    double density = 0;  // [kg/m^3] of spheres, [kg/m^2] of disks, > 0
};

struct ScenePair {                               // of materials not paired all are 0
    int a = 0, b = 0;                            // indices into Scene::materials, a <= b
    double restitution = 0;                      // Newton's, in [0, 1]
    std::map<std::string, double> coefficients;  // of the contact law, by the keys that it has, >= 0
};

struct SceneGrain {
    Eigen::VectorXd position;  // (dim) [m]
    Eigen::VectorXd velocity;  // (dim) [m/s]
    Eigen::VectorXd spin;      // (1 in 2D, 3 in 3D) [rad/s]
    Eigen::VectorXd force;     // (dim) [N] external, constant, besides gravity
    Eigen::VectorXd torque;    // (as spin) [N m]
    double radius = 0;         // [m], > 0
    int material = 0;          // index into Scene::materials
    bool fixed = false;        // nothing moves it
};

struct SceneCell {                          // the scene repeats; along no axis unless it is given
    std::vector<int> axes;                  // those that are periodic
    Eigen::VectorXd size;                   // sides along these axes [m], > 0; empty: of the packing's box
    std::vector<Eigen::VectorXd> gradient;  // of the flow, rows [1/s]; empty: none is prescribed
    std::map<int, double> stress;           // by axis, drives its side; positive in compression [Pa]
    std::optional<double> mass;  // [kg] of each side that a stress drives; default: 6 times the mass of the grains
};

enum class WallMotion { Fixed, Velocity, Force, Pressure, Oscillating, Table };

struct WallSide {  // a face of the packing's box
    int axis = 0;
    bool upper = false;
};

struct SceneWall {
    std::string name;
    Eigen::VectorXd normal;        // (dim) unit, into the sample
    std::optional<WallSide> side;  // given by a face of the box; else by `through`
    Eigen::VectorXd through;       // (dim) [m] a point of the plane; empty where `side` is given
    int material = 0;              // index into Scene::materials
    WallMotion motion = WallMotion::Fixed;
    ScenePath path;              // for Oscillating and Table
    Eigen::VectorXd velocity;    // (dim) [m/s] prescribed; its tangential part alone for Force and Pressure
    double force = 0;            // [N] for Force: along the normal, positive pushes into the sample
    double pressure = 0;         // [Pa] for Pressure: times the current area of the face
    std::optional<double> mass;  // [kg] for Force and Pressure; default: total mass of the grains

    bool driven() const { return motion == WallMotion::Force || motion == WallMotion::Pressure; }
};

struct StepSettings {
    static constexpr double way = 0.05, way_of_rebounds = 0.01;  // of the least radius, in an automatic step
    bool automatic = false;                                      // h is chosen
    double h = 0;
    int count = 0;
    double theta = 0.5;
    int broad_phase_every = 10;
};

// Calls each(info, value) for every key of [step]. A value that is out of its range has no default: it must be given,
// `count` here or as --steps.
void visit_step(auto& step, auto&& each) {
    each(detail::OptionInfo{"h", "s", "Time step", positive}, step.h);
    each(detail::OptionInfo{"count", "steps", "Steps to make", {1}}, step.count);
    each(detail::OptionInfo{"theta", "", "Of the Moreau-Jean scheme", unit_interval}, step.theta);
    each(
        detail::OptionInfo{
            "broad_phase_every", "steps", "Between broad phases; sooner where grains have moved too far", {1}},
        step.broad_phase_every);
}

struct Scene {
    std::string file;  // it was read from
    std::string name;
    int dimension = 0;        // 2 or 3
    std::string law;          // of registry/laws.hpp; unless it is given coulomb, or frictionless where that suffices
    Eigen::VectorXd gravity;  // (dim) [m/s^2]
    std::optional<std::string> packing_file;  // of [packing], beside the scene file
    int packing_material = 0;                 // of its grains; the first material unless it is given
    MaterialMix packing_mix;                  // materials of its grains, where there are several
    std::vector<SceneMaterial> materials;     // at least one
    std::vector<ScenePair> pairs;
    std::vector<SceneGrain> grains;  // may be empty: then a packing must come from elsewhere
    std::vector<Region> fixed;       // where grains are fixed, as they lie at the start
    SceneExchange exchange;
    std::vector<SceneWall> walls;
    std::vector<SceneObstacle> obstacles;
    SceneCell cell;
    StepSettings step;
    StopSettings stop;
    SolveSettings solver;

    bool rebounds() const {
        return std::ranges::any_of(pairs, [](const ScenePair& pair) { return pair.restitution > 0; });
    }
    double automatic_way() const { return rebounds() ? StepSettings::way_of_rebounds : StepSettings::way; }
};

// Throws InputError with one line, "file:line: thing: problem", for whatever cannot be meant: an unknown or missing
// key, a wrong type, length or value, an unknown material, a name given twice, a file that does not parse or open.
Scene read_scene(const std::string& path);

// A point of the wall's plane, the packing filling [0, box]. Throws InputError for a face of a box that is empty (no
// packing) or of another dimension.
Eigen::VectorXd wall_point(const Scene& scene, const SceneWall& wall, const std::vector<double>& box);

// Side of the cell along scene.cell.axes[k], the packing filling [0, box] [m]. Throws InputError where neither the cell
// nor a packing of the scene's dimension says it.
double cell_side(const Scene& scene, std::size_t k, const std::vector<double>& box);

}  // namespace nscdd
