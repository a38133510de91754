/// @file
/// Contacts of one batch, a packet wide. The functions do for a packet the work of kinematics.hpp and solve_contact.hpp
/// for one contact. Where packets hold fewer doubles than a batch has contacts, its parts follow one after the other:
/// `lane` is the first contact of one.
#pragma once

#include <cstddef>

#include "nscdd/sweep/batch_group.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Other: Rows of grains, FlowingRows, or BatchWalls.
template <class M, class Other>
struct Batch : BatchLayout<M> {
    using Layout = BatchLayout<M>;
    using Layout::components, Layout::dim, Layout::spins, Layout::kappa, Layout::half_gap, Layout::framed;
    using Layout::forces, Layout::couples;
    using Law = typename M::Law;
    using Coefficients = typename Law::Coefficients;
    static constexpr bool wall = !std::is_base_of_v<Rows<Layout::row>, Other>;
    static constexpr bool flowing = std::is_same_v<Other, FlowingRows<M>>;

    Rows<Layout::row> a;
    Other b;
    Packet n[dim], r[components], v[components], bias;
    Packet ratio_i, ratio_j;  ///< lever over rho
    Packet mass_i, mass_j;    ///< inverse
    Packet rho_i, rho_j;      ///< inverse, where there are couples

    EIGEN_ALWAYS_INLINE static Packet dot(const Packet* x, const Packet* y) {
        Packet total = x[0] * y[0];
        for (int d = 1; d < dim; ++d) total = madd(x[d], y[d], total);
        return total;
    }
    /// x cross y; in 2D its one component.
    EIGEN_ALWAYS_INLINE static void cross(const Packet* x, const Packet* y, Packet* out) {
        if constexpr (dim == 3)
            for (int d = 0; d < 3; ++d) {
                const int e = (d + 1) % 3, f = (d + 2) % 3;
                out[d] = x[e] * y[f] - x[f] * y[e];
            }
        else
            out[0] = x[0] * y[1] - x[1] * y[0];
    }

    /// Component d of flow * n.
    EIGEN_ALWAYS_INLINE static Packet along_flow(const auto& flow, const Packet* n, int d) {
        Packet total = Packet(flow(d, 0)) * n[0];
        for (int e = 1; e < dim; ++e) total = madd(Packet(flow(d, e)), n[e], total);
        return total;
    }

    /// gradient: of the flow, with the speeds of sides as they are (ContactProblem::flow_gradient()); only for rows
    /// that flow.
    EIGEN_ALWAYS_INLINE void load(const ContactProblem<M>& problem, const AlignedDoubles& rows,
                                  const BatchGroup<M>& group, std::size_t batch, std::size_t lane,
                                  const typename M::Gradient& gradient = {}) {
        const auto field = [from = group.fields(batch) + lane](int f) { return Packet::load(from + f * batch_size); };
        a.load(rows.data(), group.body(batch) + lane);
        if constexpr (wall)
            b.load(problem, group.other(batch) + lane);
        else
            b.load(rows.data(), group.other(batch) + lane);
        for (int d = 0; d < dim; ++d) n[d] = field(Layout::normal_at + d);
        for (int d = 0; d < components; ++d) r[d] = field(Layout::impulse_at + d);
        bias = field(Layout::bias_at);
        mass_i = a[Layout::mass_at];
        Packet relative[dim];
        if constexpr (wall) {
            mass_j = b.inv_mass;
            for (int d = 0; d < dim; ++d) relative[d] = a[d] - madd(b.speed, n[d], b.prescribed[d]);
        } else {
            mass_j = b[Layout::mass_at];
            for (int d = 0; d < dim; ++d) relative[d] = a[d] - b[d];
        }
        if constexpr (flowing) {
            b.distance = Packet::load(group.distance.data() + batch * batch_size + lane);
            for (int d = 0; d < dim; ++d) relative[d] = madd(b.distance, along_flow(gradient, n, d), relative[d]);
        }
        if constexpr (M::friction) {
            const Packet lever = field(Layout::lever_at);
            ratio_i = half_gap ? madd(lever, a[Layout::radius_at], Packet(1)) : lever;
            Packet spin[spins], turning[dim];
            for (int d = 0; d < spins; ++d) spin[d] = ratio_i * a[dim + d];
            if constexpr (!wall) {
                if constexpr (half_gap)
                    ratio_j = madd(lever, b[Layout::radius_at], Packet(1));
                else
                    ratio_j = field(Layout::lever_at + 1);
                for (int d = 0; d < spins; ++d) spin[d] = madd(ratio_j, b[dim + d], spin[d]);
            }
            if constexpr (framed) {
                cross(n, relative, turning);
                v[0] = dot(relative, n);
                v[1] = turning[0] - spin[0];
            } else {
                cross(spin, n, turning);
                for (int d = 0; d < dim; ++d) v[d] = relative[d] - turning[d];
            }
            if constexpr (M::rolling) {
                rho_i = half_gap ? a[Layout::radius_at] : field(Layout::radius_field);
                for (int d = 0; d < couples; ++d) v[forces + d] = rho_i * a[dim + d];
                if constexpr (wall) {
                    for (int d = 0; d < couples; ++d)
                        v[forces + d] = v[forces + d] - b.spin[static_cast<std::size_t>(d)];
                } else {
                    rho_j = half_gap ? b[Layout::radius_at] : field(Layout::radius_field + 1);
                    for (int d = 0; d < couples; ++d) v[forces + d] = v[forces + d] - rho_j * b[dim + d];
                }
            }
        } else {
            v[0] = dot(relative, n);
        }
    }

    Packet normal_speed() const {
        if constexpr (M::friction && !framed) return dot(v, n);
        return v[0];
    }

    /// The diagonal of W, of the rows' masses times these shares: 1 for split masses, 1/multiplicity for whole ones.
    ///
    /// A sweep computes W anew rather than read it: two reciprocals for each contact would be 16 bytes more, 88 instead
    /// of 72 in 3D with friction, and a sweep of more contacts than the caches hold waits for memory. Masses and levers
    /// are there anyway, as apply() needs them, and W takes 12 of about 120 arithmetic instructions that GCC 12 makes
    /// of a batch with AVX-512, and its one division.
    EIGEN_ALWAYS_INLINE void delassus(Packet share_i, Packet share_j, Packet& normal, Packet& tangential) const {
        const Packet mi = share_i * mass_i, mj = share_j * mass_j;
        normal = mi + mj;
        if constexpr (M::friction) {
            tangential = madd(Packet(kappa) * ratio_i * ratio_i, mi, wall ? mi : normal);  // no wall slides away
            if constexpr (!wall) tangential = madd(Packet(kappa) * ratio_j * ratio_j, mj, tangential);
        }
    }

    /// r' of solve_contact() for this W.
    EIGEN_ALWAYS_INLINE void solve(Packet wn, Packet wt, const Coefficients& k, Packet* next) const {
        if constexpr (M::friction) {
            const Packet both = Packet(1) / (wn * wt);  // one division for two reciprocals
            solve_by_inverse(wt * both, wn * both, k, next);
        } else {
            (void)wt;
            next[0] = Law::normal(r[0] - (v[0] + bias) / wn, k);
        }
    }
    /// An impulse: normal n + scale trial.
    struct Parts {
        Packet normal, scale, trial[dim];
    };
    /// The same by 1/W. Returns its parts, in 2D the normal one.
    EIGEN_ALWAYS_INLINE Parts solve_by_inverse(Packet inv_wn, Packet inv_wt, const Coefficients& k,
                                               Packet* next) const {
        Parts to;
        if constexpr (framed) {
            next[0] = to.normal = Law::normal(r[0] - (v[0] + bias) * inv_wn, k);
            const Packet most = Law::limit(to.normal, k);
            next[1] = larger(Packet(0) - most, smaller(most, r[1] - v[1] * inv_wt));
        } else {
            const Packet vn = dot(v, n), rn = dot(r, n);
            to.normal = Law::normal(rn - (vn + bias) * inv_wn, k);
            const Packet along = rn - inv_wt * vn;
            for (int d = 0; d < dim; ++d) to.trial[d] = r[d] - madd(inv_wt, v[d], along * n[d]);
            const Packet square = larger(dot(to.trial, to.trial), Packet(1e-300));
            to.scale = smaller(Packet(1), Law::limit(to.normal, k) * inverse_root(square));
            for (int d = 0; d < dim; ++d) next[d] = madd(to.scale, to.trial[d], to.normal * n[d]);
        }
        return to;
    }

    /// W_s, and what friction does to spins, as delassus(); only with couples.
    struct SpinBlock {
        Packet spin, coupling;
    };
    EIGEN_ALWAYS_INLINE SpinBlock spin_block(Packet share_i, Packet share_j) const {
        const Packet turn_i = Packet(kappa) * share_i * mass_i * rho_i;
        SpinBlock block{turn_i * rho_i, turn_i * ratio_i};
        if constexpr (!wall) {
            const Packet turn_j = Packet(kappa) * share_j * mass_j * rho_j;
            block.spin = madd(turn_j, rho_j, block.spin);
            block.coupling = block.coupling - turn_j * ratio_j;
        }
        return block;
    }

    /// As solve(), and the couple behind the impulse.
    EIGEN_ALWAYS_INLINE void solve(Packet wn, Packet wt, const SpinBlock& block, const Coefficients& k,
                                   Packet* next) const {
        const Packet both = wn * wt, all = Packet(1) / (both * block.spin), of_both = all * block.spin;
        solve_couple(block, both * all, solve_by_inverse(wt * of_both, wn * of_both, k, next), k, next);
    }
    /// The couple of solve_contact(), behind the impulse that `next` has, of these parts. inverse: of W_s.
    ///
    /// Friction changes the impulse by scale trial - r across n, and the spins by the coupling times n x that. All that
    /// the scale is not needed for comes first: it is the last that is known, at the end of a chain of dependent
    /// instructions.
    EIGEN_ALWAYS_INLINE void solve_couple(const SpinBlock& block, Packet inverse, const Parts& to,
                                          const Coefficients& k, Packet* next) const {
        if constexpr (framed) {
            const Packet spin = v[2] - block.coupling * (next[1] - r[1]);
            const Packet most = Law::rolling_limit(to.normal, k);
            next[2] = larger(Packet(0) - most, smaller(most, r[2] - inverse * spin));
        } else {
            Packet from[dim], turn[dim], trial[dim];
            cross(n, r, from);
            cross(n, to.trial, turn);
            for (int d = 0; d < dim; ++d)
                trial[d] = r[forces + d] - inverse * madd(block.coupling, from[d], v[forces + d]);
            const Packet twist = dot(trial, n), turned = inverse * block.coupling * to.scale;
            for (int d = 0; d < dim; ++d) trial[d] = madd(turned, turn[d], trial[d] - twist * n[d]);
            const Packet square = larger(dot(trial, trial), Packet(1e-300));
            const Packet scale = smaller(Packet(1), Law::rolling_limit(to.normal, k) * inverse_root(square));
            const Packet most = Law::twisting_limit(to.normal, k);
            const Packet along = larger(Packet(0) - most, smaller(most, twist));
            for (int d = 0; d < dim; ++d) next[forces + d] = madd(scale, trial[d], along * n[d]);
        }
    }

    /// V += M^-1 H dr, in the rows.
    EIGEN_ALWAYS_INLINE void apply(const Packet* dr) {
        Packet impulse[dim];
        if constexpr (framed) {
            impulse[0] = dr[0] * n[0] - dr[1] * n[1];
            impulse[1] = madd(dr[0], n[1], dr[1] * n[0]);
        } else {
            for (int d = 0; d < dim; ++d) impulse[d] = M::friction ? dr[d % components] : dr[0] * n[d];
        }
        for (int d = 0; d < dim; ++d) a[d] = madd(mass_i, impulse[d], a[d]);
        if constexpr (flowing)
            for (int d = 0; d < dim; ++d) b.push[d] = impulse[d] * n[d] * b.distance;
        if constexpr (wall) {
            b.speed = b.speed - mass_j * (framed ? dr[0] : dot(impulse, n));
        } else {
            for (int d = 0; d < dim; ++d) b[d] = b[d] - mass_j * impulse[d];
        }
        if constexpr (M::friction) {
            Packet turn[dim];
            if constexpr (framed)
                turn[0] = dr[1];
            else
                cross(n, impulse, turn);
            const Packet turn_i = Packet(kappa) * mass_i * ratio_i;
            for (int d = 0; d < spins; ++d) a[dim + d] = a[dim + d] - turn_i * turn[d];
            if constexpr (!wall) {
                const Packet turn_j = Packet(kappa) * mass_j * ratio_j;
                for (int d = 0; d < spins; ++d) b[dim + d] = b[dim + d] - turn_j * turn[d];
            }
        }
        if constexpr (M::rolling) {
            const Packet own_i = Packet(kappa) * mass_i * rho_i;
            for (int d = 0; d < couples; ++d) a[dim + d] = madd(own_i, dr[forces + d], a[dim + d]);
            if constexpr (!wall) {
                const Packet own_j = Packet(kappa) * mass_j * rho_j;
                for (int d = 0; d < couples; ++d) b[dim + d] = b[dim + d] - own_j * dr[forces + d];
            }
        }
    }

    /// Adds to ResidualParts::work and made, by lane.
    EIGEN_ALWAYS_INLINE void add_work(const Coefficients& k, Packet& work, Packet& made) const {
        Packet rn, opening, along(0), limit(0);
        if constexpr (framed) {
            rn = r[0];
            opening = v[0] + bias;
            along = r[1] * v[1];
            limit = Law::limit(rn, k) * magnitude(v[1]);
        } else if constexpr (M::friction) {
            const Packet vn = dot(v, n);
            rn = dot(r, n);
            Packet slip[dim];
            for (int d = 0; d < dim; ++d) slip[d] = v[d] - vn * n[d];
            const Packet square = dot(slip, slip), speed = square * inverse_root(larger(square, Packet(1e-300)));
            opening = vn + bias;
            along = dot(r, slip);
            limit = Law::limit(rn, k) * speed;
        } else {
            rn = r[0];
            opening = v[0] + bias;
        }
        if constexpr (M::rolling) {
            for (int d = 0; d < couples; ++d) along = madd(r[forces + d], v[forces + d], along);
            if constexpr (framed) {
                limit = madd(Law::rolling_limit(rn, k), magnitude(v[2]), limit);
            } else {
                const Packet twist = dot(v + forces, n);
                Packet roll[dim];
                for (int d = 0; d < dim; ++d) roll[d] = v[forces + d] - twist * n[d];
                const Packet square = dot(roll, roll), speed = square * inverse_root(larger(square, Packet(1e-300)));
                limit = madd(Law::rolling_limit(rn, k), speed, limit);
                limit = madd(Law::twisting_limit(rn, k), magnitude(twist), limit);
            }
        }
        work = work + magnitude(Law::excess(rn, k) * opening) + limit + along;
        made = made + rn * opening + along;
    }

    /// An impulse with its normal part times wn and its tangential part times wt; its couple times wt W_s/W_n.
    EIGEN_ALWAYS_INLINE void weigh(const Packet* impulse, Packet wn, Packet wt, Packet* out) const {
        if constexpr (framed) {
            out[0] = wn * impulse[0];
            out[1] = wt * impulse[1];
        } else if constexpr (M::friction) {
            const Packet more = (wn - wt) * dot(impulse, n);
            for (int d = 0; d < dim; ++d) out[d] = madd(wt, impulse[d], more * n[d]);
        } else {
            (void)wt;
            out[0] = wn * impulse[0];
        }
        if constexpr (M::rolling) {
            const Packet weight = wt * spin_block(Packet(1), Packet(1)).spin / (mass_i + mass_j);
            for (int d = 0; d < couples; ++d) out[forces + d] = weight * impulse[forces + d];
        }
    }

    /// The part of couples in r^T W r, but for what friction does to spins, by lane.
    EIGEN_ALWAYS_INLINE Packet couple_energy(const Packet* impulse, Packet ws) const {
        Packet sum = impulse[forces] * impulse[forces];
        for (int d = 1; d < couples; ++d) sum = madd(impulse[forces + d], impulse[forces + d], sum);
        return ws * sum;
    }

    /// r^T W r by lane, without couples.
    EIGEN_ALWAYS_INLINE Packet energy(const Packet* impulse, Packet wn, Packet wt) const {
        if constexpr (framed) {
            return madd(wn * impulse[0], impulse[0], wt * impulse[1] * impulse[1]);
        } else if constexpr (M::friction) {
            const Packet normal = dot(impulse, n);
            Packet tangential[dim];
            for (int d = 0; d < dim; ++d) tangential[d] = impulse[d] - normal * n[d];
            return wn * normal * normal + wt * dot(tangential, tangential);
        } else {
            (void)wt;
            return wn * impulse[0] * impulse[0];
        }
    }
};

}}}  // namespace nscdd::NSCDD_ABI::detail
