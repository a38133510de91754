#include "model/same_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "registry/laws.hpp"

namespace nscdd {
namespace {

// Collects in words how a state differs from the scene. A process knows the differences of its own grains.
class Differences {
  public:
    void compare(const std::string& thing, const auto& in_state, const auto& in_scene) {
        if (in_state == in_scene) return;
        if (const int shown = 3; count_++ >= shown) return;
        text_ += fmt::format("{}{} is {} in the state, {} in the scene", text_.empty() ? "" : "; ", thing,
                             quoted(in_state), quoted(in_scene));
    }
    int count() const { return count_; }
    std::string text() const { return text_ + (count_ > 3 ? "; and more" : ""); }

  private:
    static std::string quoted(const std::string& name) { return "'" + name + "'"; }
    static std::string quoted(double value) { return fmt::format("{}", value); }
    static std::string quoted(const std::vector<double>& values) {
        return fmt::format("[{}]", fmt::join(values, ", "));
    }

    int count_ = 0;
    std::string text_;
};

}  // namespace

void fit_packing(Packing& packing, const std::string& packing_file, const Scene& scene) {
    if (packing.dim != scene.dimension)
        throw InputError(
            fmt::format("{}: {} dimensions, {} has {}", packing_file, packing.dim, scene.file, scene.dimension));
    const auto refuse = [&](const char* dataset, std::size_t row, const std::string& problem) {
        throw InputError(
            fmt::format("{}: dataset '{}': row {} {}", packing_file, dataset, packing.before + row, problem));
    };
    if (scene.packing_mix.any()) {
        if (!packing.material.empty())
            throw InputError(
                fmt::format("{}: the packing {} says of which material each grain is: [packing] cannot say it too",
                            scene.file, packing_file));
        deal_materials(packing, scene.packing_mix, scene.packing_material);
        packing.materials.clear();
    }
    const bool named = !packing.materials.empty();
    const std::size_t known = named ? packing.materials.size() : scene.materials.size();
    std::vector<int> of_scene;  // by material of the file; -1: not in the scene
    for (std::size_t m = 0; m < known; ++m) {
        const auto found = named ? std::ranges::find(scene.materials, packing.materials[m], &SceneMaterial::name)
                                 : scene.materials.begin() + static_cast<std::ptrdiff_t>(m);
        of_scene.push_back(found == scene.materials.end() ? -1 : static_cast<int>(found - scene.materials.begin()));
    }
    for (std::size_t g = 0; g < packing.material.size(); ++g) {
        int& material = packing.material[g];
        if (material < 0 || static_cast<std::size_t>(material) >= known)
            refuse("material", g,
                   fmt::format("must lie in [0, {}], the materials of {}, found {}", known - 1,
                               named ? "the file" : scene.file, material));
        const int mine = of_scene[static_cast<std::size_t>(material)];
        if (mine < 0)
            refuse("material", g,
                   fmt::format("is of '{}', which is not a [[material]] of {}",
                               packing.materials[static_cast<std::size_t>(material)], scene.file));
        material = mine;
    }
    const auto turning = std::ranges::find_if(packing.spin, [](double spin) { return spin != 0; });
    if (turning != packing.spin.end() && !law_has_friction(scene.law))
        refuse("spin", static_cast<std::size_t>(turning - packing.spin.begin()) / (scene.dimension == 3 ? 3 : 1),
               fmt::format("turns, which the law \"{}\" of {} does not see: give law = \"coulomb\"", scene.law,
                           scene.file));
}

void require_fitting_state(const State& state, const std::string& state_file, const Scene& scene) {
    const auto refuse = [&](const std::string& has, const std::string& wants) {
        throw InputError(fmt::format("{}: {}, {} {}", state_file, has, scene.file, wants));
    };
    const auto axes = [](std::vector<int> periodic) {
        std::string names;
        for (std::size_t axis = 0; axis < periodic.size(); ++axis)
            if (periodic[axis]) names += "xyz"[axis];
        return names.empty() ? "no periodic axis" : "the periodic axes " + names;
    };
    std::vector<int> periodic(3);
    for (const int axis : scene.cell.axes) periodic[static_cast<std::size_t>(axis)] = 1;
    if (axes(state.cell.periodic) != axes(periodic)) refuse(axes(state.cell.periodic), "has " + axes(periodic));
    if (!law_has_friction(scene.law) && std::ranges::any_of(state.spin, [](double spin) { return spin != 0; }))
        refuse("grains turn",
               fmt::format("has the law \"{}\", which does not see it: give law = \"coulomb\"", scene.law));
    const std::size_t n = state.packing.total(), w = state.walls.offset.size(), m = scene.materials.size();
    if (state.packing.dim != scene.dimension)
        refuse(fmt::format("{} dimensions", state.packing.dim), fmt::format("has {}", scene.dimension));
    if (w != scene.walls.size()) refuse(fmt::format("{} walls", w), fmt::format("has {}", scene.walls.size()));
    if (const std::size_t o = state.obstacles.name.size(); o != scene.obstacles.size())
        refuse(fmt::format("{} obstacles", o), fmt::format("has {}", scene.obstacles.size()));
    for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
        const SceneObstacle& obstacle = scene.obstacles[o];
        const std::size_t facets = obstacle.cylinder ? 1 : obstacle.facets.size();
        if (static_cast<std::size_t>(state.obstacles.facets[o]) != facets)
            refuse(fmt::format("{} facets of obstacle '{}'", state.obstacles.facets[o], state.obstacles.name[o]),
                   fmt::format("has {} of '{}'", facets, obstacle.name));
    }
    if (n < scene.grains.size() && !scene.exchange.any())
        refuse(fmt::format("{} grains", n), fmt::format("has {} besides those of a packing", scene.grains.size()));
    const auto worst = std::max_element(state.material.begin(), state.material.end());
    if (worst != state.material.end() && *worst >= static_cast<int>(m))
        refuse(fmt::format("grain {} is of material {}",
                           state.packing.before + static_cast<std::size_t>(worst - state.material.begin()), *worst + 1),
               fmt::format("has {}", m));
}

void adopt_state(State& state, const std::string& state_file, const Scene& scene) {
    // For each name of the state its row in the scene, -1 where the scene has none of that name.
    const auto rows_of = [](const std::vector<std::string>& names, const auto& things) {
        std::vector<int> rows;
        for (const std::string& name : names) {
            const auto found = std::ranges::find(things, name, [](const auto& thing) { return thing.name; });
            rows.push_back(found == things.end() ? -1 : static_cast<int>(found - things.begin()));
        }
        return rows;
    };
    const auto require_order = [&](const char* kind, const std::vector<int>& rows,
                                   const std::vector<std::string>& names) {
        for (std::size_t row = 0; row < rows.size(); ++row)
            if (rows[row] >= 0 && rows[row] != static_cast<int>(row))
                throw InputError(fmt::format("{}: {} '{}' is number {}, {} has it as number {}: give them in one order",
                                             state_file, kind, names[row], row + 1, scene.file, rows[row] + 1));
    };
    const std::vector<int> materials = rows_of(state.materials.name, scene.materials);
    if (std::ranges::find(materials, -1) == materials.end())
        for (int& material : state.material) material = materials.at(static_cast<std::size_t>(material));
    else
        require_order("material", materials, state.materials.name);
    require_order("wall", rows_of(state.walls.name, scene.walls), state.walls.name);
    require_order("obstacle", rows_of(state.obstacles.name, scene.obstacles), state.obstacles.name);
}

void require_same_scene(const State& state, const std::string& state_file, const Scene& scene, const Packing& packing) {
    Differences differences;
    differences.compare("the scene's name", state.scene, scene.name);
    const std::size_t materials = state.materials.name.size();
    differences.compare("the number of materials", double(materials), double(scene.materials.size()));
    for (std::size_t m = 0; m < std::min(materials, scene.materials.size()); ++m) {
        const std::string thing = fmt::format("material {}", m + 1);
        differences.compare(thing, state.materials.name[m], scene.materials[m].name);
        differences.compare("the density of " + thing, state.materials.density[m], scene.materials[m].density);
    }
    for (std::size_t w = 0; w < scene.walls.size(); ++w) {
        const SceneWall& wall = scene.walls[w];
        differences.compare(fmt::format("wall {}", w + 1), state.walls.name[w], wall.name);
        const auto normal = state.walls.normal.begin() + static_cast<std::ptrdiff_t>(w) * scene.dimension;
        differences.compare(fmt::format("the normal of wall '{}'", wall.name),
                            std::vector<double>(normal, normal + scene.dimension),
                            std::vector<double>(wall.normal.begin(), wall.normal.end()));
    }
    const std::size_t inserted = state.so_far.inserted.size(), removed = state.so_far.removed.size();
    differences.compare("the number of [[insert]]", double(inserted), double(scene.exchange.insertions.size()));
    differences.compare("the number of [[remove]]", double(removed), double(scene.exchange.removals.size()));
    for (std::size_t o = 0; o < scene.obstacles.size(); ++o)
        differences.compare(fmt::format("obstacle {}", o + 1), state.obstacles.name[o], scene.obstacles[o].name);
    // the scene's own grains come behind those of the packing
    const std::size_t n = state.packing.total(), own = scene.grains.size(), packed = n - own;
    if (!scene.exchange.any() && (packing.total() > 0 || !scene.packing_file))
        differences.compare("the number of grains", double(n), double(packing.total() + own));
    const auto compare = [&](std::size_t g, double radius, int material) {
        const std::size_t row = g - state.packing.before;
        differences.compare(fmt::format("the radius of grain {}", g), state.packing.radius[row], radius);
        differences.compare(fmt::format("the material of grain {}", g),
                            state.materials.name[static_cast<std::size_t>(state.material[row])],
                            scene.materials[static_cast<std::size_t>(material)].name);
    };
    const std::size_t begin = state.packing.before;
    const std::size_t end = scene.exchange.any() ? begin : begin + state.packing.size();
    for (std::size_t g = begin; g < end; ++g)
        if (g >= packed)
            compare(g, scene.grains[g - packed].radius, scene.grains[g - packed].material);
        else if (g - begin < packing.size())  // the same rows of both files
            compare(g, packing.radius[g - begin],
                    packing.material.empty() ? scene.packing_material : packing.material[g - begin]);
    if (differences.count() > 0)
        throw InputError(fmt::format("{}: is not a state of {}: {}; --adopt goes on from it all the same", state_file,
                                     scene.file, differences.text()));
}

}  // namespace nscdd
