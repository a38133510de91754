// What a step's motion does to candidates between two detections: contacts that were left out, and grains that pass
// through each other or through a wall unseen.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>

#include "nscdd/core/materials.hpp"
#include "nscdd/core/wall.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd::inline NSCDD_ABI {

// Of all pairs whose overlap exceeds the allowed one at some time of the step, the one that needs the smallest step.
struct Passage {
    // Step that would do [s]: the pair is then detected while its overlap is allowed. 0: it overlaps more at the start.
    double h = std::numeric_limits<double>::infinity();
    int i = -1, j = -1;  // ids; j < 0: wall -1-j

    bool found() const { return std::isfinite(h); }  // whether there is such a pair
    // Keeps the one that needs the smaller step; of equal ones that of lower ids.
    void note(const Passage& other) {
        if (std::tie(other.h, other.i, other.j) < std::tie(h, i, j)) *this = other;
    }
};

namespace detail {

// Time at which two spheres at `d` from each other, whose relative velocity is `w`, come nearer than `least`: infinity
// if they do not within `time`, or separate.
template <class Vec>
double when_nearer(const Vec& d, const Vec& w, double least, double time) {
    constexpr double never = std::numeric_limits<double>::infinity();
    const double closing = -d.dot(w), speed2 = w.squaredNorm(), beyond = d.squaredNorm() - least * least;
    if (!(closing > 0) || !(least > 0)) return never;
    if (beyond <= 0) return 0;
    const double root2 = closing * closing - speed2 * beyond;
    if (root2 < 0) return never;
    const double t = beyond / (closing + std::sqrt(root2));
    return t < time ? t : never;
}

// Time at which the overlap of a grain and a plane exceeds `allowed`: infinity if it does not within `time`.
inline double when_deeper(double gap, double closing, double allowed, double time) {
    constexpr double never = std::numeric_limits<double>::infinity();
    if (!(closing > 0)) return never;
    const double t = std::max(0.0, (gap + allowed) / closing);
    return t < time ? t : never;
}

}  // namespace detail

// The passage before the first detection: grains and walls move by their own velocities for (1 - theta) h [s]. Overlaps
// are allowed up to `largest_overlap` times the smaller radius.
template <class M>
Passage find_early_passage(const Subdomain<M>& part, std::span<const Wall<M>> walls, const MaterialsOf<M>& materials,
                           double h, double theta, double largest_overlap) {
    Passage worst;
    const double time = (1 - theta) * h;
    const auto note = [&](double when, double allowed, double speed, const auto& pairing, int i, int j) {
        if (!(when < time)) return;
        const double until_seen = pairing.restitution > 0 ? allowed / speed : h;
        worst.note({std::min(when / (1 - theta), until_seen), i, j});
    };
    for (const auto& c : part.pairs) {
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        const Grain<M>& b = part.grains[static_cast<std::size_t>(c.j)];
        const double allowed = largest_overlap * std::min(a.radius, b.radius);
        const typename M::Vec d = a.position - b.position,
                              w = a.velocity.template head<M::dim>() - b.velocity.template head<M::dim>();
        note(detail::when_nearer(d, w, a.radius + b.radius - allowed, time), allowed, w.norm(),
             materials(a.material, b.material), a.id, b.id);
    }
    for (const auto& c : part.wall_pairs) {
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        const Wall<M>& wall = walls[static_cast<std::size_t>(c.j)];
        const double allowed = largest_overlap * a.radius;
        const double closing = wall.normal_speed() - a.velocity.template head<M::dim>().dot(wall.normal);
        note(detail::when_deeper(wall.distance(a.position) - a.radius, closing, allowed, time), allowed, closing,
             materials(a.material, wall.material), a.id, -1 - c.j);
    }
    return worst;
}

// What find_unseen() finds in a subdomain.
struct Unseen {
    bool missed = false;  // a candidate without restitution was left out that the step would close
    Passage passage;      // of pairs with restitution, which act once they touch
};

// Checks the candidates that the law does not keep open, those left out and those with restitution, for the motion from
// this detection to the next. Marks as missed those without restitution that the step would close. Contacts without
// restitution need no check: the law keeps v_n >= -gap/h, so they stay open along the normal of this detection, and so
// all the way. `speed`: the largest of any body [m/s]; `largest_overlap`: allowed, over the smaller radius.
template <class M>
Unseen find_unseen(Subdomain<M>& part, std::span<const Wall<M>> walls, const MaterialsOf<M>& materials, double h,
                   double speed, double largest_overlap) {
    Unseen unseen;
    const auto near = [closable_gap = 2 * h * speed](const Candidate<M>& c) { return c.free_gap <= closable_gap; };
    const auto velocity = [&](int grain) { return part.problem.bodies[static_cast<std::size_t>(grain)].linear(); };
    const auto check = [&](Candidate<M>& c, double closing) {
        if (c.free_gap < h * closing) c.missed = unseen.missed = true;
    };
    const auto note = [&](double when, double allowed, double closing, int i, int j) {
        if (when < h) unseen.passage.note({when > 0 ? std::min(when, allowed / closing) : 0, i, j});
    };
    for (auto& c : part.pairs) {
        if (!near(c)) continue;
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        const Grain<M>& b = part.grains[static_cast<std::size_t>(c.j)];
        const typename M::Vec d = a.position - b.position, w = velocity(c.i) - velocity(c.j);
        if (materials(a.material, b.material).restitution > 0) {
            const double allowed = largest_overlap * std::min(a.radius, b.radius);
            note(detail::when_nearer(d, w, a.radius + b.radius - allowed, h), allowed, w.norm(), a.id, b.id);
        } else {
            check(c, -w.dot(d.normalized()));
        }
    }
    for (auto& c : part.wall_pairs) {
        if (!near(c)) continue;
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        const Wall<M>& wall = walls[static_cast<std::size_t>(c.j)];
        double closing = wall.velocity.dot(wall.normal) - velocity(c.i).dot(wall.normal);
        closing += part.problem.walls[static_cast<std::size_t>(c.j)].speed;
        if (materials(a.material, wall.material).restitution > 0) {
            const double allowed = largest_overlap * a.radius;
            note(detail::when_deeper(c.free_gap, closing, allowed, h), allowed, closing, a.id, -1 - c.j);
        } else {
            check(c, closing);
        }
    }
    return unseen;
}

}  // namespace nscdd
