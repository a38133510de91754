/// @file
/// The narrow phase of obstacles: contacts of a grain with the facets near it. Where a facet goes on in another one, a
/// grain must not feel the edge between them.
#pragma once

#include "nscdd/detect/narrow_phase.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Two points nearer than this are one, over the radius of the grain; so are a point and a facet. Facets within this
/// angle are one plane, which a file of numbers with seven digits bends.
constexpr double one_point = 1e-4;
/// An overlap with an obstacle within the step that may be left to the next one, over the radius.
constexpr double touches_unseen = 0.01;

/// A facet near a grain.
template <class M>
struct NearFacet {
    std::size_t candidate;  ///< in wall_pairs
    int number;             ///< of the facet, PlacedObstacles
    Closest<M> next;        ///< in the place that the facet has at the next detection
    double gap;             ///< now [m]
    bool pulls;             ///< its pair has a range
    double alert = 0;       ///< gap up to which it is a contact [m]
    bool kept = true;       ///< not that of another one
};

/// The share of the way from a place to another one after which a sphere there is nearer than `radius` [m] to the
/// surface that `closest(x)` looks at; infinity if it never is.
template <class M>
double when_meets(const typename M::Vec& from, const typename M::Vec& to, double radius, auto&& closest) {
    constexpr double never = std::numeric_limits<double>::infinity();
    const double way = (to - from).norm();
    double share = 0;
    for (int tries = 0; tries < 200; ++tries) {  // no farther than to the surface at once
        const double gap = closest(typename M::Vec(from + share * (to - from))).distance - radius;
        if (gap <= 1e-9 * radius) return share;
        share += gap / way;
        if (!(share < 1)) return never;
    }
    return share;  // it comes as near as makes no difference
}

/// The same for a facet on its way from now to the frames `then`, of a grain that goes to another place meanwhile.
template <class M>
double when_meets(const PlacedObstacles<M>& obstacles, int number, const typename PlacedObstacles<M>::Frames& then,
                  const typename M::Vec& from, const typename M::Vec& to, double radius) {
    const std::size_t o = obstacles.name(number).obstacle;
    typename M::Vec start = from;
    if (obstacles.obstacles()[o].moves()) start = then[o].place(obstacles.now()[o].origin(from));
    return when_meets<M>(start, to, radius,
                         [&](const typename M::Vec& x) { return obstacles.closest(number, then, x); });
}

/// A facet that goes past the centre of the grain would push it to the other side. It stays on the side where it is: by
/// its plane there the distance is negative at the end.
template <class M>
void keep_side(const PlacedObstacles<M>& obstacles, const Grain<M>& grain, NearFacet<M>& facet) {
    const typename M::Vec& x = grain.position;
    const std::size_t o = obstacles.name(facet.number).obstacle;
    const typename M::Vec start = obstacles.next()[o].place(obstacles.now()[o].origin(x));
    if ((x - start).norm() < facet.gap + grain.radius ||
        !(when_meets<M>(obstacles, facet.number, obstacles.next(), x, x, touches_unseen * grain.radius) < 1))
        return;
    facet.next = obstacles.closest(facet.number, obstacles.next(), start);
    facet.next.distance = (x - facet.next.point).dot(facet.next.normal);
}

/// Whether a facet stands between a place and a point of another facet, which is at `distance` from it [m]. By what is
/// one point it must be nearer.
template <class M>
bool hides(const PlacedObstacles<M>& obstacles, int number, const typename M::Vec& place, const typename M::Vec& point,
           double distance, double radius) {
    const typename M::Vec end = place + (1 - one_point * radius / distance) * (point - place);
    return when_meets<M>(place, end, 1e-6 * radius,
                         [&](const typename M::Vec& x) { return obstacles.closest(number, obstacles.next(), x); }) < 1;
}

/// Marks facets whose closest point is that of a nearer one, or lies on it: the grain touches that one. Their impulses
/// go on with it. So are those that pull through a nearer one, as the far face of a thin slab. near: by distance; all
/// that may act.
template <class M>
void drop_inner_edges(Subdomain<M>& part, std::vector<NearFacet<M>>& near, const Grain<M>& grain) {
    const PlacedObstacles<M>& obstacles = *part.obstacles;
    const double same = one_point * grain.radius;
    for (std::size_t n = 1; n < near.size(); ++n) {
        NearFacet<M>& facet = near[n];
        auto& candidate = part.wall_pairs[facet.candidate];
        if (candidate.missed) continue;
        const typename M::Vec& point = facet.next.point;
        for (std::size_t m = 0; m < n && facet.kept; ++m) {
            const NearFacet<M>& nearer = near[m];
            const bool on_it =
                (nearer.next.point - point).squaredNorm() <= same * same ||
                (facet.next.edge && obstacles.closest(nearer.number, obstacles.next(), point).distance <= same);
            const bool hidden =
                !on_it && facet.pulls && facet.next.distance > same &&
                hides(obstacles, nearer.number, grain.position, point, facet.next.distance, grain.radius);
            if (!on_it && !hidden) continue;
            facet.kept = false;
            auto& heir = part.wall_pairs[nearer.candidate];
            if (on_it && nearer.kept && heir.r.isZero(0)) heir.r = candidate.r;
            candidate.r.setZero();
        }
    }
}

/// Acceleration that keeps a grain at the inside of a cylinder [m/s^2]: along a tangent it leaves it by half of this
/// times the square of its time. 0 at the outside, and where the grain would go past the middle within the step: no
/// chord of the cylinder is as long. normal: of the contact.
template <class M>
double bend(const PlacedObstacles<M>& obstacles, std::size_t obstacle, const Grain<M>& grain,
            const typename M::Vec& normal, double h) {
    const Cylinder<M>& cylinder = *obstacles.obstacles()[obstacle].surface->cylinder();
    const Frame<M>& frame = obstacles.next()[obstacle];
    const typename M::Vec centre = frame.place(cylinder.centre);
    if (normal.dot(grain.position - centre) > 0 || !(cylinder.radius > grain.radius)) return 0;
    typename M::Vec along = grain.velocity.template head<M::dim>();
    if (obstacles.obstacles()[obstacle].moves()) along -= obstacles.velocity(obstacle, centre);
    along -= along.dot(normal) * normal;
    if constexpr (M::dim == 3) {
        const typename M::Vec axis = frame.turn * cylinder.axis;
        along -= along.dot(axis) * axis;
    }
    const double room = cylinder.radius - grain.radius;
    return h * along.norm() > room ? 0 : along.squaredNorm() / room;
}

/// Whether the path of a grain within the step only passes an edge. The contact holds the grain on the plane across its
/// normal, which is off the path's end by how far the normal turns: an overlap up to that, and to touches_unseen, is
/// left to the next step. A grain that falls on an edge is held.
template <class M>
bool passes_edge(const PlacedObstacles<M>& obstacles, const NearFacet<M>& facet, const Grain<M>& grain,
                 const typename M::Vec& way) {
    const double straight = facet.next.distance + way.dot(facet.next.normal),
                 end = obstacles.closest(facet.number, obstacles.next(), grain.position + way).distance,
                 unseen = std::clamp(end - straight, 0.0, touches_unseen * grain.radius);
    return !(when_meets<M>(obstacles, facet.number, obstacles.next(), grain.position, grain.position + way,
                           grain.radius - unseen) < 1);
}

/// Appends the contacts of a grain with obstacles. Its candidates with them are wall_pairs[begin] to wall_pairs[end -
/// 1]. `h`, `alert` and `worst` as in detect_contacts().
template <class M>
void add_obstacle_contacts(Subdomain<M>& part, std::size_t begin, std::size_t end, const Materials<M>& materials,
                           double h, const Alert& alert, Overlap& worst) {
    using Vec = typename M::Vec;
    const PlacedObstacles<M>& obstacles = *part.obstacles;
    const Grain<M>& grain = part.grains[static_cast<std::size_t>(part.wall_pairs[begin].i)];
    const Vec v = grain.velocity.template head<M::dim>();
    std::vector<NearFacet<M>> near;
    double reach = 0;
    for (std::size_t k = begin; k < end; ++k) {
        auto& candidate = part.wall_pairs[k];
        const int number = candidate.j;
        const Obstacle<M>& obstacle = obstacles.of(number);
        const double range = range_of<typename M::Law>(materials(grain.material, obstacle.material));
        NearFacet<M> facet{k, number, obstacles.closest(number, obstacles.next(), grain.position), 0, range > 0};
        facet.gap = (obstacle.moves() ? obstacles.closest(number, obstacles.now(), grain.position).distance
                                      : facet.next.distance) -
                    grain.radius;
        if (obstacle.moves()) keep_side(obstacles, grain, facet);
        if (facet.gap < 0) worst.note({-facet.gap / grain.radius, grain.id, -1 - number});
        Vec from = v;
        if (obstacle.moves()) from -= obstacles.velocity(obstacles.name(number).obstacle, facet.next.point);
        facet.alert = alert.of(from);
        reach = (std::max)({reach, facet.alert, range});
        near.push_back(facet);
    }
    // One reach for all: a nearer facet hides the edge of a farther one, also where only that one moves.
    std::erase_if(near, [&](const NearFacet<M>& facet) {
        auto& candidate = part.wall_pairs[facet.candidate];
        if (facet.gap <= reach || candidate.missed) return false;
        candidate.free_gap = facet.gap;
        candidate.r.setZero();
        return true;
    });
    std::sort(near.begin(), near.end(), [](const NearFacet<M>& a, const NearFacet<M>& b) {
        return std::tie(a.next.distance, a.number) < std::tie(b.next.distance, b.number);
    });
    drop_inner_edges(part, near, grain);
    std::sort(near.begin(), near.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
    for (const NearFacet<M>& facet : near) {
        auto& candidate = part.wall_pairs[facet.candidate];
        candidate.free_gap = facet.gap;
        if (!facet.kept) continue;
        const std::size_t o = obstacles.name(facet.number).obstacle;
        const Obstacle<M>& obstacle = obstacles.obstacles()[o];
        const Vec& n = facet.next.normal;
        const auto& pairing = materials(grain.material, obstacle.material);
        // Along the normal the facet moves by what changes the gap, so that it is open at the next detection.
        Vec own = Vec::Zero();
        double own_before = 0;
        if (obstacle.moves()) {
            own = obstacles.velocity(o, facet.next.point);
            own += ((facet.gap + grain.radius - facet.next.distance) / h - own.dot(n)) * n;
            if (pairing.restitution > 0)
                own_before = (obstacles.closest(facet.number, obstacles.before(), grain.position).distance -
                              grain.radius - facet.gap) /
                             h;
        }
        const double taken = own.dot(n) - v.dot(n) - facet.gap / h;
        const bool passes = facet.next.edge && facet.gap > 0 && taken > 0 && taken * h > passing_way * grain.radius &&
                            passes_edge<M>(obstacles, facet, grain, h * v);
        if (!acts<M>(candidate, pairing, facet.gap, facet.alert, passes)) continue;
        Contact<M>& contact = part.problem.wall_contacts.emplace_back();
        fill(contact, candidate, pairing, facet.gap, h, n, v.dot(n) - own_before, grain.radius, 0.0);
        if (obstacle.surface->cylinder() && !facet.next.edge && !(pairing.restitution > 0))
            contact.bias -= 0.5 * h * bend(obstacles, o, grain, n, h);
        contact.j = obstacles.walls() + static_cast<int>(part.touches.size());
        part.touches.push_back({facet.number, own});
        part.wall_source.push_back(static_cast<int>(facet.candidate));
    }
}

}}}  // namespace nscdd::NSCDD_ABI::detail
