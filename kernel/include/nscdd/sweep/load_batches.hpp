/// @file
/// Puts the contacts of a problem into batches, and their impulses back.
#pragma once

#include <numeric>

#include "nscdd/sweep/body_store.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The order in which load_batches() deals the contacts from begin to end: as they come. Where walls are driven, the
/// first contact of each wall, then the second of each, and so on: a batch has at most one contact of each driven wall.
template <bool wall, class M>
void find_order(const ContactProblem<M>& problem, const std::vector<Contact<M>>& contacts, std::size_t begin,
                std::size_t end, std::vector<int>& order) {
    order.resize(end - begin);
    std::iota(order.begin(), order.end(), static_cast<int>(begin));
    if (wall && problem.driven_walls()) {
        std::vector<int> before(end - begin), seen(problem.walls.size(), 0);  // of the same wall
        const auto of = [&](int c) -> int& { return before[static_cast<std::size_t>(c) - begin]; };
        for (const int c : order) of(c) = seen[static_cast<std::size_t>(contacts[static_cast<std::size_t>(c)].j)]++;
        std::stable_sort(order.begin(), order.end(), [&of](int a, int b) { return of(a) < of(b); });
    }
}

/// Returns whether the layout fits: the bodies' rows must hold them, levers and inertias be those of solid grains (3D).
/// The first `first` contacts get batches of their own. `dealt` only keeps its memory.
template <bool wall, class M>
bool load_batches(const ContactProblem<M>& problem, const std::vector<Contact<M>>& contacts, std::size_t first,
                  BodyStore<M>& rows, BatchGroup<M>& group, std::vector<int>& dealt) {
    using Layout = BatchLayout<M>;
    constexpr std::size_t lanes = batch_size;
    const std::size_t bodies = problem.bodies.size();
    const auto at = [&](int c) -> const Contact<M>& { return contacts[static_cast<std::size_t>(c)]; };
    // the contacts of a batch have the same coefficients; open contacts keep to themselves (BatchGroup::stays_open())
    const auto together = [&](int head, int c) {
        if (!wall && at(head).r.isZero(0) != at(c).r.isZero(0)) return false;
        return at(head).coefficients() == at(c).coefficients();
    };
    group.driven = wall && problem.driven_walls();
    const auto touched = [&](int c) {
        const int other = !wall ? at(c).j : group.driven ? static_cast<int>(bodies) + at(c).j : -1;
        return std::array{at(c).i, other};
    };
    const int most = group.driven ? (std::min)(batch_size, static_cast<int>(problem.walls.size())) : batch_size;
    const auto deal = [&](std::size_t begin, std::size_t end) {
        find_order<wall>(problem, contacts, begin, end, dealt);
        group.batches.deal(dealt, batch_size, bodies + problem.walls.size(), 256, most, together, touched);
    };
    group.batches.contact.clear();
    deal(0, first);
    group.first = group.batches.contact.size() / lanes;
    deal(first, contacts.size());

    const std::vector<int>& order = group.batches.contact;
    group.count = order.size() / lanes;
    group.i.resize(order.size());
    group.j.resize(order.size());
    group.shared.assign(group.count, 0);
    group.coefficients.assign(group.count, {});
    group.data.resize(order.size() * Layout::fields);
    group.distance.assign(!wall && problem.flow ? order.size() : 0, 0.0);
    bool fits = rows.fits();
    for (std::size_t k = 0; k < order.size(); ++k) {
        const auto field = [&](int f) -> double& {
            return group.fields(k / lanes)[static_cast<std::size_t>(f) * lanes + k % lanes];
        };
        if (order[k] < 0) {
            group.i[k] = static_cast<int>(rows.no_body(k / lanes));
            group.j[k] = wall ? -1 : static_cast<int>(rows.no_other_body(k / lanes));
            for (int f = 0; f < Layout::fields; ++f) field(f) = 0;
            field(Layout::normal_at) = 1;  // at rest, without an impulse: that satisfies every law
            if constexpr (Layout::framed && M::rolling)
                field(Layout::radius_field) = field(Layout::radius_field + 1) = 1;
            continue;
        }
        const Contact<M>& c = at(order[k]);
        const auto i = static_cast<std::size_t>(c.i), j = static_cast<std::size_t>(c.j);
        if (wall && problem.bodies[i].inv_mass == 0) fits = false;  // on a fixed body a driven wall has W_t = 0
        group.i[k] = static_cast<int>(rows.row_of(c.i));
        group.j[k] = wall ? c.j : static_cast<int>(rows.row_of(c.j));
        if (problem.copies(i) > 1 || (wall ? problem.wall_copies(j) : problem.copies(j)) > 1)
            group.shared[k / lanes] = 1;
        for (int d = 0; d < M::dim; ++d) field(Layout::normal_at + d) = c.normal[d];
        if constexpr (Layout::framed) {
            field(Layout::impulse_at) = c.normal.dot(force_of<M>(c.r));
            field(Layout::impulse_at + 1) = c.normal[0] * c.r[1] - c.normal[1] * c.r[0];
            if constexpr (M::rolling) field(Layout::impulse_at + 2) = c.r[2];
        } else {
            for (int d = 0; d < Layout::components; ++d) field(Layout::impulse_at + d) = c.r[d];
        }
        field(Layout::bias_at) = c.bias;
        group.coefficients[k / lanes] = c;
        if constexpr (M::friction) {
            if (!group.distance.empty()) group.distance[k] = c.lever_i + c.lever_j;
            if constexpr (Layout::half_gap) {
                const double half = c.lever_i - 1 / rows.inverse_rho(i);
                field(Layout::lever_at) = half;
                if (!wall && std::abs(c.lever_j - 1 / rows.inverse_rho(j) - half) > 1e-13 * c.lever_j) fits = false;
            } else {
                field(Layout::lever_at) = c.lever_i * rows.inverse_rho(i);
                if constexpr (!wall) field(Layout::lever_at + 1) = c.lever_j * rows.inverse_rho(j);
                if constexpr (M::rolling) {
                    field(Layout::radius_field) = rows.inverse_rho(i);
                    if constexpr (!wall) field(Layout::radius_field + 1) = rows.inverse_rho(j);
                }
            }
        }
    }
    return fits;
}

/// put(contact, its index, r) for each contact; r: the impulses of all batches, those of a batch at impulses(batch).
template <class M>
void read_impulses(const BatchGroup<M>& group, auto& contacts, auto&& impulses, auto&& put) {
    using Layout = BatchLayout<M>;
    constexpr std::size_t lanes = batch_size;
    const std::vector<int>& order = group.batches.contact;
    for (std::size_t k = 0; k < order.size(); ++k) {
        if (order[k] < 0) continue;
        const auto number = static_cast<std::size_t>(order[k]);
        auto& c = contacts[number];
        const double* from = impulses(k / lanes) + k % lanes;
        typename M::Impulse r;
        if constexpr (Layout::framed && M::rolling)
            r = {from[0] * c.normal[0] - from[lanes] * c.normal[1], from[0] * c.normal[1] + from[lanes] * c.normal[0],
                 from[2 * lanes]};
        else if constexpr (Layout::framed)
            r = {from[0] * c.normal[0] - from[lanes] * c.normal[1], from[0] * c.normal[1] + from[lanes] * c.normal[0]};
        else
            for (std::size_t d = 0; d < std::size_t{Layout::components}; ++d) r[static_cast<int>(d)] = from[d * lanes];
        put(c, number, r);
    }
}

}}}  // namespace nscdd::NSCDD_ABI::detail
