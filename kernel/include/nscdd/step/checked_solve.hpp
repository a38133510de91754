/// @file
/// Calls the solver of a step, which may be anybody's, and checks that it has left the contacts, bodies and walls that
/// it was given.
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/decompose/step_solver.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Collective. `step` is named in messages. Throws std::logic_error where the number of anything has changed.
template <class M>
SolveReport solve_checked(const AnyStepSolver<M>& solve, std::vector<Subdomain<M>>& parts, Communicator& comm,
                          PhaseSeconds& seconds, int step) {
    const auto sizes = [](const Subdomain<M>& part) {
        const ContactProblem<M>& p = part.problem;
        return std::array{p.contacts.size(),     p.wall_contacts.size(),     p.bodies.size(),   p.walls.size(),
                          p.multiplicity.size(), p.wall_multiplicity.size(), part.grains.size()};
    };
    constexpr std::array names{"contacts between grains", "contacts with walls",     "bodies", "walls",
                               "multiplicities",          "multiplicities of walls", "grains"};
    std::vector<std::array<std::size_t, names.size()>> given;
    for (const auto& part : parts) given.push_back(sizes(part));
    const SolveReport report = solve(parts, comm, seconds);
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t n = 0; n < names.size(); ++n)
            if (const std::size_t left = sizes(parts[k])[n]; left != given[k][n])
                throw std::logic_error("step " + std::to_string(step) + ", subdomain " + std::to_string(parts[k].rank) +
                                       ": " + names[n] + " were " + std::to_string(given[k][n]) +
                                       ", the solver has made them " + std::to_string(left));
    return report;
}

/// Writes impulses into the candidates; walls: their number. Throws std::logic_error for a contact that is no longer
/// that of its candidate.
template <class M>
void keep_impulses(Subdomain<M>& part, std::size_t walls, int step) {
    const auto keep = [&](const std::vector<Contact<M>>& contacts, const std::vector<int>& source, auto& candidates,
                          const char* name, auto&& other) {
        for (std::size_t c = 0; c < contacts.size(); ++c) {
            const auto from = c < source.size() ? static_cast<std::size_t>(source[c]) : candidates.size();
            if (from >= candidates.size() || candidates[from].i != contacts[c].i ||
                candidates[from].j != other(contacts[c]))
                throw std::logic_error("step " + std::to_string(step) + ", subdomain " + std::to_string(part.rank) +
                                       ": the solver has made " + name + std::to_string(c) + " another one");
            candidates[from].r = contacts[c].r;
        }
    };
    keep(part.problem.contacts, part.source, part.pairs, "contact ", [](const Contact<M>& c) { return c.j; });
    keep(part.problem.wall_contacts, part.wall_source, part.wall_pairs, "wall contact ",
         [&](const Contact<M>& c) { return part.number_of(c, walls); });
}

}}}  // namespace nscdd::NSCDD_ABI::detail
