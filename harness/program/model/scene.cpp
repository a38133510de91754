#include "model/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "model/resolved.hpp"
#include "model/scene_table.hpp"
#include "registry/laws.hpp"

namespace nscdd {
namespace {

constexpr std::size_t most_materials = 1000;
constexpr double unit_tolerance = 1e-9;  // on |n| - 1, and on a tangential velocity's normal part

// x-, x+, y-, ... : index = 2 axis + upper
std::vector<std::string> side_names(int dimension) {
    const std::vector<std::string> all{"x-", "x+", "y-", "y+", "z-", "z+"};
    return {all.begin(), all.begin() + 2 * dimension};
}

std::string side_name(const WallSide& side) {
    return side_names(3)[static_cast<std::size_t>(2 * side.axis + (side.upper ? 1 : 0))];
}

class SceneReader {
  public:
    SceneReader(toml::table root, const std::string& file) : root_(std::move(root)), top_(root_, file, "") {
        scene_.file = file;
    }

    Scene read() {
        // Unknown ones first: [[materials]] is a slip, not a scene without a material.
        for (const char* key : {"name", "dimension", "gravity", "law", "material", "pair", "packing", "grain", "fix",
                                "insert", "remove", "cell", "wall", "obstacle", "step", "stop", "solver"})
            top_.has(key);
        top_.finish([](std::string_view key) {
            const bool packs = key == "grains" || key == "radius" || key == "solid_fraction" || key == "generator";
            return packs ? "a specification, of which `nscdd pack` makes a packing" : "";
        });
        scene_.name = top_.text("name");
        dim_ = top_.integer("dimension", detail::OptionRange{2});
        if (dim_ > 3) top_.fail("dimension", fmt::format("must be 2 or 3, found {}", dim_));
        scene_.dimension = dim_;
        scene_.gravity = top_.vector("gravity", dim_, zero());
        const bool law_given = top_.has("law");
        const std::vector<std::string> laws = law_names();
        scene_.law = law_given ? laws[static_cast<std::size_t>(top_.choice("law", laws))] : "coulomb";

        std::vector<TomlTable> materials = top_.tables("material");
        if (materials.size() > most_materials)  // each pair of them has a place in a table
            top_.fail("material",
                      fmt::format("must be given {} times at most, found {}", most_materials, materials.size()));
        for (TomlTable& table : materials) read_material(table);
        if (scene_.materials.empty()) top_.fail("", "no [[material]]");
        for (TomlTable& table : top_.tables("pair")) read_pair(table);
        if (auto table = top_.table("packing")) read_packing_source(*table);
        for (TomlTable& table : top_.tables("grain")) read_grain(table);
        if (auto table = top_.table("cell")) read_cell(*table);
        for (TomlTable& table : top_.tables("fix")) {
            scene_.fixed.push_back(read_region(table, dim_));
            table.finish();
        }
        std::vector<TomlTable> walls = top_.tables("wall");
        for (TomlTable& table : walls) read_wall(table);
        for (std::size_t w = 0; w < walls.size(); ++w)
            if (scene_.walls[w].motion == WallMotion::Pressure) require_closed_box(walls[w]);

        for (TomlTable& table : top_.tables("remove")) {
            scene_.exchange.removals.push_back(read_removal(table, dim_));
            require_open(table);
        }
        for (TomlTable& table : top_.tables("insert")) {
            const int of = material(table);
            scene_.exchange.insertions.push_back(read_insertion(table, dim_));
            scene_.exchange.insertions.back().material = of;
            require_open(table);
        }
        std::vector<TomlTable> obstacles = top_.tables("obstacle");
        for (TomlTable& table : obstacles) read_obstacle_of(table);

        auto step = top_.table("step");
        if (!step) top_.fail("", "no [step]");
        read_step(*step);
        require_resolved(scene_, walls, obstacles);
        if (auto table = top_.table("stop")) {
            scene_.stop = read_stop(*table);
            if (scene_.stop.strain && !has_edges())
                table->fail("strain", "needs a [cell], or two walls that face each other along an axis");
        }
        if (auto table = top_.table("solver")) {
            scene_.solver = read_solve_settings(*table);
            table->finish();
        }
        if (!law_given && !needs_friction()) scene_.law = "frictionless";
        return std::move(scene_);
    }

  private:
    Eigen::VectorXd zero() const { return Eigen::VectorXd::Zero(dim_); }
    int spins() const { return dim_ == 3 ? 3 : 1; }

    bool needs_friction() const {
        for (const ScenePair& pair : scene_.pairs)
            for (const auto& [key, value] : pair.coefficients)
                if (value > 0) return true;
        if (!scene_.cell.gradient.empty() || !scene_.cell.stress.empty()) return true;
        // A grain with a spin or a torque needs the model with spins.
        for (const SceneGrain& grain : scene_.grains)
            if (!grain.spin.isZero(0) || !grain.torque.isZero(0)) return true;
        return false;
    }

    int material(const TomlTable& table, std::string_view key, const std::string& name) const {
        const auto& all = scene_.materials;
        const auto found = std::find_if(all.begin(), all.end(), [&](const auto& m) { return m.name == name; });
        if (found == all.end()) table.fail(key, fmt::format("'{}' is not a [[material]]", name));
        return static_cast<int>(found - all.begin());
    }

    int material(TomlTable& table) const {
        const std::string name = table.text("material");
        return material(table, "material", name);
    }

    void read_material(TomlTable& table) {
        SceneMaterial material{.name = table.text("name"), .density = table.number("density", positive)};
        for (const SceneMaterial& other : scene_.materials)
            if (other.name == material.name) table.fail("name", "is given twice");
        scene_.materials.push_back(std::move(material));
        table.finish();
    }

    void read_pair(TomlTable& table) {
        const std::vector<std::string> names = table.texts("materials", 2, 2);
        table.name_thing(fmt::format("pair '{}'-'{}'", names[0], names[1]));
        const auto [a, b] =
            std::minmax({material(table, "materials", names[0]), material(table, "materials", names[1])});
        if (!paired_.insert({a, b}).second) table.fail("", "is given twice");
        ScenePair& pair = scene_.pairs.emplace_back();
        pair.a = a;
        pair.b = b;
        pair.restitution = table.number("restitution", unit_interval, 0.0);
        visit_law(scene_.law, [&](const auto& law) {
            for (const auto& key : law.keys) pair.coefficients[key.name] = table.number(key.name, non_negative, 0.0);
        });
        if (const char* fault = pairing_fault(scene_.law, pair.restitution, pair.coefficients)) table.fail("", fault);
        table.finish([this](std::string_view key) {
            const std::vector<std::string> laws = laws_with_key(key);
            return laws.empty()
                       ? ""
                       : fmt::format("law = \"{}\", and the law is \"{}\"", fmt::join(laws, "\" or \""), scene_.law);
        });
    }

    void read_packing_source(TomlTable& table) {
        scene_.packing_file = (std::filesystem::path(scene_.file).parent_path() / table.text("file")).string();
        MaterialMix& mix = scene_.packing_mix;
        if (table.has("materials")) {
            for (const std::string& name : table.texts("materials", 1, static_cast<int>(most_materials)))
                mix.materials.push_back(material(table, "materials", name));
            mix.fractions = read_fractions(table, mix.materials.size());
            mix.seed = table.integer("seed", detail::OptionRange{0}, 1);
            if (table.has("material")) table.fail("material", "is given, and materials too");
            scene_.packing_material = mix.materials[0];
        } else if (table.has("material")) {
            scene_.packing_material = material(table);
        }
        for (TomlTable& part : table.tables("region")) {
            const int of = material(part);
            mix.parts.push_back({read_region(part, dim_), of});
            part.finish();
        }
        table.finish();
    }

    void read_grain(TomlTable& table) {
        const Eigen::VectorXd no_spin = Eigen::VectorXd::Zero(spins());
        const bool turns = law_has_friction(scene_.law), fixed = table.flag("fixed");
        for (const char* key : {"velocity", "spin", "force", "torque"})
            if (fixed && table.has(key)) table.fail(key, "is that of a grain that is fixed");
        scene_.grains.push_back({.position = table.vector("position", dim_),
                                 .velocity = table.vector("velocity", dim_, zero()),
                                 .spin = turns ? table.vector("spin", spins(), no_spin) : no_spin,
                                 .force = table.vector("force", dim_, zero()),
                                 .torque = turns ? table.vector("torque", spins(), no_spin) : no_spin,
                                 .radius = table.number("radius", positive),
                                 .material = material(table),
                                 .fixed = fixed});
        table.finish();
    }

    // Requires that nothing hangs on which grains there were at the start, as a state does not tell them.
    void require_open(const TomlTable& table) const {
        const bool loaded = std::ranges::any_of(
            scene_.grains, [](const SceneGrain& g) { return !g.force.isZero(0) || !g.torque.isZero(0); });
        if (loaded) table.fail("", "is not for scenes in which a [[grain]] has a force or a torque");
        if (!scene_.cell.gradient.empty() || !scene_.cell.stress.empty())
            table.fail("", "is not for a [cell] with a gradient or a stress");
        for (const SceneWall& wall : scene_.walls)
            if (wall.driven() && !wall.mass)
                table.fail("", fmt::format("needs the mass of wall '{}': that of all grains changes", wall.name));
    }

    void read_cell(TomlTable& table) {
        scene_.cell.axes = table.axes("periodic", dim_);
        if (table.has("size")) {
            scene_.cell.size = table.vector("size", static_cast<int>(scene_.cell.axes.size()));
            if (scene_.cell.size.minCoeff() <= 0) table.fail("size", "must be positive");
        }
        if (table.has("gradient")) read_gradient(table);
        if (auto stress = table.table("stress")) read_stress(*stress);
        if (table.has("mass")) {
            if (scene_.cell.stress.empty()) table.fail("mass", "is that of sides that a stress drives: give stress");
            scene_.cell.mass = table.number("mass", positive);
        }
        if (!law_has_friction(scene_.law) && (!scene_.cell.gradient.empty() || !scene_.cell.stress.empty()))
            table.fail("", "a gradient or a stress needs law = \"coulomb\", with friction 0 if there is none");
        table.finish();
    }

    bool periodic(int axis) const { return std::ranges::count(scene_.cell.axes, axis) > 0; }

    void read_gradient(TomlTable& table) {
        scene_.cell.gradient = table.rows("gradient", dim_, dim_);
        for (int row = 0; row < dim_; ++row)
            for (int axis = 0; axis < dim_; ++axis) {
                if (scene_.cell.gradient[static_cast<std::size_t>(row)][axis] == 0) continue;
                if (row > axis) table.fail("gradient", "must be 0 below the diagonal");
                if (!periodic(row) || !periodic(axis))
                    table.fail("gradient", "must be 0 for axes that are not periodic");
            }
    }

    void read_stress(TomlTable& table) {
        for (int axis = 0; axis < dim_; ++axis) {
            const std::string name(1, "xyz"[axis]);
            if (!table.has(name)) continue;
            scene_.cell.stress[axis] = table.number(name, positive);
            const auto& gradient = scene_.cell.gradient;
            if (!gradient.empty() && gradient[static_cast<std::size_t>(axis)][axis] != 0)
                table.fail(name, "is driven by a stress and by the gradient");
        }
        table.finish();
        if (scene_.cell.stress.empty()) table.fail("", "names no axis");
        if (static_cast<int>(scene_.cell.axes.size()) < dim_)
            table.fail("", "needs a cell that is periodic along all axes");
    }

    void read_wall(TomlTable& table) {
        SceneWall wall;
        wall.name = table.text("name");
        read_plane(table, wall);
        for (const int axis : scene_.cell.axes)
            if (wall.normal[axis] != 0)
                table.fail("", fmt::format("crosses the cell, which is periodic along {}", "xyz"[axis]));
        wall.material = material(table);
        read_motion(table, wall);
        table.finish();
        for (const SceneWall& other : scene_.walls) {
            if (other.name == wall.name) table.fail("name", "is given twice");
            if (other.side && wall.side && side_name(*other.side) == side_name(*wall.side))
                table.fail("side", fmt::format("'{}' is taken by wall '{}'", side_name(*wall.side), other.name));
        }
        scene_.walls.push_back(std::move(wall));
    }

    void read_obstacle_of(TomlTable& table) {
        const std::string name = table.text("name");
        SceneObstacle obstacle = read_obstacle(table, dim_, scene_.file);
        obstacle.name = name;
        obstacle.material = material(table);
        table.finish();
        if (!scene_.cell.gradient.empty() || !scene_.cell.stress.empty())
            table.fail("", "there are no obstacles in a cell with a gradient or a stress");
        const auto named = [&](const auto& thing) { return thing.name == obstacle.name; };
        if (std::ranges::any_of(scene_.walls, named) || std::ranges::any_of(scene_.obstacles, named))
            table.fail("name", "is given twice");
        scene_.obstacles.push_back(std::move(obstacle));
    }

    void read_plane(TomlTable& table, SceneWall& wall) {
        if (table.has("side")) {
            const int index = table.choice("side", side_names(dim_));
            wall.side = WallSide{.axis = index / 2, .upper = index % 2 == 1};
            wall.normal = (wall.side->upper ? -1.0 : 1.0) * Eigen::VectorXd::Unit(dim_, wall.side->axis);
            return;
        }
        if (!table.has("normal")) table.fail("", "needs side, or normal and through");
        wall.normal = table.vector("normal", dim_);
        const double length = wall.normal.norm();
        if (!(std::abs(length - 1) <= unit_tolerance))
            table.fail("normal", fmt::format("must have length 1, found {}", length));
        wall.through = table.vector("through", dim_);
    }

    void read_motion(TomlTable& table, SceneWall& wall) {
        wall.motion = static_cast<WallMotion>(
            table.choice("motion", {"fixed", "velocity", "force", "pressure", "oscillating", "table"}));
        wall.velocity = zero();
        if (wall.motion == WallMotion::Fixed) return;
        if (wall.motion == WallMotion::Velocity) {
            wall.velocity = table.vector("velocity", dim_);
            return;
        }
        if (wall.motion == WallMotion::Oscillating) {
            wall.path = read_oscillation(table, dim_, wall.normal);
            return;
        }
        if (wall.motion == WallMotion::Table) {
            wall.path = read_path_table(table, dim_, scene_.file);
            return;
        }
        if (wall.motion == WallMotion::Force)
            wall.force = table.number("force", any_number);
        else
            wall.pressure = table.number("pressure", any_number);
        if (table.has("mass")) wall.mass = table.number("mass", positive);
        wall.velocity = table.vector("velocity", dim_, zero());
        if (std::abs(wall.velocity.dot(wall.normal)) > unit_tolerance * wall.velocity.norm())
            table.fail("velocity", "must be tangential: along the normal the wall is pushed");
    }

    // Requires walls on all sides, as only then the area of a face is known.
    void require_closed_box(const TomlTable& table) const {
        for (const std::string& name : side_names(dim_)) {
            const auto& all = scene_.walls;
            if (std::ranges::count(scene_.cell.axes, name[0] - 'x') > 0) continue;
            if (std::none_of(all.begin(), all.end(),
                             [&](const auto& w) { return w.side && side_name(*w.side) == name; }))
                table.fail("", fmt::format("pressure needs a wall on every side of the box, found none on '{}'", name));
        }
    }

    // Whether there is a length that a strain is of.
    bool has_edges() const {
        if (!scene_.cell.axes.empty()) return true;
        const auto faces = [this](int axis, double way) {
            return std::ranges::any_of(scene_.walls, [=](const SceneWall& wall) { return wall.normal[axis] == way; });
        };
        for (int axis = 0; axis < dim_; ++axis)
            if (faces(axis, 1) && faces(axis, -1)) return true;
        return false;
    }

    void read_step(TomlTable& table) {
        visit_step(scene_.step, [this, &table](const detail::OptionInfo& info, auto& value) {
            using Value = std::remove_reference_t<decltype(value)>;
            const bool left_out = info.name == std::string_view("count");  // --steps may be given in its place
            const auto otherwise = left_out || info.range.holds(value) ? std::optional<Value>(value) : std::nullopt;
            const std::string_view key = table.key_of(info.name, earlier_name(info.name));
            if (key == "h" && table.is_text(key)) {
                if (table.text(key) != "auto") table.fail(std::string(key), "must be a number [s] or \"auto\"");
                scene_.step.automatic = true;
                return;
            }
            if constexpr (std::is_same_v<Value, int>)
                value = table.integer(key, info.range, otherwise);
            else
                value = table.number(key, info.range, otherwise);
        });
        table.finish();
    }

    toml::table root_;
    TomlTable top_;
    Scene scene_;
    std::set<std::pair<int, int>> paired_;
    int dim_ = 0;
};

}  // namespace

Scene read_scene(const std::string& path) { return SceneReader(parse_toml(path), path).read(); }
Scene scene_of(toml::table table, const std::string& name) { return SceneReader(std::move(table), name).read(); }

Eigen::VectorXd wall_point(const Scene& scene, const SceneWall& wall, const std::vector<double>& box) {
    if (!wall.side) return wall.through;
    if (box.size() != static_cast<std::size_t>(scene.dimension))
        throw InputError(fmt::format("{}: wall '{}': side '{}' needs the box of a {}D packing, found {}", scene.file,
                                     wall.name, side_name(*wall.side), scene.dimension,
                                     box.empty() ? "none" : fmt::format("one in {}D", box.size())));
    Eigen::VectorXd point = Eigen::VectorXd::Zero(scene.dimension);
    if (wall.side->upper) point[wall.side->axis] = box[static_cast<std::size_t>(wall.side->axis)];
    return point;
}

double cell_side(const Scene& scene, std::size_t k, const std::vector<double>& box) {
    if (scene.cell.size.size() > 0) return scene.cell.size[static_cast<Eigen::Index>(k)];
    if (box.size() != static_cast<std::size_t>(scene.dimension))
        throw InputError(
            fmt::format("{}: cell: needs size, or a {}D packing whose box it takes", scene.file, scene.dimension));
    return box[static_cast<std::size_t>(scene.cell.axes[k])];
}

}  // namespace nscdd
