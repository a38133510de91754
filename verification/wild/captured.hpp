// The contact problem of a step and the velocities that a solver leaves, put together from all subdomains by the ids of
// grains. Masses are whole, normals are those of the contacts; V_free is computed anew from the grains.
#pragma once

#include <map>
#include <numeric>

#include "../small_scenes.hpp"
#include "quadratic.hpp"

namespace wild {

struct Captured {
    Quadratic problem;
    Vector v;                 // after the solve
    Vector start;             // velocities by the impulses that the solve began with; empty with friction
    Vector r;                 // of each contact, along the normal
    Vector work;              // of each contact, r_n w_n + r_t.v_t [J]
    double jump = 0;          // largest difference between copies of a body, over the largest velocity
    double inconsistent = 0;  // |V - V_free - M^-1 H r|_M over |V - V_free|_M; without friction
};

namespace detail {

// Labels of what is joined.
class Union {
  public:
    explicit Union(std::size_t count) : root_(count) { std::iota(root_.begin(), root_.end(), 0); }
    int find(int k) {
        int& root = root_[static_cast<std::size_t>(k)];
        return root == k ? k : root = find(root);
    }
    void join(int a, int b) { root_[static_cast<std::size_t>(find(a))] = find(b); }

  private:
    std::vector<int> root_;
};

template <class M>
struct Touch {
    int i, j;  // bodies, in the order of the ids; -1-w for a wall
    typename M::Vec normal;
    double bias, r, work;
};

}  // namespace detail

// Velocities by the impulses of the contacts, which a solve does not know better than to their round-off.
inline Vector by_impulses(const Captured& found) {
    const Quadratic& problem = found.problem;
    return problem.free + problem.mass.cwiseInverse().cwiseProduct(problem.h * found.r);
}

// To be called when the solver has returned, before the step is over; `start` is by_impulses() before the solve.
template <class M>
Captured capture(std::span<const nscdd::Subdomain<M>> parts, const nscdd::SimulationSettings<M>& settings,
                 const Vector& start = {}) {
    std::map<int, int> number;  // of a grain that is touched, by its id
    const auto each = [&](auto&& visit) {
        for (const auto& part : parts) {
            for (const auto& c : part.problem.contacts) visit(part, c, nscdd::BetweenGrains{});
            for (const auto& c : part.problem.wall_contacts) visit(part, c, nscdd::WithWall{});
        }
    };
    const auto id = [](const auto& part, int g) { return part.grains[static_cast<std::size_t>(g)].id; };
    each([&](const auto& part, const auto& c, auto kind) {
        number[id(part, c.i)] = 0;
        if constexpr (std::is_same_v<decltype(kind), nscdd::BetweenGrains>) number[id(part, c.j)] = 0;
    });
    int bodies = 0;
    for (auto& [name, k] : number) k = bodies++;
    const int walls = static_cast<int>(settings.walls.size());
    const auto first = [](int body) { return Eigen::Index(body) * M::dof; };
    const Eigen::Index dofs = first(bodies) + walls;

    Captured all;
    Quadratic& problem = all.problem;
    problem.mass = Vector::Ones(dofs);
    problem.free = all.v = Vector::Zero(dofs);
    for (int b = 0; b <= bodies; ++b) problem.begin.push_back(first(b));
    for (int w = 1; w <= walls; ++w) problem.begin.push_back(first(bodies) + w);
    std::vector<char> seen(static_cast<std::size_t>(bodies), 0);
    const auto note = [&](const auto& part, int g) {
        const auto& grain = part.grains[static_cast<std::size_t>(g)];
        const int body = number.at(grain.id);
        const auto at = first(body);
        const auto& v = part.problem.bodies[static_cast<std::size_t>(g)].v;
        if (seen[static_cast<std::size_t>(body)]) all.jump = std::max(all.jump, (all.v.segment(at, M::dof) - v).norm());
        seen[static_cast<std::size_t>(body)] = 1;
        all.v.segment(at, M::dof) = v;
        problem.mass.segment(at, M::dof).fill(grain.inertia);
        problem.mass.segment(at, M::dim).fill(grain.mass);
        problem.free.segment(at, M::dof) =
            grain.velocity.template head<M::dof>() +
            settings.h * grain.load.template head<M::dof>().cwiseQuotient(problem.mass.segment(at, M::dof));
        problem.free.segment(at, M::dim) += settings.h * settings.gravity;
    };
    std::vector<detail::Touch<M>> touches;
    each([&](const auto& part, const auto& c, auto kind) {
        const typename M::Impulse v = relative_velocity(part.problem, c, kind);
        double rn = c.r[0], work = 0;
        if constexpr (M::friction) {
            rn = c.r.dot(c.normal);
            work = c.r.dot(v) + rn * c.bias;
        } else {
            work = rn * (v[0] + c.bias);
        }
        note(part, c.i);
        detail::Touch<M> touch{number.at(id(part, c.i)), -1 - c.j, c.normal, c.bias, rn, work};
        if constexpr (std::is_same_v<decltype(kind), nscdd::BetweenGrains>) {
            note(part, c.j);
            touch.j = number.at(id(part, c.j));
            if (touch.i > touch.j) std::swap(touch.i, touch.j), touch.normal = -touch.normal;
        } else {
            touch.bias -= c.normal.dot(settings.walls[static_cast<std::size_t>(c.j)].velocity);
        }
        touches.push_back(touch);
    });
    for (int w = 0; w < walls; ++w) {
        const auto& wall = settings.walls[static_cast<std::size_t>(w)];
        if (!wall.driven) continue;
        problem.mass[first(bodies) + w] = wall.mass;
        problem.free[first(bodies) + w] = wall.speed + settings.h * wall.force / wall.mass;
        // subdomains that have no contact with the wall know nothing of its speed
        all.v[first(bodies) + w] = problem.free[first(bodies) + w];
        for (const auto& part : parts)
            if (std::ranges::any_of(part.problem.wall_contacts, [&](const auto& c) { return c.j == w; }))
                all.v[first(bodies) + w] = part.problem.walls[static_cast<std::size_t>(w)].speed;
    }
    std::ranges::sort(touches, [](const auto& a, const auto& b) { return std::pair(a.i, a.j) < std::pair(b.i, b.j); });

    const auto count = static_cast<Eigen::Index>(touches.size());
    std::vector<Eigen::Triplet<double>> entries;
    detail::Union joined(static_cast<std::size_t>(bodies + walls));
    problem.bias = all.r = all.work = Vector(count);
    for (Eigen::Index c = 0; c < count; ++c) {
        const auto& touch = touches[static_cast<std::size_t>(c)];
        problem.bias[c] = touch.bias, all.r[c] = touch.r, all.work[c] = touch.work;
        for (int d = 0; d < M::dim; ++d) {
            entries.emplace_back(first(touch.i) + d, c, touch.normal[d]);
            if (touch.j >= 0) entries.emplace_back(first(touch.j) + d, c, -touch.normal[d]);
        }
        const int wall = -1 - touch.j;
        if (touch.j >= 0) joined.join(touch.i, touch.j);
        if (touch.j >= 0 || !settings.walls[static_cast<std::size_t>(wall)].driven) continue;
        joined.join(touch.i, bodies + wall);
        entries.emplace_back(first(bodies) + wall, c, -1.0);
    }
    problem.h.resize(dofs, count);
    problem.h.setFromTriplets(entries.begin(), entries.end());

    std::map<int, int> labels;
    problem.component.assign(static_cast<std::size_t>(dofs), -1);
    for (int b = 0; b < bodies + walls; ++b) {
        if (b >= bodies && !settings.walls[static_cast<std::size_t>(b - bodies)].driven) continue;
        const int label = labels.emplace(joined.find(b), static_cast<int>(labels.size())).first->second;
        const auto at = b < bodies ? first(b) : first(bodies) + b - bodies;
        std::fill_n(problem.component.begin() + at, b < bodies ? M::dof : 1, label);
    }
    problem.components = static_cast<int>(labels.size());
    for (const auto& touch : touches)
        problem.contact_component.push_back(problem.component[static_cast<std::size_t>(first(touch.i))]);

    const double largest = std::max(all.v.lpNorm<Eigen::Infinity>(), problem.free.lpNorm<Eigen::Infinity>());
    if (largest > 0) all.jump /= largest;
    if constexpr (!M::friction) {
        all.start = start;
        const Vector rest = all.v - by_impulses(all);
        const double energy = problem.energies(all.v - problem.free).sum(),
                     begun = start.size() > 0 ? problem.energies(start).sum() : 0;
        // Below 1e-16 round-off of the first guess, the impulses of the step before, is more than 1e-8 of the change.
        if (energy > 1e-16 * std::max(problem.energies(all.v).sum(), begun))
            all.inconsistent = std::sqrt(problem.energies(rest).sum() / energy);
    }
    return all;
}

// Whether both are the same step from the same start.
inline bool same_problem(const Quadratic& a, const Quadratic& b) {
    const auto near = [](const Vector& x, const Vector& y) {
        return x.size() == y.size() &&
               (x.size() == 0 || (x - y).cwiseAbs().maxCoeff() <= 1e-13 * y.cwiseAbs().maxCoeff());
    };
    return near(a.mass, b.mass) && near(a.free, b.free) && near(a.bias, b.bias) && a.component == b.component &&
           a.h.nonZeros() == b.h.nonZeros() && (a.h - b.h).norm() <= 1e-13;
}

}  // namespace wild
