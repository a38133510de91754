/// @file
/// The effect of a step's motion on candidates between two detections. It finds contacts that were left out, contacts
/// of grains that pass each other, and grains that pass through each other or a wall unseen.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>

#include "nscdd/core/materials.hpp"
#include "nscdd/core/wall.hpp"
#include "nscdd/detect/obstacle_contacts.hpp"
#include "nscdd/detect/paths.hpp"
#include "nscdd/law/kinematics.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Of all pairs whose overlap exceeds the allowed one at some time of the step, the one that needs the smallest step.
struct Tunnelling {
    /// Step that would do [s]: the pair is then detected while its overlap is allowed. 0: it overlaps more at the
    /// start.
    double h = std::numeric_limits<double>::infinity();
    int i = -1;  ///< id
    int j = -1;  ///< id; j < 0: wall -1-j

    bool found() const { return std::isfinite(h); }  ///< whether there is such a pair
    /// Keeps the one that needs the smaller step; of equal ones that of lower ids.
    void note(const Tunnelling& other) {
        if (std::tie(other.h, other.i, other.j) < std::tie(h, i, j)) *this = other;
    }
};

/// How a grain approaches a facet.
template <class M>
struct Approach {
    double when;   ///< their overlap exceeds what is allowed [s]; infinity if it does not within the time
    double speed;  ///< at which they come nearer now, 0 where they separate [m/s]
};

/// Of a grain that goes straight at a velocity [m/s] for a time [s], and a facet that goes to the frames `then`
/// meanwhile.
template <class M>
Approach<M> approach_of(const PlacedObstacles<M>& obstacles, const typename PlacedObstacles<M>::Frames& then,
                        int number, const Grain<M>& grain, const typename M::Vec& velocity, double time,
                        double allowed) {
    const std::size_t o = obstacles.name(number).obstacle;
    const Closest<M> now = obstacles.closest(number, obstacles.now(), grain.position);
    typename M::Vec own = M::Vec::Zero();
    if (obstacles.obstacles()[o].moves()) own = obstacles.velocity(o, now.point);
    Approach<M> found{std::numeric_limits<double>::infinity(), (std::max)(0.0, now.normal.dot(own - velocity))};
    if (!std::isfinite(time)) return found;
    const double share = when_meets<M>(obstacles, number, then, grain.position, grain.position + time * velocity,
                                       grain.radius - allowed);
    if (share < 1) found.when = share * time;
    return found;
}

/// The tunnelling before the first detection: grains and walls move by their own velocities for (1 - theta) h [s].
/// Overlaps are allowed up to `largest_overlap` times the smaller radius.
template <class M>
Tunnelling find_early_tunnelling(const Subdomain<M>& part, std::span<const Wall<M>> walls,
                                 const Materials<M>& materials, double h, double theta, double largest_overlap) {
    Tunnelling worst;
    const double time = (1 - theta) * h;
    typename PlacedObstacles<M>::Frames then;
    if (part.obstacles) then = part.obstacles->at(part.obstacles->time() + time);
    const auto note = [&](double when, double allowed, double speed, const auto& pairing, int i, int j) {
        if (!(when < time)) return;
        const double until_seen = pairing.restitution > 0 ? allowed / speed : h;
        worst.note({(std::min)(when / (1 - theta), until_seen), i, j});
    };
    for (const auto& c : part.pairs) {
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        const Grain<M>& b = part.grains[static_cast<std::size_t>(c.j)];
        const double allowed = largest_overlap * (std::min)(a.radius, b.radius);
        const typename M::Vec d = part.cell.apart(a.position, b.position),
                              w = part.cell.with_flow(
                                  a.velocity.template head<M::dim>() - b.velocity.template head<M::dim>(), d);
        note(when_nearer(d, w, a.radius + b.radius - allowed, time), allowed, w.norm(),
             materials(a.material, b.material), a.id, b.id);
    }
    for (const auto& c : part.wall_pairs) {
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        if (static_cast<std::size_t>(c.j) >= walls.size()) {
            const double allowed = largest_overlap * a.radius;
            const Approach<M> at =
                approach_of<M>(*part.obstacles, then, c.j, a, a.velocity.template head<M::dim>(), time, allowed);
            note(at.when, allowed, at.speed, materials(a.material, part.obstacles->of(c.j).material), a.id, -1 - c.j);
            continue;
        }
        const Wall<M>& wall = walls[static_cast<std::size_t>(c.j)];
        const double allowed = largest_overlap * a.radius;
        const double closing = wall.normal_speed() - a.velocity.template head<M::dim>().dot(wall.normal);
        note(when_deeper(wall.distance(a.position) - a.radius, closing, allowed, time), allowed, closing,
             materials(a.material, wall.material), a.id, -1 - c.j);
    }
    return worst;
}

/// The step at which each pair with restitution whose straight paths lead to more overlap than is allowed, however
/// late, is detected before [s]: the least allowed overlap over the speed at which it closes; infinity if there is no
/// such pair. The pair that a step is refused for is not always the one that needs the smallest step. velocity(g): of a
/// local grain [m/s]; speed(w): of a wall along its normal [m/s].
template <class M>
double step_that_sees_all(const Subdomain<M>& part, std::span<const Wall<M>> walls, const Materials<M>& materials,
                          double largest_overlap, auto&& velocity, auto&& speed) {
    constexpr double always = std::numeric_limits<double>::infinity();
    double least = always;
    const auto note = [&](double when, double allowed, double closing) {
        if (when < always) least = (std::min)(least, allowed / closing);
    };
    for (const auto& c : part.pairs) {
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        const Grain<M>& b = part.grains[static_cast<std::size_t>(c.j)];
        if (!(materials(a.material, b.material).restitution > 0)) continue;
        const double allowed = largest_overlap * (std::min)(a.radius, b.radius);
        const typename M::Vec d = part.cell.apart(a.position, b.position),
                              w = part.cell.with_flow(velocity(c.i) - velocity(c.j), d);
        note(when_nearer(d, w, a.radius + b.radius - allowed, always), allowed, w.norm());
    }
    for (const auto& c : part.wall_pairs) {
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        if (static_cast<std::size_t>(c.j) >= walls.size()) {
            if (!(materials(a.material, part.obstacles->of(c.j).material).restitution > 0)) continue;
            const double allowed = largest_overlap * a.radius;
            const Approach<M> at =
                approach_of<M>(*part.obstacles, part.obstacles->next(), c.j, a, velocity(c.i), always, allowed);
            note(at.speed > 0 ? 0 : always, allowed, at.speed);
            continue;
        }
        const Wall<M>& wall = walls[static_cast<std::size_t>(c.j)];
        if (!(materials(a.material, wall.material).restitution > 0)) continue;
        const double allowed = largest_overlap * a.radius, closing = speed(c.j) - velocity(c.i).dot(wall.normal);
        note(when_deeper(wall.distance(a.position) - a.radius, closing, allowed, always), allowed, closing);
    }
    return least;
}

/// What find_tunnelled() finds in a subdomain.
struct Tunnelled {
    bool closes = false;    ///< candidates without restitution are to be contacts, see mark_missed(): solved again
    Tunnelling tunnelling;  ///< of pairs with restitution, which act once they touch
};

/// The cell with the flow that the step has found: a stress may drive its sides.
template <class M>
Cell<M> solved_cell(const Subdomain<M>& part) {
    Cell<M> cell = part.cell;
    if (part.problem.flow) cell.gradient = part.problem.flow_gradient();
    return cell;
}

/// Marks as passing the contacts whose grains would pass each other without touching, but for the contact's own
/// impulse. Where others act too, one that takes little stays: solving again costs more than it is worth. What turns
/// out to touch without the contact is missed then, and stays a contact. True if there is one: the step is solved
/// again.
template <class M>
bool mark_passing(Subdomain<M>& part, double h) {
    bool found = false;
    const Cell<M> cell = solved_cell(part);
    for (std::size_t k = 0; k < part.problem.contacts.size(); ++k) {
        const Contact<M>& c = part.problem.contacts[k];
        auto& candidate = part.pairs[static_cast<std::size_t>(part.source[k])];
        const bool open =
            c.bias > 0 && candidate.free_gap == Candidates<M>::Candidate::held;  // at first, and without restitution
        const bool pulls = M::Law::excess(0.0, c.coefficients()) > 0;            // whichever way the grains go
        if (!open || c.r.isZero(0) || candidate.missed || pulls) continue;
        const auto i = static_cast<std::size_t>(c.i), j = static_cast<std::size_t>(c.j);
        const Grain<M>&a = part.grains[i], &b = part.grains[j];
        const typename M::Vec own = (1 / a.mass + 1 / b.mass) * impulse_vector<M>(c.r, c.normal),
                              d = part.cell.apart(a.position, b.position),
                              w = cell.with_flow(
                                  part.problem.bodies[i].linear() - part.problem.bodies[j].linear() - own, d),
                              before = part.cell.with_flow((a.velocity - b.velocity).template head<M::dim>(), d);
        const bool alone = (w - before).norm() <= 1e-9 * w.norm();  // no other impulse acts on either
        // Other impulses react when this one goes: a hit is in doubt that is less than half as deep as along the
        // normal. No hit is deeper than both grains, however fast the impulse of a long row would make them.
        const double along = w.dot(c.normal), reach = a.radius + b.radius,
                     doubt = alone ? 0 : 0.5 * (std::min)(-h * (along + c.bias), reach),
                     negligible =
                         alone ? 0
                               : (std::max)(passing_way * (std::min)(a.radius, b.radius), passing_share * h * w.norm());
        if (pass_by(d, w, along, c.bias, reach - doubt, h, negligible)) candidate.passes = found = true;
    }
    return found;
}

/// Checks the candidates that the law does not keep open, those left out and those with restitution, for the motion
/// from this detection to the next. Finds those without restitution that the step would close. Contacts without
/// restitution need no check: the law keeps v_n >= -gap/h, so they stay open along the normal of this detection, and so
/// all the way. `speed`: the largest of any body [m/s]; `largest_overlap`: allowed, over the smaller radius.
template <class M>
Tunnelled find_tunnelled(Subdomain<M>& part, std::span<const Wall<M>> walls, const Materials<M>& materials, double h,
                         double speed, double largest_overlap) {
    Tunnelled unseen;
    const Cell<M> cell = solved_cell(part);
    const auto near = [closable_gap = 2 * h * speed](const auto& c) { return c.free_gap <= closable_gap; };
    const auto velocity = [&](int grain) { return part.problem.bodies[static_cast<std::size_t>(grain)].linear(); };
    const auto check_law = [&](auto& c, bool closes) {
        c.closes = closes;
        unseen.closes |= closes;
    };
    const auto note = [&](double when, double allowed, double closing, int i, int j) {
        if (when < h) unseen.tunnelling.note({when > 0 ? (std::min)(when, allowed / closing) : 0, i, j});
    };
    for (auto& c : part.pairs) {
        c.closes = false;
        if (!near(c)) continue;
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        const Grain<M>& b = part.grains[static_cast<std::size_t>(c.j)];
        const typename M::Vec d = cell.apart(a.position, b.position),
                              w = cell.with_flow(velocity(c.i) - velocity(c.j), d);
        if (materials(a.material, b.material).restitution > 0) {
            const double allowed = largest_overlap * (std::min)(a.radius, b.radius);
            note(when_nearer(d, w, a.radius + b.radius - allowed, h), allowed, w.norm(), a.id, b.id);
        } else {
            check_law(c, when_nearer(d, w, a.radius + b.radius, h) < h);
        }
    }
    for (auto& c : part.wall_pairs) {
        c.closes = false;
        if (!near(c)) continue;
        const Grain<M>& a = part.grains[static_cast<std::size_t>(c.i)];
        if (static_cast<std::size_t>(c.j) >= walls.size()) {
            const bool impact = materials(a.material, part.obstacles->of(c.j).material).restitution > 0;
            const double allowed = (impact ? largest_overlap : touches_unseen) * a.radius;
            const Approach<M> at =
                approach_of<M>(*part.obstacles, part.obstacles->next(), c.j, a, velocity(c.i), h, allowed);
            impact ? note(at.when, allowed, at.speed, a.id, -1 - c.j) : check_law(c, at.when < h);
            continue;
        }
        const Wall<M>& wall = walls[static_cast<std::size_t>(c.j)];
        double closing = wall.velocity.dot(wall.normal) - velocity(c.i).dot(wall.normal);
        closing += part.problem.walls[static_cast<std::size_t>(c.j)].speed;
        if (materials(a.material, wall.material).restitution > 0) {
            const double allowed = largest_overlap * a.radius;
            note(when_deeper(c.free_gap, closing, allowed, h), allowed, closing, a.id, -1 - c.j);
        } else {
            check_law(c, c.free_gap < h * closing);
        }
    }
    return unseen;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
