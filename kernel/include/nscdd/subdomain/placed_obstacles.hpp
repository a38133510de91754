#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "nscdd/core/contact_problem.hpp"
#include "nscdd/core/obstacle.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The obstacles of a scene where they are within a step, the same on every rank. Facets are numbered behind the walls,
/// obstacle by obstacle: these numbers are the `j` of candidates.
template <class M>
class PlacedObstacles {
  public:
    using Vec = typename M::Vec;
    using Frames = std::vector<Frame<M>>;  ///< of each obstacle

    /// walls: number of the scene's walls.
    PlacedObstacles(std::shared_ptr<const std::vector<Obstacle<M>>> obstacles, std::size_t walls)
        : all_(std::move(obstacles)), first_{static_cast<int>(walls)} {
        for (const Obstacle<M>& obstacle : *all_) {
            first_.push_back(first_.back() + static_cast<int>(obstacle.surface->size()));
            arms_.push_back(obstacle.turn.rate != 0 ? arm(obstacle) : 0);
        }
    }

    /// A facet of an obstacle.
    struct Name {
        std::size_t obstacle;  ///< its index in obstacles()
        int facet;             ///< its index in the surface
    };
    /// Of a number from walls() on.
    Name name(int number) const {
        const auto after = std::upper_bound(first_.begin(), first_.end(), number);
        const auto o = static_cast<std::size_t>(after - first_.begin()) - 1;
        return {o, number - first_[o]};
    }
    int walls() const { return first_.front(); }                                        ///< number of the first facet
    int end() const { return first_.back(); }                                           ///< one after the last facet
    const std::vector<Obstacle<M>>& obstacles() const { return *all_; }                 ///< of the scene, as at time 0
    const Obstacle<M>& of(int number) const { return (*all_)[name(number).obstacle]; }  ///< that has this facet

    double time() const { return time_; }             ///< of now() [s]
    const Frames& now() const { return now_; }        ///< where grains are
    const Frames& before() const { return before_; }  ///< at the detection of the step before
    const Frames& next() const { return next_; }      ///< at that of the step after
    /// Where they are at a time [s].
    Frames at(double time) const {
        Frames frames;
        for (const Obstacle<M>& obstacle : *all_) frames.push_back(Frame<M>::at(obstacle, time));
        return frames;
    }
    /// Moves them to a time [s].
    void move_to(double time) {
        time_ = time;
        now_ = at(time);
    }
    /// Sets what they do in a step of h [s] whose contacts are detected at a time [s].
    void begin_step(double before, double next, double h) {
        before_ = at(before);
        next_ = at(next);
        means_.clear();
        for (const Obstacle<M>& obstacle : *all_)
            means_.push_back(obstacle.path ? Vec((obstacle.path(next) - obstacle.path(next - h)) / h)
                                           : Vec(Vec::Zero()));
        for (const Vec& mean : means_)
            if (!mean.allFinite()) throw std::runtime_error("the path of an obstacle is not finite");
    }

    /// The point of a facet that is closest to x, in one of the frames.
    Closest<M> closest(int number, const Frames& frames, const Vec& x) const {
        const auto [o, facet] = name(number);
        const Frame<M>& frame = frames[o];
        if (!(*all_)[o].moves()) return (*all_)[o].surface->closest(facet, x);
        Closest<M> found = (*all_)[o].surface->closest(facet, frame.origin(x));
        found.point = frame.place(found.point);
        if (frame.turned) found.normal = frame.turn * found.normal;
        return found;
    }
    /// visit(number) for all facets that are now nearer than `reach` [m] to x, in order.
    void visit_near(const Vec& x, double reach, auto&& visit) const {
        std::vector<int> found;
        for (std::size_t o = 0; o < all_->size(); ++o) {
            const Vec origin = now_[o].origin(x);
            const Surface<M>& surface = *(*all_)[o].surface;
            surface.visit_near(origin, reach, [&](int facet) {
                if (surface.closest(facet, origin).distance < reach) found.push_back(first_[o] + facet);
            });
        }
        std::sort(found.begin(), found.end());
        for (const int number : found) visit(number);
    }

    /// The facets of an obstacle where they are now, for pictures: a cylinder is cut into `pieces` flat ones; one
    /// without ends is `length` long [m].
    std::vector<Facet<M>> facets_now(std::size_t obstacle, double length, int pieces = 64) const {
        const Surface<M>& surface = *(*all_)[obstacle].surface;
        std::vector<Facet<M>> facets = surface.facets();
        if (const auto& c = surface.cylinder()) {
            const Vec across = M::dim == 2 ? Vec(Vec::UnitX()) : Vec(c->axis.unitOrthogonal());
            const auto around = [&](int k, double height) -> Vec {
                const double angle = 2 * std::acos(-1.0) * k / pieces;
                if constexpr (M::dim == 2)
                    return c->centre + c->radius * Vec(std::cos(angle), std::sin(angle));
                else
                    return c->centre + height * c->axis +
                           c->radius * (std::cos(angle) * across + std::sin(angle) * Vec(cross(c->axis, across)));
            };
            const double half = 0.5 * (std::min)(length, c->length);
            for (int k = 0; k < pieces; ++k) {
                const int next = (k + 1) % pieces;
                if constexpr (M::dim == 2) {
                    facets.push_back({around(k, 0), around(next, 0)});
                } else {
                    facets.push_back({around(k, -half), around(next, -half), around(next, half)});
                    facets.push_back({around(k, -half), around(next, half), around(k, half)});
                }
            }
        }
        for (Facet<M>& facet : facets)
            for (Vec& corner : facet) corner = now_[obstacle].place(corner);
        return facets;
    }

    /// Mean velocity in the step of what moves with an obstacle and is at a point in next() [m/s].
    Vec velocity(std::size_t obstacle, const Vec& point) const {
        const auto& turn = (*all_)[obstacle].turn;
        Vec v = means_[obstacle];
        if (turn.rate == 0) return v;
        const Vec arm = point - next_[obstacle].place(turn.centre);
        if constexpr (M::dim == 2)
            v += turn.rate * Vec(-arm[1], arm[0]);
        else
            v += turn.rate * Vec(cross(turn.axis, arm));
        return v;
    }

    /// Angular velocity of the obstacle that has a facet [rad/s].
    typename M::Spin spin(int number) const {
        const auto& turn = of(number).turn;
        if constexpr (M::dim == 2)
            return M::Spin::Constant(turn.rate);
        else
            return turn.rate * turn.axis;
    }

    /// The farthest that any point of a surface moves between two times [m], or more; a cylinder that turns about its
    /// own axis stays where it is.
    double moved(double from, double to) const {
        double most = 0;
        for (std::size_t o = 0; o < all_->size(); ++o) {
            const Obstacle<M>& obstacle = (*all_)[o];
            if (!obstacle.moves()) continue;
            double way = obstacle.path ? (obstacle.path(to) - obstacle.path(from)).norm() : 0;
            const double angle = (std::min)(std::abs(obstacle.turn.rate * (to - from)), std::acos(-1.0));
            if (angle > 0) way += 2 * std::sin(0.5 * angle) * arms_[o];
            most = (std::max)(most, way);
        }
        return most;
    }

  private:
    /// Largest distance of a point of the surface from the axis of its turn [m].
    static double arm(const Obstacle<M>& obstacle) {
        const auto& turn = obstacle.turn;
        const auto from_axis = [&turn](const Vec& x) {
            Vec way = x - turn.centre;
            if constexpr (M::dim == 3) way -= way.dot(turn.axis) * turn.axis;
            return way.norm();
        };
        double most = 0;
        for (const auto& facet : obstacle.surface->facets())
            for (const Vec& corner : facet) most = (std::max)(most, from_axis(corner));
        if (const auto& c = obstacle.surface->cylinder()) {
            bool own = from_axis(c->centre) <= 1e-12 * c->radius;
            double reach = 0;
            if constexpr (M::dim == 3) {
                own = own && cross(c->axis, turn.axis).norm() <= 1e-12;
                reach = std::isfinite(c->length) ? 0.5 * c->length : 0;
            }
            if (!own) most = from_axis(c->centre) + c->radius + reach;
        }
        return most;
    }

    std::shared_ptr<const std::vector<Obstacle<M>>> all_;
    std::vector<int> first_;
    std::vector<double> arms_;
    Frames before_, now_, next_;
    std::vector<Vec> means_;
    double time_ = 0;
};

namespace bases {

/// What a rank knows of obstacles, and its contacts with them in the step.
template <class M>
struct NearObstacles {
    std::shared_ptr<const PlacedObstacles<M>> obstacles;  ///< of the scene, set as they move; null where it has none
    /// A contact with an obstacle.
    struct Touch {
        int number;                ///< of the facet
        typename M::Vec velocity;  ///< of the obstacle there [m/s]
    };
    /// The k-th contact with an obstacle has a wall of its own in the problem, the k-th behind those of the scene. The
    /// narrow phase writes them.
    std::vector<Touch> touches;

    /// The number that candidates have for the wall or facet of a contact with a wall, among `walls`.
    int number_of(const Contact<M>& contact, std::size_t walls) const {
        const auto j = static_cast<std::size_t>(contact.j);
        // a solver may have left any number, of which the caller tells
        return j < walls || j - walls >= touches.size() ? contact.j : touches[j - walls].number;
    }
};

}  // namespace bases

}}}  // namespace nscdd::NSCDD_ABI::detail
