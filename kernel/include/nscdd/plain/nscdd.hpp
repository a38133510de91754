/// @file
/// NSCDD: Alg. 1 of the paper, written as in METHOD.md, section 6. All subdomains are in one loop, without
/// communication. It is for readers; nscdd_solve() of decompose/ is the fast one.
#pragma once

#include <span>
#include <stdexcept>
#include <vector>

#include "nscdd/plain/nlgs.hpp"
#include "nscdd/plain/split.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace plain {

/// Glues in closed form. As copies of a body have equal masses, it moves with the mean of their velocities. Impulses go
/// to the whole problem as well.
template <class M>
void glue(std::vector<Part<M>>& parts, ContactProblem<M>& whole) {
    std::vector<int> copies(whole.bodies.size(), 0);
    for (const Part<M>& part : parts)
        for (std::size_t k = 0; k < part.bodies.size(); ++k) {
            if (copies[part.bodies[k]]++ == 0) whole.bodies[part.bodies[k]].v.setZero();
            whole.bodies[part.bodies[k]].v += part.problem.bodies[k].v;
        }
    for (std::size_t g = 0; g < copies.size(); ++g)
        if (copies[g] > 1) whole.bodies[g].v /= copies[g];
    for (Part<M>& part : parts) {
        for (std::size_t k = 0; k < part.bodies.size(); ++k) part.problem.bodies[k].v = whole.bodies[part.bodies[k]].v;
        for (std::size_t c = 0; c < part.contacts.size(); ++c)
            whole.contacts[part.contacts[c]].r = part.problem.contacts[c].r;
        for (std::size_t c = 0; c < part.wall_contacts.size(); ++c)
            whole.wall_contacts[part.wall_contacts[c]].r = part.problem.wall_contacts[c].r;
    }
}

/// Solves the whole problem on subdomains. In: its V_free + M^-1 H r and the r to start from, without driven walls;
/// owners as in split(). Out: as nlgs(). n_gs is the number of sweeps between two gluings. Throws std::invalid_argument
/// where a wall is driven.
template <class M>
SolveReport nscdd(ContactProblem<M>& whole, std::span<const int> owner, std::span<const int> owner_at_wall, int count,
                  double tolerance, int n_gs = 1, int most = 100'000) {
    if (whole.driven_walls()) throw std::invalid_argument("plain::nscdd: driven walls are not known here");
    ContactProblem<M> free = whole;
    add_impulses(free, -1);
    std::vector<Part<M>> parts = split(free, owner, owner_at_wall, count);
    for (Part<M>& part : parts) add_impulses(part.problem, 1);  // V_E = V_free + M_E^-1 H_E r_E
    glue(parts, whole);
    SolveReport report;
    do {
        for (Part<M>& part : parts)
            for (int s = 0; s < n_gs; ++s) plain::sweep(part.problem);
        glue(parts, whole);
        ++report.iterations;
        report.residual = residual_parts(whole).eta();
        report.converged = report.residual <= tolerance;
    } while (!report.converged && report.iterations < most);
    return report;
}

}}}  // namespace nscdd::NSCDD_ABI::plain
