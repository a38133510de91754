// A scene to be judged, and what the families build it with.
#pragma once

#include <functional>

#include "../small_scenes.hpp"
#include "draw.hpp"

namespace wild {

template <class M>
struct Scene : scenes::Scene<M> {
    int warm_steps = 0;   // steps before those that are judged
    bool tight = true;    // warm steps by Newton's method, to a tight tolerance; else by the solver itself
    bool forget = false;  // the judged step begins with impulses 0
    int judged_steps = 1;
};

// Axis 0 is horizontal, the last one points up. Lengths are near 1, which is a usual diameter.
template <class M>
class Builder {
  public:
    using Vec = typename M::Vec;

    Builder(Draw& random, std::string family) : draw(random) {
        scene.name = std::move(family);
        scene.settings.largest_overlap = 0.9;
        scene.settings.h = draw.log_uniform(1e-4, 2e-2);
        count = static_cast<int>(draw.log_uniform(10, 400));
        speed = draw.log_uniform(1e-3, 1e2);
    }

    static Vec at(double x, double y) {
        Vec place = Vec::Zero();
        place[0] = x, place[M::dim - 1] = y;
        return place;
    }
    nscdd::Grain<M>& grain(double radius, double density, const Vec& place, const Vec& velocity = Vec::Zero()) {
        const int id = static_cast<int>(scene.grains.size());
        auto& grain = scene.grains.emplace_back(nscdd::make_grain<M>(id, radius, density, place));
        grain.velocity.template head<M::dim>() = velocity;
        return grain;
    }
    nscdd::Wall<M>& wall(const Vec& normal, const Vec& through) {
        nscdd::Wall<M>& wall = scene.settings.walls.emplace_back();
        wall.normal = normal.normalized();
        wall.offset = wall.normal.dot(through);
        return wall;
    }
    nscdd::Wall<M>& floor(double height = 0) { return wall(at(0, 1), at(0, height)); }
    void gravity(double size) { scene.settings.gravity = at(0, -size); }

    // One grain after the other from `place` on along `direction`, `gap` of a diameter apart. radius(k), density(k),
    // velocity(s), s from 0 to 1. Returns the centre of a next one of the last radius.
    Vec row(int grains, Vec place, const Vec& direction, double gap, auto&& radius, auto&& density, auto&& velocity) {
        for (int k = 0; k < grains; ++k) {
            const double r = radius(k);
            if (k > 0) place += direction * r;
            grain(r, density(k), place, velocity(grains > 1 ? double(k) / (grains - 1) : 0.0));
            place += direction * (r + 2 * r * gap);
        }
        return place + direction * scene.grains.back().radius;
    }

    // A gap that the speed closes within the step, or none, or one far smaller [diameters].
    double small_gap() {
        if (draw.chance(0.3)) return 0;
        return std::min(1e-2, speed * scene.settings.h * draw.log_uniform(1e-6, 0.3));
    }

    // How velocities along a row vary with the place s in it, times `speed`: most of them close the row.
    std::function<double(double)> profile() {
        const double waves = draw.integer(1, 12), noise = draw.chance(0.3) ? draw.log_uniform(1e-3, 1) : 0.0;
        const int kind = draw.integer(0, 6);
        return [=, this](double s) {
            const double pi = std::numbers::pi;
            const double shape = kind == 0   ? 1 - 2 * s
                                 : kind == 1 ? -s
                                 : kind == 2 ? (s == 0 ? 1.0 : 0.0)
                                 : kind == 3 ? (s < 0.5 ? 1.0 : -1.0)
                                 : kind == 4 ? std::cos(pi * waves * s)
                                 : kind == 5 ? std::cos(pi * s) + 0.3 * std::cos(pi * waves * s)
                                             : 0;
            return speed * (shape + (kind == 6 ? 1 : noise) * draw.normal());
        };
    }

    Draw& draw;
    Scene<M> scene;
    int count;     // of grains, about
    double speed;  // of what moves
};

}  // namespace wild
