/// @file
/// Checks of a problem, done once before a solve. Without them solvers would write past their arrays, or call an answer
/// converged that is none.
/// ```
/// nscdd::validate(problem);       // throws std::invalid_argument: "contact 3: it touches body 7, but there are 5"
/// ```
/// Numbers count from 0, as in the vectors. A first pass asks only whether anything is wrong; a second one then says
/// what it is.
#pragma once

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "nscdd/core/contact_problem.hpp"
#include "nscdd/core/delassus_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

inline bool is_finite(double x) { return std::abs(x) <= (std::numeric_limits<double>::max)(); }
inline bool is_mass(double inverse) { return inverse >= 0 && inverse <= (std::numeric_limits<double>::max)(); }

/// One contact of a problem. Without branches, as all contacts are checked.
template <bool wall, class M>
bool is_sound(const Contact<M>& c, std::size_t bodies, std::size_t others) {
    double sum = c.bias + c.r.sum();
    bool sound = std::abs(c.normal.squaredNorm() - 1) <= 1e-6;
    if constexpr (M::friction) {
        sum += c.lever_i + c.lever_j;
    }
    sound &= M::Law::fault(c) == nullptr;
    // a negative index becomes one that is far too large
    sound &= static_cast<std::size_t>(c.i) < bodies;
    sound &= static_cast<std::size_t>(c.j) < others;
    if constexpr (!wall) sound &= c.i != c.j;
    sound &= is_finite(sum);
    return sound;
}

/// What is wrong with a contact; empty: nothing. Indices are checked first, because the last lines use them.
template <bool wall, class M>
std::string fault(const ContactProblem<M>& problem, const Contact<M>& c) {
    const auto missing = [](const char* what, int index, std::size_t count) {
        return std::string("it touches ") + what + " " + std::to_string(index) + ", but there are " +
               std::to_string(count);
    };
    const auto i = static_cast<std::size_t>(c.i), j = static_cast<std::size_t>(c.j);
    if (i >= problem.bodies.size()) return missing("body", c.i, problem.bodies.size());
    if (wall && j >= problem.walls.size()) return missing("wall", c.j, problem.walls.size());
    if (!wall && j >= problem.bodies.size()) return missing("body", c.j, problem.bodies.size());
    if (!wall && i == j) return "it touches body " + std::to_string(c.i) + " twice";
    if (!(std::abs(c.normal.squaredNorm() - 1) <= 1e-6)) return "the normal is not a unit vector";
    if (!is_finite(c.bias)) return "the bias is not finite";
    if (!c.r.allFinite()) return "the impulse is not finite";
    double inverse = problem.bodies[i].inv_mass, sideways = inverse;
    if constexpr (!wall) {
        inverse += problem.bodies[j].inv_mass;
        sideways = inverse;
    } else {
        inverse += problem.walls[j].inv_mass;
    }
    if (const char* what = M::Law::fault(c)) return what;
    if constexpr (M::friction) {
        if (!is_finite(c.lever_i) || !is_finite(c.lever_j)) return "a lever is not finite";
        sideways += c.lever_i * c.lever_i * problem.bodies[i].inv_inertia;
        if (wall) sideways += problem.walls[j].inv_mass;  // friction on a fixed body, which moves nothing
        if (!wall) sideways += c.lever_j * c.lever_j * problem.bodies[j].inv_inertia;
    }
    if constexpr (M::rolling) {
        double turns = problem.bodies[i].inv_inertia;
        turns += wall ? problem.walls[j].inv_mass : problem.bodies[j].inv_inertia;
        if (!(turns > 0)) return "neither side can turn: both inverse inertias are 0";
    }
    if (!(inverse > 0) || (M::friction && !(sideways > 0))) return "neither side can move: both inverse masses are 0";
    return {};
}

inline constexpr std::size_t no_number = static_cast<std::size_t>(-1);

inline void demand(bool sound, const char* what, std::size_t number, const std::string& fault) {
    if (sound) return;
    throw std::invalid_argument(what + (number == no_number ? "" : " " + std::to_string(number)) + ": " + fault);
}
inline void demand(bool sound, const char* what, std::size_t number, const char* fault) {
    if (!sound) demand(false, what, number, std::string(fault));
}

inline void require_multiplicities(const char* what, const std::vector<int>& of, std::size_t count) {
    if (!of.empty() && of.size() != count)
        demand(false, what, no_number,
               std::to_string(of.size()) + " multiplicities for " + std::to_string(count) + ", and not none");
    for (std::size_t k = 0; k < of.size(); ++k)
        if (of[k] < 1) demand(false, what, k, "the multiplicity is " + std::to_string(of[k]) + ", needs at least 1");
}

/// Throws if there is a fault.
template <class M>
void name_fault(const ContactProblem<M>& problem) {
    demand(problem.h > 0 && is_finite(problem.h), "the step h", no_number, "it is not positive and finite");
    demand(is_mass(problem.least_radius), "the least radius", no_number, "it is negative or not finite");
    for (std::size_t k = 0; k < problem.bodies.size(); ++k) {
        const Body<M>& body = problem.bodies[k];
        demand(body.v.allFinite(), "body", k, "the velocity is not finite");
        demand(is_mass(body.inv_mass), "body", k, "the inverse mass is negative or not finite");
        if constexpr (M::friction)
            demand(is_mass(body.inv_inertia), "body", k, "the inverse inertia is negative or not finite");
    }
    for (std::size_t k = 0; k < problem.walls.size(); ++k) {
        const WallBody<M>& wall = problem.walls[k];
        demand(wall.prescribed.allFinite(), "wall", k, "the velocity is not finite");
        demand(is_finite(wall.speed), "wall", k, "the speed is not finite");
        demand(is_mass(wall.inv_mass), "wall", k, "the inverse mass is negative or not finite");
    }
    require_multiplicities("bodies", problem.multiplicity, problem.bodies.size());
    require_multiplicities("walls", problem.wall_multiplicity, problem.walls.size());
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
        const std::string what = fault<false>(problem, problem.contacts[k]);
        demand(what.empty(), "contact", k, what);
    }
    for (std::size_t k = 0; k < problem.wall_contacts.size(); ++k) {
        const std::string what = fault<true>(problem, problem.wall_contacts[k]);
        demand(what.empty(), "wall contact", k, what);
    }
}

}  // namespace detail

/// Throws std::invalid_argument that names the fault. The check takes 3 to 5 ns a contact, less than half a sweep: 1 to
/// 3 % of a solve of ten iterations. The functions nlgs(), newton_solve() and projected_gradient() make it by
/// themselves, once. The solvers by_nlgs() and by_nscdd() do not, because their problems come from our own detection.
template <class M>
void validate(const ContactProblem<M>& problem) {
    bool sound = problem.h > 0 && detail::is_finite(problem.h) && detail::is_mass(problem.least_radius);
    bool all_move = true;
    for (const Body<M>& body : problem.bodies) {
        sound &= detail::is_finite(body.v.sum());
        sound &= detail::is_mass(body.inv_mass);
        all_move &= body.inv_mass > 0;
        if constexpr (M::friction) sound &= detail::is_mass(body.inv_inertia);
        if constexpr (M::rolling) all_move &= body.inv_inertia > 0;
    }
    for (const WallBody<M>& wall : problem.walls) {
        sound &= detail::is_finite(wall.prescribed.sum());
        sound &= detail::is_finite(wall.speed);
        sound &= detail::is_mass(wall.inv_mass);
    }
    const std::size_t bodies = problem.bodies.size(), walls = problem.walls.size();
    sound &= problem.multiplicity.empty() || problem.multiplicity.size() == bodies;
    sound &= problem.wall_multiplicity.empty() || problem.wall_multiplicity.size() == walls;
    for (const int m : problem.multiplicity) sound &= m >= 1;
    for (const int m : problem.wall_multiplicity) sound &= m >= 1;
    for (const Contact<M>& c : problem.contacts) sound &= detail::is_sound<false>(c, bodies, bodies);
    for (const Contact<M>& c : problem.wall_contacts) sound &= detail::is_sound<true>(c, bodies, walls);
    // only the second pass knows which bodies meet; sums that overflow are no fault either
    if (!sound || !all_move) detail::name_fault(problem);
}

/// Throws std::invalid_argument unless W has the shape that DelassusProblem says, all numbers are finite, and r has one
/// impulse for each contact.
template <int dim, bool rolls>
void validate(const DelassusProblem<dim, rolls>& problem,
              const std::vector<typename DelassusProblem<dim, rolls>::Vec>& r) {
    const std::size_t count = problem.contact_count(), stored = problem.blocks.size();
    const auto sizes = [](const char* what, std::size_t is, std::size_t should) {
        if (is != should)
            detail::demand(false, what, detail::no_number,
                           std::to_string(is) + " of them, needs " + std::to_string(should));
    };
    sizes("coefficients of friction", problem.friction.size(), count);
    if constexpr (rolls) sizes("coefficients of rolling", problem.rolling.size(), count);
    sizes("impulses r", r.size(), count);
    sizes("ends of the rows of W", problem.row_begin.size(), count + 1);
    sizes("diagonal blocks of W", problem.diagonal.size(), count);
    sizes("columns of the blocks of W", problem.columns.size(), stored);
    sizes("blocks within the rows of W", static_cast<std::size_t>(problem.row_begin.back()), stored);
    for (std::size_t c = 0; c < count; ++c) {
        const auto here = [c](bool sound, const char* fault) { detail::demand(sound, "contact", c, fault); };
        const int begin = problem.row_begin[c], end = problem.row_begin[c + 1], own = problem.diagonal[c];
        here(c > 0 || begin == 0, "its row of W does not begin at 0");
        here(begin <= end && static_cast<std::size_t>(end) <= stored, "its row of W ends before it begins");
        here(own >= begin && own < end && problem.columns[static_cast<std::size_t>(own)] == static_cast<int>(c),
             "its diagonal block is not in its row of W");
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
            here(problem.columns[k] >= 0 && static_cast<std::size_t>(problem.columns[k]) < count,
                 "a column of W belongs to no contact");
            here(k == static_cast<std::size_t>(begin) || problem.columns[k - 1] < problem.columns[k],
                 "the columns of its row of W do not ascend");
            here(problem.blocks[k].allFinite(), "a block of W is not finite");
        }
        here(problem.q[c].allFinite(), "q is not finite");
        here(r[c].allFinite(), "the impulse is not finite");
        here(detail::is_mass(problem.friction[c]), "the coefficient of friction is negative or not finite");
        if constexpr (rolls)
            here(detail::is_mass(problem.rolling[c]), "the coefficient of rolling is negative or not finite");
    }
}

}}  // namespace nscdd::NSCDD_ABI
