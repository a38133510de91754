#pragma once

#include "nscdd/law/residual.hpp"
#include "nscdd/sweep/anderson_update.hpp"
#include "nscdd/sweep/kept_iterate.hpp"
#include "nscdd/sweep/load_batches.hpp"
#include "nscdd/sweep/pass.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Sweeps a packet of contacts at once, on a layout of its own. Members: Sweeps (sweeper.hpp).
template <class M>
class BatchSweeper {
  public:
    /// Takes the problem over. False, and of no use, where the layout does not fit it.
    bool load(const ContactProblem<M>& problem, double relaxation, SweepFront front) {
        rows_.begin(problem);
        if (!load_batches<false>(problem, problem.contacts, front.contacts, rows_, grains_, order_) ||
            !load_batches<true>(problem, problem.wall_contacts, front.wall_contacts, rows_, walls_, order_))
            return false;
        rows_.load(problem);
        wall_share_.assign(1 + problem.walls.size(), 1.0);
        for (std::size_t w = 0; w < problem.walls.size(); ++w) wall_share_[1 + w] = 1.0 / problem.wall_copies(w);
        inverse_relaxation_ = 1 / relaxation;
        sweeps_ = window_ = 0;
        kept_.forget();
        note_free(problem);
        return true;
    }

    void make_room(const ContactProblem<M>& problem, int window) {
        window_ = window;
        past_velocities_.make_room(rows_, problem.walls.size(), window);
        make_room(problem, problem.wall_contacts, walls_, WithWall{});
        make_room(problem, problem.contacts, grains_, BetweenGrains{});
    }

    void restore_velocities(ContactProblem<M>& problem) {
        for (std::size_t w = 0; w < problem.walls.size(); ++w) problem.walls[w].speed = free_walls_[w];
        rows_.data = free_rows_;
        const auto all = [](const auto& batch, int d) { return batch.r[d]; };
        with_walls([&](auto walls) { apply<typename decltype(walls)::type>(problem, walls_, all); });
        with_grains(problem, [&](auto rows) { apply<typename decltype(rows)::type>(problem, grains_, all); });
    }

    void begin(ContactProblem<M>& problem, const Anderson* anderson) {
        if (anderson) past_velocities_.combine(rows_, problem.walls, *anderson);
        // Open batches are found anew at every eighth sweep, because few change.
        if (sweeps_++ % 8 == 0) grains_.find_open(window_);
    }

    void pass(ContactProblem<M>& problem, SweepPass which, const Anderson* anderson, Anderson::Products* products,
              SweepPiece piece) {
        if (!anderson) return sweep_groups(problem, which, piece, Unaccelerated{});
        BatchByBatch<M> batches{*anderson, {}};
        sweep_groups(problem, which, piece, batches);
        for (std::size_t p = 0; p < anderson->products(); ++p) (*products)[p] += sum(batches.products[p]);
    }

    ResidualParts residual(const ContactProblem<M>& problem) const {
        ResidualParts parts;
        parts.contacts = static_cast<double>(problem.contact_count());
        with_grains(problem, [&](auto rows) { add_group<typename decltype(rows)::type>(problem, grains_, parts); });
        with_walls([&](auto walls) { add_group<typename decltype(walls)::type>(problem, walls_, parts); });
        auto change = parts.velocity_change;  // a copy stays in registers
        for (std::size_t at = 0; at < rows_.data.size(); at += Layout::row) {
            const double *now = rows_.data.data() + at, *free = free_rows_.data() + at;
            const auto squares = [&](int begin, int end) {
                double sum = 0;
                for (int d = begin; d < end; ++d) sum += (now[d] - free[d]) * (now[d] - free[d]);
                return sum;
            };
            change.add(now[Layout::mass_at], squares(0, M::dim) + squares(M::dim, M::dof) / Layout::kappa);
        }
        parts.velocity_change = change;
        add_wall_changes(problem, free_walls_, parts.velocity_change);
        return parts;
    }

    FreeVelocities<M> free_velocities(const ContactProblem<M>& problem) const {
        FreeVelocities<M> free{{}, free_walls_};
        for (std::size_t g = 0; g < problem.bodies.size(); ++g) free.bodies.push_back(rows_.velocity(g, free_rows_));
        return free;
    }

    void store(ContactProblem<M>& problem) const {
        for (std::size_t g = 0; g < problem.bodies.size(); ++g) problem.bodies[g].v = rows_.velocity(g);
        const auto put = [](Contact<M>& c, std::size_t, const typename M::Impulse& r) { c.r = r; };
        const auto of = [](const Group& group) {
            return [&group](std::size_t batch) { return group.impulses(batch); };
        };
        read_impulses(grains_, problem.contacts, of(grains_), put);
        read_impulses(walls_, problem.wall_contacts, of(walls_), put);
    }

    void keep(const ContactProblem<M>& problem) { kept_.take(problem, rows_, walls_, grains_); }
    const Iterate<M>* kept(const ContactProblem<M>& problem) { return kept_.read(problem, rows_, walls_, grains_); }

    double* row(std::size_t body) { return rows_.row(body); }
    void put_rows(const ContactProblem<M>&, const std::vector<int>&) {}  // are the velocities themselves
    void read_rows(ContactProblem<M>&, const std::vector<int>&) const {}

    std::size_t driven_batches(SweepPass which) const {
        if (!walls_.driven || which == SweepPass::rest_grains) return 0;
        return which == SweepPass::all     ? walls_.count
               : which == SweepPass::first ? walls_.first
                                           : walls_.count - walls_.first;
    }
    const std::vector<int>& order() const { return grains_.batches.contact; }
    const std::vector<int>& wall_order() const { return walls_.batches.contact; }

    std::size_t bytes() const {
        const auto of = [](const Group& group) {
            constexpr std::size_t each =
                std::is_empty_v<typename M::Law::Coefficients> ? 0 : sizeof(typename M::Law::Coefficients);
            return group.data.size() * sizeof(double) + group.coefficients.size() * each +
                   (group.i.size() + group.j.size()) * sizeof(int);
        };
        return rows_.data.size() * sizeof(double) + of(grains_) + of(walls_);
    }

  private:
    using Layout = BatchLayout<M>;
    using Group = BatchGroup<M>;
    using GrainRows = Rows<Layout::row>;
    static constexpr std::size_t lanes = batch_size;
    /// batches to prefetch ahead: about the time of a cache miss
    static constexpr std::size_t ahead = Packet::width > 4 ? 4 : 2;

    /// Calls f with the type of the walls of this problem.
    void with_walls(auto&& f) const {
        if (walls_.driven)
            f(std::type_identity<BatchWalls<M, true>>{});
        else
            f(std::type_identity<BatchWalls<M, false>>{});
    }

    /// Calls f with the type of rows of grains in this problem.
    static void with_grains(const ContactProblem<M>& problem, auto&& f) {
        if constexpr (M::friction)
            if (problem.flow) return f(std::type_identity<FlowingRows<M>>{});
        f(std::type_identity<GrainRows>{});
    }

    void make_room(const ContactProblem<M>& problem, const std::vector<Contact<M>>& contacts, Group& group, auto kind) {
        group.past.assign(group.count * group.past_size(window_), 0.0);
        const std::vector<int>& order = group.batches.contact;
        for (std::size_t k = 0; k < order.size(); ++k)
            if (order[k] >= 0)
                group.metric(k / lanes, window_)[k % lanes] =
                    anderson_metric(problem, contacts[static_cast<std::size_t>(order[k])], kind);
    }

    /// V_free, of the impulses and velocities that are loaded.
    void note_free(const ContactProblem<M>& problem) {
        ContactProblem<M> free;  // batches use and change its walls alone
        free.walls = problem.walls;
        free.flow = problem.flow;
        free_rows_ = rows_.data;
        const auto none = [](const auto& batch, int d) { return Packet(0) - batch.r[d]; };
        with_walls([&](auto walls) { apply<typename decltype(walls)::type>(free, walls_, none); });
        with_grains(free, [&](auto rows) { apply<typename decltype(rows)::type>(free, grains_, none); });
        free_rows_.swap(rows_.data);
        free_walls_.clear();
        for (const WallBody<M>& wall : free.walls) free_walls_.push_back(wall.speed);
    }

    /// V += M^-1 H dr, component d of dr being change(batch, d).
    template <class Other>
    void apply(ContactProblem<M>& problem, const Group& group, auto&& change) {
        SidePush<Other> sides(problem);
        for (std::size_t k = 0; k < group.count; ++k) {
            for (std::size_t lane = 0; lane < lanes; lane += Packet::width) {
                Batch<M, Other> batch;
                batch.load(problem, rows_.data, group, k, lane, sides.gradient);
                Packet dr[Layout::components];
                for (int d = 0; d < Layout::components; ++d) dr[d] = change(batch, d);
                batch.apply(dr);
                sides.add(batch, lane);
                store_batch(problem, group, k, lane, batch);
            }
        }
        sides.apply(problem);
    }

    /// What the contacts of a group do to the sides of a cell that flows: added up, as sides are far heavier than
    /// grains, and applied when all contacts are swept.
    template <class Other>
    struct SidePush {
        typename M::Gradient gradient;  ///< of the flow, while the group is swept
        std::array<Batchful, M::dim> push{};

        explicit SidePush(const ContactProblem<M>& problem) {
            if constexpr (Batch<M, Other>::flowing) gradient = problem.flow_gradient();
        }
        void add(const Batch<M, Other>& batch, std::size_t lane) {
            if constexpr (Batch<M, Other>::flowing)
                for (std::size_t d = 0; d < M::dim; ++d) {
                    Packet& sum = push[d][lane / Packet::width];
                    sum = sum + batch.b.push[d];
                }
        }
        void apply(ContactProblem<M>& problem) const {
            if constexpr (Batch<M, Other>::flowing)
                problem.each_side([this, length = problem.flow->length](WallBody<M>& side, int d) {
                    side.speed += side.inv_mass * sum(push[static_cast<std::size_t>(d)]) / length;
                });
        }
    };

    void sweep_groups(ContactProblem<M>& problem, SweepPass pass, SweepPiece piece, auto&& acceleration) {
        if (pass != SweepPass::rest_grains)
            with_walls([&](auto walls) {
                sweep_group<typename decltype(walls)::type>(problem, walls_, pass, {}, acceleration);
            });
        if (pass != SweepPass::rest_walls)
            with_grains(problem, [&](auto rows) {
                sweep_group<typename decltype(rows)::type>(problem, grains_, pass, piece, acceleration);
            });
    }

    template <class Other>
    void sweep_group(ContactProblem<M>& problem, Group& group, SweepPass pass, SweepPiece piece, auto&& acceleration) {
        const Packet inverse_relaxation(inverse_relaxation_);
        const bool front = pass == SweepPass::all || pass == SweepPass::first;
        const std::size_t rest = group.count - group.first, begin = front ? 0 : group.first + piece.begin(rest),
                          end = pass == SweepPass::all ? group.count
                                : front                ? group.first
                                                       : group.first + piece.end(rest);
        const std::size_t fetched = group.streams() ? end : 0;
        SidePush<Other> sides(problem);
        for (std::size_t k = begin; k < end; ++k) {
            if (k + ahead < fetched) {
                group.prefetch(k + ahead);
                acceleration.prefetch(group, k + ahead);
            }
            if constexpr (!Batch<M, Other>::wall) {
                if (group.open[k] && group.template stays_open<Batch<M, Other>::flowing>(sides.gradient, k, rows_.data))
                    continue;
                group.open[k] = 0;
            }
            for (std::size_t lane = 0; lane < lanes; lane += Packet::width) {
                Batch<M, Other> batch;
                batch.load(problem, rows_.data, group, k, lane, sides.gradient);
                acceleration.before(batch, group, k, lane);
                Packet wn, wt, next[Layout::components], dr[Layout::components];
                batch.delassus(Packet(1), Packet(1), wn, wt);
                wn = wn * inverse_relaxation;
                if constexpr (M::friction) wt = wt * inverse_relaxation;
                if constexpr (M::rolling) {
                    auto block = batch.spin_block(Packet(1), Packet(1));
                    block.spin = block.spin * inverse_relaxation;
                    batch.solve(wn, wt, block, group.coefficients[k], next);
                } else {
                    batch.solve(wn, wt, group.coefficients[k], next);
                }
                double* impulses = group.fields(k) + Layout::impulse_at * batch_size + lane;
                for (int d = 0; d < Layout::components; ++d) {
                    dr[d] = next[d] - batch.r[d];
                    next[d].store(impulses + d * batch_size);
                }
                acceleration.after(batch, group, k, lane, dr);
                batch.apply(dr);
                sides.add(batch, lane);
                store_batch(problem, group, k, lane, batch);
            }
        }
        sides.apply(problem);
    }

    template <class Other>
    EIGEN_ALWAYS_INLINE void store_batch(ContactProblem<M>& problem, const Group& group, std::size_t k,
                                         std::size_t lane, Batch<M, Other>& batch) {
        batch.a.store(rows_.data.data(), group.body(k) + lane);
        if constexpr (Batch<M, Other>::wall)
            batch.b.store(problem, group.other(k) + lane, group.batches.contact.data() + k * lanes + lane);
        else
            batch.b.store(rows_.data.data(), group.other(k) + lane);
    }

    template <class Other>
    void add_group(const ContactProblem<M>& problem, const Group& group, ResidualParts& parts) const {
        const SidePush<Other> sides(problem);
        Batchful change{}, energy{}, next_energy{}, round_off{}, work{}, made{}, closing{}, miss{};
        for (std::size_t k = 0; k < group.count; ++k) {
            Packet share_i(1), share_j(1);
            for (std::size_t lane = 0, p = 0; lane < lanes; lane += Packet::width, ++p) {
                Batch<M, Other> batch;
                batch.load(problem, rows_.data, group, k, lane, sides.gradient);
                Packet wn, wt, next[Layout::components], dr[Layout::components];
                if (group.shared[k]) load_shares<Other>(group, k, lane, share_i, share_j);
                batch.delassus(share_i, share_j, wn, wt);
                Packet ws(0);
                if constexpr (M::rolling) {
                    const auto block = batch.spin_block(share_i, share_j);
                    batch.solve(wn, wt, block, group.coefficients[k], next);
                    ws = block.spin;
                } else {
                    batch.solve(wn, wt, group.coefficients[k], next);
                }
                for (int d = 0; d < Layout::components; ++d) dr[d] = next[d] - batch.r[d];
                change[p] = change[p] + batch.energy(dr, wn, wt);
                energy[p] = energy[p] + batch.energy(batch.r, wn, wt);
                next_energy[p] = next_energy[p] + batch.energy(next, wn, wt);
                if constexpr (M::rolling) {
                    change[p] = change[p] + batch.couple_energy(dr, ws);
                    energy[p] = energy[p] + batch.couple_energy(batch.r, ws);
                    next_energy[p] = next_energy[p] + batch.couple_energy(next, ws);
                }
                Packet speed[M::dim];
                for (int d = 0; d < M::dim; ++d) speed[d] = batch.a[d];
                round_off[p] = round_off[p] + batch.dot(speed, speed) / wn;
                batch.add_work(group.coefficients[k], work[p], made[p]);
                closing[p] = larger(closing[p], Packet(0) - batch.normal_speed() - batch.bias);
                Packet missed = batch.energy(dr, wn * wn, M::friction ? wt * wt : wt);
                if constexpr (M::rolling) missed = missed + batch.couple_energy(dr, wn * ws);
                miss[p] = larger(miss[p], missed);
            }
        }
        parts.change += sum(change);
        parts.energy += sum(energy);
        parts.next_energy += sum(next_energy);
        parts.round_off += sum(round_off);
        parts.work += sum(work);
        parts.made += sum(made);
        parts.penetration = (std::max)(parts.penetration, problem.h * largest(closing));
        parts.miss = (std::max)(parts.miss, std::sqrt(largest(miss)));
    }

    template <class Other>
    void load_shares(const Group& group, std::size_t batch, std::size_t lane, Packet& share_i, Packet& share_j) const {
        alignas(sizeof(Packet)) double share[2][Packet::width];
        for (std::size_t k = 0; k < Packet::width; ++k) {
            const auto j = static_cast<std::size_t>(group.other(batch)[lane + k] + Batch<M, Other>::wall);
            share[0][k] = rows_.share[static_cast<std::size_t>(group.body(batch)[lane + k]) / Layout::row];
            share[1][k] = Batch<M, Other>::wall ? wall_share_[j] : rows_.share[j / Layout::row];
        }
        share_i = Packet::load(share[0]);
        share_j = Packet::load(share[1]);
    }

    BodyStore<M> rows_;
    AlignedDoubles free_rows_;        ///< V_free of bodies
    std::vector<double> free_walls_;  ///< V_free of walls
    std::vector<double> wall_share_;  ///< 1/multiplicity of each wall; the first is for lanes without a contact
    Group grains_, walls_;
    std::vector<int> order_;         ///< of contacts, while they are dealt to batches; kept for its memory
    double inverse_relaxation_ = 1;  ///< 1/omega, by which W is multiplied
    int window_ = 0, sweeps_ = 0;
    KeptIterate<M> kept_;
    PastVelocities<M> past_velocities_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
