/// @file
/// A problem divided into subdomains, with copies of the bodies that they share (METHOD.md, section 6.1). It is for
/// readers.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "nscdd/core/contact_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace plain {

/// A subdomain: the contacts that it owns, with copies of their bodies. Masses of copies are split (METHOD.md, section
/// 6.1).
template <class M>
struct Part {
    ContactProblem<M> problem;               ///< of the subdomain alone
    std::vector<std::size_t> bodies;         ///< body of each copy in the whole problem
    std::vector<std::size_t> contacts;       ///< number of each contact in the whole problem
    std::vector<std::size_t> wall_contacts;  ///< number of each contact with a wall there
};

/// Deals contacts to `count` subdomains. `owner` is that of each contact between grains, `owner_at_wall` of each with a
/// wall.
template <class M>
std::vector<Part<M>> split(const ContactProblem<M>& whole, std::span<const int> owner,
                           std::span<const int> owner_at_wall, int count) {
    std::vector<Part<M>> parts(static_cast<std::size_t>(count));
    std::vector<std::map<int, int>> copy_of(parts.size());
    const auto copy = [&](std::size_t e, int body) {
        const auto [found, is_new] = copy_of[e].try_emplace(body, static_cast<int>(parts[e].bodies.size()));
        if (is_new) parts[e].bodies.push_back(static_cast<std::size_t>(body));
        return found->second;
    };
    for (std::size_t c = 0; c < whole.contacts.size(); ++c) {
        const auto e = static_cast<std::size_t>(owner[c]);
        Contact<M>& own = parts[e].problem.contacts.emplace_back(whole.contacts[c]);
        own.i = copy(e, own.i), own.j = copy(e, own.j);
        parts[e].contacts.push_back(c);
    }
    for (std::size_t c = 0; c < whole.wall_contacts.size(); ++c) {
        const auto e = static_cast<std::size_t>(owner_at_wall[c]);
        parts[e].problem.wall_contacts.emplace_back(whole.wall_contacts[c]).i = copy(e, whole.wall_contacts[c].i);
        parts[e].wall_contacts.push_back(c);
    }
    std::vector<int> multiplicity(whole.bodies.size(), 0);
    for (const Part<M>& part : parts)
        for (const std::size_t body : part.bodies) ++multiplicity[body];
    for (Part<M>& part : parts) {
        part.problem.walls = whole.walls;
        for (const std::size_t body :
             part.bodies) {  // M_E: the mass of a copy is that of the body over its multiplicity
            Body<M>& own = part.problem.bodies.emplace_back(whole.bodies[body]);
            own.inv_mass *= multiplicity[body];
            if constexpr (M::friction) own.inv_inertia *= multiplicity[body];
        }
    }
    return parts;
}

}}}  // namespace nscdd::NSCDD_ABI::plain
