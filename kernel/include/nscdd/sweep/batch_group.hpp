/// @file
/// What the contacts of a batch read and write: where their numbers lie, all contacts of one kind, walls by lane.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "nscdd/core/contact_problem.hpp"
#include "nscdd/core/packet.hpp"
#include "nscdd/sweep/batches.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Where things are. A body is a row {v, s, 1/m, 1/rho} (3D with friction, 64 bytes), {v, s, 1/m} (2D) or {v, 1/m}
/// (frictionless), where rho^2 = kappa I/m, kappa = 5/2 (2 for disks), and s = rho omega: rho is the radius of solid
/// spheres, and s answers an angular impulse with kappa/m whatever the inertia. In 3D a contact keeps lever - rho,
/// which is half the gap on both sides, 0 at a wall, instead of two levers over rho. In 2D with friction impulses and
/// relative velocities are in the frame of the contact, along n and along n turned to the left. Couples and relative
/// spins follow the impulses and the velocities. For them a contact in 2D has 1/rho of its bodies.
template <class M>
struct BatchLayout {
    static constexpr int dim = M::dim, spins = M::spins, forces = M::friction ? dim : 1, couples = M::couples,
                         components = forces + couples;
    static constexpr bool half_gap = M::friction && dim == 3, framed = M::friction && dim == 2;
    static constexpr double kappa = dim == 3 ? 2.5 : 2.0;  ///< m r^2 / I of a solid sphere, a disk

    static constexpr int row = half_gap ? 8 : 4;
    static constexpr int mass_at = dim + spins, radius_at = half_gap ? mass_at + 1 : 0;

    /// Fields of a contact, each of them of all contacts of a batch.
    static constexpr int normal_at = 0, impulse_at = dim, bias_at = dim + components, lever_at = bias_at + 1;
    static constexpr int radius_field = lever_at + 2;  ///< in 2D with couples
    static constexpr int fields = lever_at + (M::friction ? (half_gap ? 1 : 2) : 0) + (framed && M::rolling ? 2 : 0);
};

template <class M, class Other>
struct Batch;
template <class M>
struct FlowingRows;

/// All contacts of one kind.
template <class M>
struct BatchGroup {
    Batches batches;
    std::vector<int> i, j;     ///< where the row of each body begins; j may be the wall
    std::vector<char> shared;  ///< of each batch: 1 if one of its bodies or walls has several copies
    std::vector<char> open;    ///< of each batch: 1 if it is open, see find_open()
    std::vector<typename M::Law::Coefficients> coefficients;  ///< of each batch: its contacts have the same
    AlignedDoubles data;                                      ///< of each batch: the fields
    AlignedDoubles distance;  ///< of each batch, of centres, where the cell flows [m]; else empty
    AlignedDoubles past;      ///< of each batch: Anderson's metric, and of each of its slots iterate and change
    std::size_t count = 0;    ///< batches
    std::size_t first = 0;    ///< of them with the contacts that are swept first
    bool driven = false;      ///< true for contacts with walls when any wall of the problem is driven

    static constexpr std::size_t lanes = batch_size;
    double* fields(std::size_t batch) { return data.data() + batch * BatchLayout<M>::fields * lanes; }
    const double* fields(std::size_t batch) const { return data.data() + batch * BatchLayout<M>::fields * lanes; }
    static constexpr std::size_t impulse = BatchLayout<M>::components * lanes;
    /// Its impulses, component by component.
    const double* impulses(std::size_t batch) const { return fields(batch) + BatchLayout<M>::impulse_at * lanes; }
    static std::size_t past_size(int window) { return lanes + 2 * static_cast<std::size_t>(window) * impulse; }
    double* metric(std::size_t batch, int window) { return past.data() + batch * past_size(window); }
    const double* metric(std::size_t batch, int window) const { return past.data() + batch * past_size(window); }
    double* iterate(std::size_t batch, int slot, int window) {
        return metric(batch, window) + lanes + 2 * static_cast<std::size_t>(slot) * impulse;
    }
    double* change(std::size_t batch, int slot, int window) { return iterate(batch, slot, window) + impulse; }
    /// True if contact data exceed 1.5 MiB, about what a core has for itself. They are then prefetched: the reads of
    /// rows in between hide from the processor that contacts are consecutive.
    bool streams() const { return (data.size() + past.size()) * sizeof(double) > std::size_t{3} << 19; }
    static void prefetch(const double* from, std::size_t size) {
        for (std::size_t k = 0; k < size; k += 64 / sizeof(double)) __builtin_prefetch(from + k);
    }
    void prefetch(std::size_t batch) const { prefetch(fields(batch), BatchLayout<M>::fields * lanes); }
    void prefetch_past(std::size_t batch, int window) const { prefetch(metric(batch, window), past_size(window)); }

    /// Sets open[k] to 1 if impulses, stored iterates and changes of batch k are 0 and its law never gives r_n < 0.
    void find_open(int window) {
        open.resize(count);
        for (std::size_t k = 0; k < count; ++k) {
            const auto zero = [](const double* from, std::size_t size) {
                return (Eigen::Map<const Eigen::ArrayXd>(from, static_cast<Eigen::Index>(size)) == 0).all();
            };
            open[k] = zero(impulses(k), impulse) &&
                      (window == 0 || zero(iterate(k, 0, window), past_size(window) - lanes)) &&
                      M::Law::normal(std::numeric_limits<double>::lowest(), coefficients[k]) == 0;
        }
    }
    /// True if v_n + bias >= 0 at every contact of an open batch: a sweep would leave its impulses 0. A quarter of the
    /// cost of solving the batch in 3D, as it needs no spins and no division. always_inline: GCC makes it a call in
    /// some programs.
    template <bool flowing>
    [[gnu::always_inline]] bool stays_open(const typename M::Gradient& gradient, std::size_t batch,
                                           const AlignedDoubles& rows) const {
        static_assert(BatchLayout<M>::row % 4 == 0);
        for (std::size_t lane = 0; lane < lanes; lane += Packet::width) {
            Rows<4> a, b;  // the first four components, with the velocity
            a.load(rows.data(), body(batch) + lane);
            b.load(rows.data(), other(batch) + lane);
            const double* from = fields(batch) + lane;
            Packet opening = Packet::load(from + BatchLayout<M>::bias_at * lanes), n[M::dim];
            for (int d = 0; d < M::dim; ++d) {
                n[d] = Packet::load(from + static_cast<std::size_t>(BatchLayout<M>::normal_at + d) * lanes);
                opening = madd(a[d] - b[d], n[d], opening);
            }
            if constexpr (flowing) {
                const Packet apart = Packet::load(distance.data() + batch * lanes + lane);
                for (int d = 0; d < M::dim; ++d)
                    opening = madd(apart * n[d], Batch<M, FlowingRows<M>>::along_flow(gradient, n, d), opening);
            }
            if (!none_negative(opening)) return false;
        }
        return true;
    }
    const int* body(std::size_t batch) const { return i.data() + batch * lanes; }
    const int* other(std::size_t batch) const { return j.data() + batch * lanes; }
};

/// The walls of a batch, by lane. Where no wall of the problem is driven, speeds are neither read nor computed nor
/// stored.
template <class M, bool driven>
struct BatchWalls {
    Packet prescribed[M::dim], speed, inv_mass;
    std::array<Packet, M::couples> spin;

    void load(const ContactProblem<M>& problem, const int* wall) {
        constexpr int spin_at = M::dim + 2;
        alignas(sizeof(Packet)) double lane[spin_at + M::couples][Packet::width] = {};
        const auto fill = [&](int k) {
            const WallBody<M>& from = problem.walls[static_cast<std::size_t>(wall[k])];
            for (int d = 0; d < M::dim; ++d) lane[d][k] = from.prescribed[d];
            if constexpr (driven) lane[M::dim][k] = from.speed, lane[M::dim + 1][k] = from.inv_mass;
            if constexpr (M::rolling)
                for (int d = 0; d < M::couples; ++d) lane[spin_at + d][k] = from.spin.value[d];
        };
        if (wall[Packet::width - 1] >= 0)
            for (int k = 0; k < Packet::width; ++k) fill(k);
        else  // lanes without a contact come last
            for (int k = 0; k < Packet::width && wall[k] >= 0; ++k) fill(k);
        for (int d = 0; d < M::dim; ++d) prescribed[d] = Packet::load(lane[d]);
        speed = Packet::load(lane[M::dim]);
        inv_mass = Packet::load(lane[M::dim + 1]);
        if constexpr (M::rolling)
            for (std::size_t d = 0; d < spin.size(); ++d) spin[d] = Packet::load(lane[spin_at + d]);
    }
    void store(ContactProblem<M>& problem, const int* wall, const int* contact) const {
        if constexpr (driven) {
            alignas(sizeof(Packet)) double lane[Packet::width];
            speed.store(lane);
            for (int k = 0; k < Packet::width; ++k)
                if (contact[k] >= 0) problem.walls[static_cast<std::size_t>(wall[k])].speed = lane[k];
        }
    }
};

/// Rows of grains in a cell that flows (ContactProblem::flow).
template <class M>
struct FlowingRows : Rows<BatchLayout<M>::row> {
    Packet distance;      ///< of centres [m]
    Packet push[M::dim];  ///< of the impulse that was applied, times the way of the grains [N s m]
};

}}}  // namespace nscdd::NSCDD_ABI::detail
