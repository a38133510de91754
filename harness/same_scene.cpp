#include "same_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

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

void require_fitting_state(const State& state, const std::string& state_file, const Scene& scene) {
    const auto refuse = [&](const std::string& has, const std::string& wants) {
        throw InputError(fmt::format("{}: {}, {} {}", state_file, has, scene.file, wants));
    };
    const std::size_t n = state.packing.total(), w = state.walls.offset.size(), m = scene.materials.size();
    if (state.packing.dim != scene.dimension)
        refuse(fmt::format("{} dimensions", state.packing.dim), fmt::format("has {}", scene.dimension));
    if (w != scene.walls.size()) refuse(fmt::format("{} walls", w), fmt::format("has {}", scene.walls.size()));
    if (n < scene.grains.size())
        refuse(fmt::format("{} grains", n), fmt::format("has {} besides those of a packing", scene.grains.size()));
    const auto worst = std::max_element(state.material.begin(), state.material.end());
    if (worst != state.material.end() && *worst >= static_cast<int>(m))
        refuse(fmt::format("grain {} is of material {}",
                           state.packing.before + static_cast<std::size_t>(worst - state.material.begin()), *worst + 1),
               fmt::format("has {}", m));
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
    // the scene's own grains come behind those of the packing
    const std::size_t n = state.packing.total(), own = scene.grains.size(), packed = n - own;
    if (packing.total() > 0 || scene.packing_file.empty())
        differences.compare("the number of grains", double(n), double(packing.total() + own));
    const auto compare = [&](std::size_t g, double radius, int material) {
        const std::size_t row = g - state.packing.before;
        differences.compare(fmt::format("the radius of grain {}", g), state.packing.radius[row], radius);
        differences.compare(fmt::format("the material of grain {}", g),
                            state.materials.name[static_cast<std::size_t>(state.material[row])],
                            scene.materials[static_cast<std::size_t>(material)].name);
    };
    const std::size_t begin = state.packing.before, end = begin + state.packing.size();
    for (std::size_t g = begin; g < end; ++g)
        if (g >= packed)
            compare(g, scene.grains[g - packed].radius, scene.grains[g - packed].material);
        else if (g - begin < packing.size())  // the same rows of both files
            compare(g, packing.radius[g - begin], scene.packing_material);
    if (differences.count() > 0)
        throw InputError(fmt::format("{}: is not a state of {}: {}; --adopt goes on from it all the same", state_file,
                                     scene.file, differences.text()));
}

}  // namespace nscdd
