/// @file
/// The distance of the velocities from an answer, component by component, and the gap error. The gap error says by how
/// much gaps would have to differ for the iterate to be an answer (METHOD.md, sections 5.4 and 5.5).
#pragma once

#include <optional>
#include <utility>

#include "nscdd/law/asked.hpp"
#include "nscdd/law/components.hpp"
#include "nscdd/law/iterate.hpp"
#include "nscdd/law/residual.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Sums over the contacts and bodies of a component. r, w, V: now; r_0, V_0: at the mark, an earlier iterate; r_1, V_1:
/// one iteration ago.
struct ComponentSums {
    double work = 0;            ///< as ResidualParts::work [J]
    double made = 0;            ///< as ResidualParts::made [J]
    double slope = 0;           ///< sum of (r - r_0).law_miss() [J]
    double moved = 0;           ///< |V - V_0|_M^2 [J]
    double last_slope = 0;      ///< sum of (r - r_1).law_miss() [J]
    double last_moved = 0;      ///< |V - V_1|_M^2 [J]
    double both_moved = 0;      ///< (V - V_0).M (V - V_1) [J]
    double change = 0;          ///< |V - V_free|_M^2 [J]
    double quartic = 0;         ///< as VelocityChange::quartic
    double alone = 0;           ///< sum of m Asked::square() over its grains [J]
    double closing = 0;         ///< of acting contacts, sum of |w_n| [m/s]
    double closing_square = 0;  ///< of acting contacts, sum of -w_n |w_n| [m^2/s^2]
    double gap_error = 0;       ///< largest change of a gap that its contact asks for, over its radius
    double miss = 0;            ///< as ResidualParts::miss [m/s]
    /// What reduce() adds up.
    auto summed() {
        return std::tie(work, made, slope, moved, last_slope, last_moved, both_moved, change, quartic, alone, closing,
                        closing_square);
    }
    auto largest() { return std::tie(gap_error, miss); }  ///< what it takes the largest of

    /// Takes in another part of the component.
    ComponentSums& operator+=(const ComponentSums& other) {
        work += other.work, made += other.made, change += other.change, quartic += other.quartic;
        slope += other.slope, moved += other.moved;
        last_slope += other.last_slope, last_moved += other.last_moved, both_moved += other.both_moved;
        alone += other.alone, closing += other.closing, closing_square += other.closing_square;
        gap_error = (std::max)(gap_error, other.gap_error), miss = (std::max)(miss, other.miss);
        return *this;
    }
};

/// What is said of a whole scene.
struct DistanceEstimate {
    double worst = 0;        ///< estimate of |V - V*|_M / |V* - V_free|_M, of the component where it is largest
    double scene = 0;        ///< the same of all components together
    double energy_gain = 0;  ///< of the component where it is largest, over its own |V - V_free|_M^2
    /// Largest change of a gap that would make the iterate exact, over the contact's least radius.
    double gap_error = 0;
    auto summed() { return std::tie(); }                                ///< reduce() adds up no member
    auto largest() { return std::tie(worst, energy_gain, gap_error); }  ///< what reduce() takes the largest of

    /// Takes in one component. residual: of the scene.
    void note(const ComponentSums& sums, double mass, double length, const ResidualParts& residual) {
        take(gap_error, sums.gap_error);
        if (residual.eta() == 0) return;
        // A component that moves less than 1e-4 of what the scene does on average is judged as if it did.
        const double mean = residual.mean_change();
        const double scale = (std::max)({sums.change, 1e-8 * mean * mean * mass, 1e-16 * residual.round_off});
        take(worst, from_lines(sums, scale));
        // Grains put right one by one: between two contacts that are nearly in line they move far.
        take(worst, std::sqrt(sums.alone / scale));
        // Contacts that close by the same speed in a row of `length` grains move its end by their sum; those that open
        // take away from it.
        if (sums.closing_square > 0)
            take(worst, 0.6 * length * sums.closing_square / sums.closing / std::sqrt(scale / mass));
        // The velocity error of the component by its worst contact, in the measure of a distance.
        const double own = sums.change > 0 ? std::sqrt(sums.quartic / sums.change) : 0;
        if (sums.miss > 0) take(worst, 3 * sums.miss / (std::max)(own, 1e-4 * mean));
        take(energy_gain, sums.made > 0 ? sums.made / scale : 0);
    }
    /// Takes in the estimate of one component.
    void note(const DistanceEstimate& other) {
        take(worst, other.worst), take(energy_gain, other.energy_gain), take(gap_error, other.gap_error);
    }
    /// Takes in the sums over all components.
    void note_scene(const ComponentSums& sums, const ResidualParts& residual) {
        scene = residual.eta() == 0 ? 0 : from_lines(sums, residual.scale());
    }

  private:
    static void take(double& most, double value) {  // the larger one, NaN if one is
        if (value > most || std::isnan(value)) most = std::isnan(most) ? most : value;
    }
    /// The larger of two relative distances: the root of A, the work that the law forbids, and sigma, the distance to
    /// the best point in the plane of the lines through the mark and through the last iterate.
    static double from_lines(const ComponentSums& sums, double scale) {
        if (sums.work == 0 && sums.slope == 0 && sums.last_slope == 0) return 0;
        // what round-off moves by itself: a line so short leads anywhere
        const double least = 1e-24 * scale, moved = (std::max)(sums.moved, least);
        double square = 0, across = sums.last_slope, length = sums.last_moved;
        if (sums.slope != 0) {
            square += sums.slope / moved * sums.slope;
            across -= sums.both_moved / moved * sums.slope;
            length -= sums.both_moved / moved * sums.both_moved;
        }
        // lines so nearly parallel say the same
        if (length > (std::max)(1e-6 * sums.last_moved, least)) square += across / length * across;
        take(square, sums.work);
        return std::sqrt(square / scale);
    }
};

/// The least change of w [m/s], in the axes of the impulse, after which a contact satisfies its law with the impulse
/// that it has: 0 at an answer. The impulse must be one that the law allows, as after a sweep. An impulse that changes
/// w_n by less than 1e-12 of it or of the relative velocity is none: solvers that only halve it never end at 0. wn: W_n
/// [1/kg].
template <class M>
typename M::Impulse law_miss(const Contact<M>& c, const typename M::Impulse& v, double wn) {
    const auto none = [wn, speed = force_of<M>(v).norm()](double opening, double excess) {
        return wn * excess <= 1e-12 * (std::max)(std::abs(opening), speed);
    };
    const auto normal_miss = [none](double opening, double excess) {
        return none(opening, excess) ? (std::max)(-opening, 0.0) : -opening;
    };
    if constexpr (M::friction) {
        const auto& velocity = force_of<M>(v);
        const auto& force = force_of<M>(c.r);
        const double vn = velocity.dot(c.normal), rn = force.dot(c.normal), limit = M::Law::limit(rn, c);
        const typename M::Vec normal = normal_miss(vn + c.bias, M::Law::excess(rn, c)) * c.normal;
        if constexpr (M::rolling) {
            if (none(vn + c.bias, M::Law::excess(rn, c))) return with_couple<M>(normal, M::Spin::Zero());
            return with_couple<M>(
                normal + held_miss<typename M::Vec>(force - rn * c.normal, velocity - vn * c.normal, limit),
                couple_miss(c, couple_of<M>(v), rn));
        } else {
            if (!(limit > 0) || none(vn + c.bias, M::Law::excess(rn, c))) return normal;
            const typename M::Vec slip = v - vn * c.normal, rt = c.r - rn * c.normal;
            const double along = rt.dot(slip), square = rt.squaredNorm();
            // as large as it may be, but for round-off, r_t may oppose a slip; else it holds the contact
            if (along < 0 && square >= limit * limit * (1 - 1e-9)) return normal + along / square * rt - slip;
            return normal - slip;
        }
    } else {
        return typename M::Impulse{normal_miss(v[0] + c.bias, M::Law::excess(c.r[0], c))};
    }
}

/// By how much one contact alone misses its law, |W_cc (r' - r)| [m/s]; w: of whole masses.
template <class M>
double contact_miss(const Contact<M>& c, const typename M::Impulse& v, const DelassusDiagonal& w) {
    if constexpr (M::friction) {
        SpinBlock spin;
        if constexpr (M::rolling) spin = {1 / w.spin, w.coupling};
        const typename M::Impulse changes = solve_contact<M>(c, v, 1 / w.normal, 1 / w.tangential, spin) - c.r;
        const auto& change = force_of<M>(changes);
        const double normal = change.dot(c.normal), tangential = (change - normal * c.normal).norm();
        double square = w.normal * normal * w.normal * normal + w.tangential * tangential * w.tangential * tangential;
        if constexpr (M::rolling)  // a spin counts by the length sqrt(W_n/W_s)
            square += w.normal * w.spin * couple_of<M>(changes).squaredNorm();
        return std::sqrt(square);
    } else {
        return w.normal * std::abs(solve_contact<M>(c, v, 1 / w.normal, 0)[0] - c.r[0]);
    }
}

/// The sums of one problem whose velocities are glued. Its components are found when first asked for.
template <class M>
class DistanceSums {
  public:
    std::vector<ComponentSums> components;  ///< by label
    std::vector<Asked<M>> asked;            ///< of each body, by this problem's contacts

    /// Before the first iteration: velocities are V_free + M^-1 H r of the warm start.
    void begin(const ContactProblem<M>& problem, FreeVelocities<M> free) {
        free_ = std::move(free);
        labels_.reset();
        shapes_.clear();
        mark(problem);
    }
    /// Velocities of these impulses: V_free + M^-1 H r, with the inverse masses as they stand.
    void set_velocities(ContactProblem<M>& problem) const {
        for (std::size_t b = 0; b < problem.bodies.size(); ++b) problem.bodies[b].v = free_.bodies[b];
        for (std::size_t w = 0; w < problem.walls.size(); ++w) problem.walls[w].speed = free_.walls[w];
        for (const auto& c : problem.contacts) apply_impulse(problem, c, c.r, BetweenGrains{});
        for (const auto& c : problem.wall_contacts) apply_impulse(problem, c, c.r, WithWall{});
    }
    /// The iterate as it is becomes the mark.
    void mark(const ContactProblem<M>& problem) { mark_.take(problem); }
    const FreeVelocities<M>& free() const { return free_; }  ///< of begin()
    /// The components, found when first asked for.
    const Components<M>& labels(const ContactProblem<M>& problem) {
        if (!labels_) labels_.emplace(problem);
        return *labels_;
    }
    /// Their shapes, likewise.
    const std::vector<ComponentShape<M>>& shapes(const ContactProblem<M>& problem) {
        if (shapes_.empty()) shapes_ = labels(problem).shapes(problem);
        return shapes_;
    }
    /// Sums over the components of the iterate as it is. last: the one before it; may be null.
    void add_up(const ContactProblem<M>& problem, const Iterate<M>* last) {
        add_contacts(problem, last);
        add_bodies(problem);
    }
    /// The first part of add_up(). After it the copies of a body add up their parts.
    void add_contacts(const ContactProblem<M>& problem, const Iterate<M>* last) {
        last_ = last ? last : &mark_;
        const Components<M>& labels = this->labels(problem);
        components.assign(labels.count(), {});
        asked.assign(problem.bodies.size(), {});
        std::size_t k = 0;
        const auto add_contact = [&](const Contact<M>& c, auto kind, int label) {
            add(problem, c, kind, c.r - mark_.impulses[k], c.r - last_->impulses[k], at(label));
            ++k;
        };
        for (const Contact<M>& c : problem.wall_contacts) add_contact(c, WithWall{}, labels.of_wall_contact(c));
        for (const Contact<M>& c : problem.contacts) add_contact(c, BetweenGrains{}, labels.of(c));
    }
    /// The second part of add_up().
    void add_bodies(const ContactProblem<M>& problem) {
        const Components<M>& labels = this->labels(problem);
        for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
            if (labels.of_body(b) < 0) continue;
            const Body<M>& body = problem.bodies[b];
            ComponentSums& sums = at(labels.of_body(b));
            const typename M::Velocity moved = body.v - mark_.velocities[b], last_moved = body.v - last_->velocities[b],
                                       change = body.v - free_.bodies[b];
            sums.moved += product(body, moved, moved);
            sums.last_moved += product(body, last_moved, last_moved);
            sums.both_moved += product(body, moved, last_moved);
            sums.alone += asked[b].square() / body.inv_mass;
            add_change(sums, product(body, change, change), body.inv_mass);
        }
        for (std::size_t w = 0; w < problem.walls.size(); ++w) {
            if (labels.of_wall(w) < 0) continue;
            const double speed = problem.walls[w].speed, mass = 1 / problem.walls[w].inv_mass;
            ComponentSums& sums = at(labels.of_wall(w));
            const double moved = speed - mark_.speeds[w], last_moved = speed - last_->speeds[w];
            sums.moved += mass * moved * moved;
            sums.last_moved += mass * last_moved * last_moved;
            sums.both_moved += mass * moved * last_moved;
            add_change(sums, mass * (speed - free_.walls[w]) * (speed - free_.walls[w]), problem.walls[w].inv_mass);
        }
    }

  private:
    ComponentSums& at(int label) { return components[static_cast<std::size_t>(label)]; }
    static void add_change(ComponentSums& sums, double energy, double inverse_mass) {
        sums.change += energy;
        sums.quartic += energy * energy * inverse_mass;
    }
    /// u.M v [J].
    static double product(const Body<M>& body, const typename M::Velocity& u, const typename M::Velocity& v) {
        double sum = u.template head<M::dim>().dot(v.template head<M::dim>()) / body.inv_mass;
        if constexpr (M::friction)
            if (body.inv_inertia > 0)
                sum += u.template tail<M::spins>().dot(v.template tail<M::spins>()) / body.inv_inertia;
        return sum;
    }
    /// since_mark, since_last: changes of its impulse. flatten: GCC leaves calls for products of three numbers.
    [[gnu::flatten]] void add(const ContactProblem<M>& problem, const Contact<M>& c, auto kind,
                              const typename M::Impulse& since_mark, const typename M::Impulse& since_last,
                              ComponentSums& sums) {
        const typename M::Impulse v = relative_velocity(problem, c, kind);
        const DelassusDiagonal w = delassus(problem, c, false, kind);
        const typename M::Impulse miss = law_miss(c, v, w.normal);
        double opening, excess, along = 0, limit = 0;
        if constexpr (M::friction) {
            const auto& velocity = force_of<M>(v);
            const double vn = velocity.dot(c.normal), rn = force_of<M>(c.r).dot(c.normal);
            opening = vn + c.bias, excess = M::Law::excess(rn, c);
            along = c.r.dot(v) - rn * vn, limit = M::Law::limit(rn, c) * (velocity - vn * c.normal).norm();
            if constexpr (M::rolling) limit += couple_limit(c, couple_of<M>(v), rn);
            sums.made += rn * opening + along;
        } else {
            opening = v[0] + c.bias, excess = M::Law::excess(c.r[0], c);
            sums.made += c.r[0] * opening;
        }
        sums.work += std::abs(excess * opening) + limit + along;
        sums.slope += since_mark.dot(miss);
        sums.last_slope += since_last.dot(miss);
        if (excess > 0 || opening < 0)
            sums.closing += std::abs(opening), sums.closing_square -= opening * std::abs(opening);
        sums.miss = (std::max)(sums.miss, contact_miss(c, v, w));
        if (excess > 0 || opening < 0) ask(c, miss, kind);
        if (problem.radii.empty()) return;
        double radius = problem.radii[static_cast<std::size_t>(c.i)];
        if constexpr (std::is_same_v<decltype(kind), BetweenGrains>)
            radius = (std::min)(radius, problem.radii[static_cast<std::size_t>(c.j)]);
        double way = force_of<M>(miss).norm();
        if constexpr (M::rolling) way = std::sqrt(way * way + radius * radius * couple_of<M>(miss).squaredNorm());
        sums.gap_error = (std::max)(sums.gap_error, problem.h * way / radius);
    }

    /// What an acting contact asks of its bodies. It holds its normal, and all directions where friction holds it.
    void ask(const Contact<M>& c, const typename M::Impulse& miss, auto kind) {
        typename Asked<M>::Matrix holds = c.normal * c.normal.transpose();
        typename M::Vec misses;
        if constexpr (M::friction) {
            const auto& force = force_of<M>(c.r);
            const double rn = force.dot(c.normal);
            misses = force_of<M>(miss).dot(c.normal) * c.normal;
            if ((force - rn * c.normal).norm() < M::Law::limit(rn, c) * (1 - 1e-9))
                holds.setIdentity(), misses = force_of<M>(miss);
        } else {
            misses = miss[0] * c.normal;
        }
        asked[static_cast<std::size_t>(c.i)].add(holds, misses, 1);
        if constexpr (std::is_same_v<decltype(kind), BetweenGrains>)
            asked[static_cast<std::size_t>(c.j)].add(holds, misses, -1);
    }

    FreeVelocities<M> free_;
    std::optional<Components<M>> labels_;
    std::vector<ComponentShape<M>> shapes_;
    Iterate<M> mark_;
    const Iterate<M>* last_ = nullptr;  ///< between add_contacts() and add_bodies()
};

/// The estimate of a whole scene in one problem. last: the iterate before this one; may be null.
template <class M>
DistanceEstimate estimate_distance(const ContactProblem<M>& problem, DistanceSums<M>& sums,
                                   const ResidualParts& residual, const Iterate<M>* last) {
    sums.add_up(problem, last);
    const std::vector<ComponentShape<M>>& shapes = sums.shapes(problem);
    DistanceEstimate estimate;
    ComponentSums scene;
    for (std::size_t k = 0; k < shapes.size(); ++k) {
        estimate.note(sums.components[k], shapes[k].mass, shapes[k].length(), residual);
        scene += sums.components[k];
    }
    estimate.note_scene(scene, residual);
    return estimate;
}

}}}  // namespace nscdd::NSCDD_ABI::detail
