/// @file
/// The components of a scene: bodies that contacts join. A change in one of them does not reach another.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "nscdd/core/contact_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Sets that are joined two by two.
class UnionFind {
  public:
    /// `count` sets of one member.
    explicit UnionFind(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
    /// The member that stands for the set of k.
    int find(int k) {
        while (parent(k) != k) k = parent(k) = parent(parent(k));
        return k;
    }
    /// Makes one set of those of a and b.
    void join(int a, int b) {
        a = find(a), b = find(b);
        parent((std::max)(a, b)) = (std::min)(a, b);
    }

  private:
    int& parent(int k) { return parent_[static_cast<std::size_t>(k)]; }
    std::vector<int> parent_;
};

/// Size and shape of a component. Copies of a body count for their share of it, so that parts add up.
template <class M>
struct ComponentShape {
    double mass = 0;                       ///< of bodies and driven walls [kg]
    double bodies = 0;                     ///< grains
    double contacts = 0;                   ///< all of them
    double pairs = 0;                      ///< those between grains
    double closeness = 0;                  ///< sum over them of the inverse distance of centres [1/m]
    typename M::Vec minus_low = lowest();  ///< box round the centres: minus its lower corner [m]
    typename M::Vec high = lowest();       ///< and its upper one [m]
    auto summed() { return std::tie(mass, bodies, contacts, pairs, closeness); }  ///< what reduce() adds up
    auto largest() { return std::tie(minus_low, high); }  ///< what reduce() takes the largest of

    /// Takes in another part of the component.
    void merge(const ComponentShape& part) {
        mass += part.mass, bodies += part.bodies, contacts += part.contacts, pairs += part.pairs;
        closeness += part.closeness;
        minus_low = minus_low.cwiseMax(part.minus_low), high = high.cwiseMax(part.high);
    }
    /// Number of grains from one end to the other: the longest edge of the box over the harmonic mean distance of
    /// neighbours, in which small grains count. Of a chain, which a box may hold folded, all its grains; without known
    /// centres as many as a cube has along an edge.
    double length() const {
        if (pairs == 0) return 1;
        if (pairs < 1.1 * bodies) return bodies;
        if (!(closeness > 0)) return std::pow(bodies, 1.0 / M::dim);
        return 1 + (high + minus_low).maxCoeff() * closeness / pairs;
    }

  private:
    static typename M::Vec lowest() { return M::Vec::Constant(std::numeric_limits<double>::lowest()); }
};

/// Labels of the components of one problem. Grains and driven walls join what touches them; fixed walls, those with
/// prescribed motion and bodies without inverse mass do not.
template <class M>
class Components {
  public:
    /// Of the problem as it stands.
    explicit Components(const ContactProblem<M>& problem)
        : of_body_(problem.bodies.size(), -1), of_wall_(problem.walls.size(), -1) {
        const auto bodies = static_cast<int>(of_body_.size());
        UnionFind sets(of_body_.size() + of_wall_.size());
        const auto moves = [&problem](int body) { return problem.bodies[index(body)].inv_mass > 0; };
        const auto driven = [&problem](int wall) { return problem.walls[index(wall)].inv_mass > 0; };
        for (const auto& c : problem.contacts)
            if (moves(c.i) && moves(c.j)) sets.join(c.i, c.j);
        for (const auto& c : problem.wall_contacts)
            if (moves(c.i) && driven(c.j)) sets.join(c.i, bodies + c.j);
        const auto push_sides = [&](auto&& visit) {  // contacts between grains push the sides of a cell
            if (problem.flow && !problem.contacts.empty())
                for (const int side : problem.flow->side)
                    if (side >= 0) visit(side);
        };
        push_sides([&](int side) {
            for (const auto& c : problem.contacts) sets.join(moves(c.i) ? c.i : c.j, bodies + side);
        });
        std::vector<int> number(of_body_.size() + of_wall_.size(), -1);
        const auto label = [&](int member) {
            int& own = number[index(sets.find(member))];
            if (own < 0) own = count_++;
            return own;
        };
        const auto note_body = [&](int body) {
            if (of_body_[index(body)] < 0 && moves(body)) of_body_[index(body)] = label(body);
        };
        for (const auto& c : problem.contacts) note_body(c.i), note_body(c.j);
        push_sides([&](int side) { of_wall_[index(side)] = label(bodies + side); });
        for (const auto& c : problem.wall_contacts) {
            note_body(c.i);
            if (driven(c.j)) of_wall_[index(c.j)] = label(bodies + c.j);
        }
    }

    std::size_t count() const { return index(count_); }             ///< number of components
    int of_body(std::size_t body) const { return of_body_[body]; }  ///< -1: no contact
    int of_wall(std::size_t wall) const { return of_wall_[wall]; }  ///< -1: not driven, or no contact
    /// Label of a contact between grains.
    int of(const Contact<M>& c) const {
        return (std::max)(of_body(index(c.i)), of_body(index(c.j)));
    }  // between grains
    /// Label of a contact with a wall.
    int of_wall_contact(const Contact<M>& c) const { return (std::max)(of_body(index(c.i)), of_wall(index(c.j))); }

    /// By label.
    std::vector<ComponentShape<M>> shapes(const ContactProblem<M>& problem) const {
        std::vector<ComponentShape<M>> shapes(count());
        for (std::size_t b = 0; b < of_body_.size(); ++b) {
            if (of_body_[b] < 0) continue;
            ComponentShape<M>& shape = shapes[index(of_body_[b])];
            shape.mass += 1 / problem.bodies[b].inv_mass;
            shape.bodies += 1.0 / problem.copies(b);
            if (problem.centres.empty()) continue;
            shape.minus_low = shape.minus_low.cwiseMax(-problem.centres[b]);
            shape.high = shape.high.cwiseMax(problem.centres[b]);
        }
        for (std::size_t w = 0; w < of_wall_.size(); ++w)
            if (of_wall_[w] >= 0) shapes[index(of_wall_[w])].mass += 1 / problem.walls[w].inv_mass;
        for (const auto& c : problem.wall_contacts)
            if (of_wall_contact(c) >= 0) ++shapes[index(of_wall_contact(c))].contacts;
        for (const auto& c : problem.contacts) {
            const int own = of(c);
            if (own < 0) continue;
            ++shapes[index(own)].contacts, ++shapes[index(own)].pairs;
            if (problem.centres.empty()) continue;
            const auto i = index(c.i), j = index(c.j);
            const double apart = (problem.centres[i] - problem.centres[j]).norm(),
                         sum = problem.radii.empty() ? apart : problem.radii[i] + problem.radii[j];
            shapes[index(own)].closeness += 1 / (apart < 2 * sum ? apart : sum);  // beyond: it touches an image
        }
        return shapes;
    }

  private:
    static std::size_t index(int k) { return static_cast<std::size_t>(k); }

    std::vector<int> of_body_, of_wall_;
    int count_ = 0;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
