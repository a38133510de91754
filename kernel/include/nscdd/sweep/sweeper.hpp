#pragma once

#include "nscdd/law/residual.hpp"
#include "nscdd/sweep/combine.hpp"
#include "nscdd/sweep/kept_iterate.hpp"
#include "nscdd/sweep/load_batches.hpp"
#include "nscdd/sweep/pass.hpp"
#include "nscdd/sweep/sweep.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The fast sweep: sweep() of sweep.hpp for a packet of contacts at once, on a layout of its own.
/// ```
/// Sweeper<M> sweeper;
/// sweeper.load(problem);               // velocities consistent with impulses
/// sweeper.sweep(problem);              // as often as wanted
/// sweeper.residual(problem).eta();
/// sweeper.store(problem);
/// ```
template <class M>
class Sweeper {
  public:
    /// Takes over velocities and impulses; `relaxation` is omega, between 0 and 2. A problem that the layout does not
    /// fit (levers or inertias not those of solid grains, 3D) is swept where it is, all of it in the first pass.
    void load(ContactProblem<M>& problem, double relaxation = 1, SweepFront front = {}) {
        rows_.begin(problem);
        batched_ = detail::load_batches<false>(problem, problem.contacts, front.contacts, rows_, grains_, order_);
        batched_ &=
            detail::load_batches<true>(problem, problem.wall_contacts, front.wall_contacts, rows_, walls_, order_);
        rows_.load(problem);
        wall_share_.assign(1 + problem.walls.size(), 1.0);
        for (std::size_t w = 0; w < problem.walls.size(); ++w) wall_share_[1 + w] = 1.0 / problem.wall_copies(w);
        inverse_relaxation_ = 1 / relaxation;
        if (!batched_) prepare_contacts(problem, relaxation);
        window_ = sweeps_ = 0;
        kept_.forget();
        note_free(problem);
    }

    /// To be called before a sweep with an Anderson of this window. The first call makes room for its iterates and
    /// changes, and sets its metric.
    void accelerate(const ContactProblem<M>& problem, int window) {
        if (window_ == 0) make_room(problem, window);
    }

    /// V = V_free + M^-1 H r of the impulses held here. Copies have to be glued after it.
    void restore_velocities(ContactProblem<M>& problem) {
        for (std::size_t w = 0; w < problem.walls.size(); ++w) problem.walls[w].speed = free_.walls[w];
        if (!batched_) {
            for (std::size_t g = 0; g < problem.bodies.size(); ++g) problem.bodies[g].v = free_.bodies[g];
            apply_impulses(problem);
            return;
        }
        rows_.data = free_rows_;
        const auto all = [](const auto& batch, int d) { return batch.r[d]; };
        with_walls([&](auto walls) { apply<typename decltype(walls)::type>(problem, walls_, all); });
        apply<GrainRows>(problem, grains_, all);
    }
    int window() const { return window_; }  ///< of accelerate() since the last load(); 0: not accelerated

    ///@{
    /// One sweep over all contacts. `problem` is that of load(); the speeds of its walls are used and changed. With an
    /// Anderson the sweep starts from its combination of iterates, and adds the products of these contacts to
    /// `products` [J].
    void sweep(ContactProblem<M>& problem) {
        begin(problem);
        pass(problem, SweepPass::all);
    }
    void sweep(ContactProblem<M>& problem, const Anderson& anderson, Anderson::Products& products) {
        begin(problem, &anderson);
        pass(problem, SweepPass::all, &anderson, &products);
    }
    ///@}

    /// To be called once before the passes of a sweep. Without acceleration `anderson` is null, and `products` of
    /// pass() may be null.
    void begin(ContactProblem<M>& problem, const Anderson* anderson = nullptr) {
        if (anderson) combine_velocities(problem, *anderson);
        if (batched_) find_open();
    }
    /// A part of a sweep: SweepPass::first before or after all others; `anderson` as in begin(), `products` as in
    /// sweep().
    void pass(ContactProblem<M>& problem, SweepPass which, const Anderson* anderson = nullptr,
              Anderson::Products* products = nullptr, SweepPiece piece = {}) {
        if (!batched_) {
            if (which != SweepPass::all && which != SweepPass::first) return;
            if (anderson)
                nscdd::sweep(problem, detail::OneByOne<M>{*anderson, metric_.data(), past_.data(), *products});
            else
                nscdd::sweep(problem);
            return;
        }
        if (!anderson) return sweep_groups(problem, which, piece, Unaccelerated{});
        detail::BatchByBatch<M> batches{*anderson, {}};
        sweep_groups(problem, which, piece, batches);
        for (std::size_t p = 0; p < anderson->products(); ++p) (*products)[p] += detail::sum(batches.products[p]);
    }

    /// As residual_parts(problem), of the velocities and impulses held here.
    ResidualParts residual(const ContactProblem<M>& problem) const {
        if (!batched_) return residual_parts(problem, free_);
        ResidualParts parts;
        parts.contacts = static_cast<double>(problem.contact_count());
        add_group<GrainRows>(problem, grains_, parts);
        with_walls([&](auto walls) { add_group<typename decltype(walls)::type>(problem, walls_, parts); });
        for (std::size_t at = 0; at < rows_.data.size(); at += Layout::row) {
            const double *now = rows_.data.data() + at, *free = free_rows_.data() + at;
            const auto squares = [&](int begin, int end) {
                double sum = 0;
                for (int d = begin; d < end; ++d) sum += (now[d] - free[d]) * (now[d] - free[d]);
                return sum;
            };
            parts.velocity_change.add(now[Layout::mass_at],
                                      squares(0, M::dim) + squares(M::dim, M::dof) / Layout::kappa);
        }
        add_wall_changes(problem, free_.walls, parts.velocity_change);
        return parts;
    }

    /// V_free of the problem of load().
    FreeVelocities<M> free_velocities(const ContactProblem<M>& problem) const {
        if (!batched_) return free_;
        FreeVelocities<M> free{{}, free_.walls};
        for (std::size_t g = 0; g < problem.bodies.size(); ++g) free.bodies.push_back(rows_.velocity(g, free_rows_));
        return free;
    }

    /// Velocities and impulses back into the problem.
    void store(ContactProblem<M>& problem) const {
        if (!batched_) return;
        for (std::size_t g = 0; g < problem.bodies.size(); ++g) problem.bodies[g].v = rows_.velocity(g);
        const auto put = [](Contact<M>& c, std::size_t, const typename M::Impulse& r) { c.r = r; };
        const auto of = [](const Group& group) {
            return [&group](std::size_t batch) { return group.impulses(batch); };
        };
        detail::read_impulses(grains_, problem.contacts, of(grains_), put);
        detail::read_impulses(walls_, problem.wall_contacts, of(walls_), put);
    }

    /// Keeps the iterate as it is: a fifth of a sweep.
    void keep(const ContactProblem<M>& problem) {
        batched_ ? kept_.take(problem, rows_, walls_, grains_) : kept_.take(problem);
    }
    /// What keep() has kept last, or null if it has not been called since load().
    const Iterate<M>* kept(const ContactProblem<M>& problem) { return kept_.read(problem, rows_, walls_, grains_); }

    /// Velocity of a body, M::dof doubles until the next load(): linear [m/s], then spins, in one unit for all copies.
    double* row(int body) { return rows_.row(static_cast<std::size_t>(body)); }
    /// Before rows are glued: where not batched(), these bodies' rows from their velocities in the problem of load().
    void put_rows(const ContactProblem<M>& problem, const std::vector<int>& bodies) {
        if (batched_) return;
        for (const int b : bodies)
            rows_.set_velocity(static_cast<std::size_t>(b), problem.bodies[static_cast<std::size_t>(b)].v);
    }
    /// After rows are glued: where not batched(), the velocities of these bodies from their rows.
    void read_rows(ContactProblem<M>& problem, const std::vector<int>& bodies) const {
        if (batched_) return;
        for (const int b : bodies)
            problem.bodies[static_cast<std::size_t>(b)].v = rows_.velocity(static_cast<std::size_t>(b));
    }

    bool batched() const { return batched_; }  ///< whether the layout fits the problem of load()
    /// Batches with driven walls in a pass, each of which waits for the speeds that the one before it leaves.
    std::size_t driven_batches(SweepPass which) const {
        if (!batched_ || !walls_.driven || which == SweepPass::rest_grains) return 0;
        return which == SweepPass::all     ? walls_.count
               : which == SweepPass::first ? walls_.first
                                           : walls_.count - walls_.first;
    }
    /// Where batched(): indices into problem.contacts, detail::batch_size a batch, in the order of a sweep; -1 pads.
    const std::vector<int>& order() const { return grains_.batches.contact; }
    const std::vector<int>& wall_order() const { return walls_.batches.contact; }  ///< of wall_contacts

    /// What a sweep reads and writes [bytes], without what acceleration adds.
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
    using Layout = detail::BatchLayout<M>;
    using Group = detail::BatchGroup<M>;
    using GrainRows = detail::Rows<Layout::row>;
    static constexpr std::size_t lanes = detail::batch_size;
    /// batches to prefetch ahead: about the time of a cache miss
    static constexpr std::size_t ahead = Packet::width > 4 ? 4 : 2;

    /// Calls f with the type of the walls of this problem.
    void with_walls(auto&& f) const {
        if (walls_.driven)
            f(std::type_identity<detail::BatchWalls<M, true>>{});
        else
            f(std::type_identity<detail::BatchWalls<M, false>>{});
    }

    void make_room(const ContactProblem<M>& problem, int window) {
        window_ = window;
        past_velocities_.make_room(rows_, problem.walls.size(), window);
        past_.assign(batched_ ? 0 : problem.contact_count() * 2 * static_cast<std::size_t>(window), M::Impulse::Zero());
        metric_.clear();
        make_room(problem, problem.wall_contacts, walls_, WithWall{});
        make_room(problem, problem.contacts, grains_, BetweenGrains{});
    }

    void make_room(const ContactProblem<M>& problem, const std::vector<Contact<M>>& contacts, Group& group, auto kind) {
        const auto metric = [&problem, kind](const Contact<M>& c) {
            return Anderson::metric(delassus(problem, c, true, kind).normal, delassus(problem, c, false, kind).normal);
        };
        if (!batched_) {
            for (const Contact<M>& c : contacts) metric_.push_back(metric(c));
            return;
        }
        group.past.assign(group.count * group.past_size(window_), 0.0);
        const std::vector<int>& order = group.batches.contact;
        for (std::size_t k = 0; k < order.size(); ++k)
            if (order[k] >= 0)
                group.metric(k / lanes, window_)[k % lanes] = metric(contacts[static_cast<std::size_t>(order[k])]);
    }

    /// V_free, of the impulses and velocities that are loaded.
    void note_free(const ContactProblem<M>& problem) {
        if (!batched_) {
            free_ = nscdd::free_velocities(problem);
            return;
        }
        ContactProblem<M> free;  // batches use and change its walls alone
        free.walls = problem.walls;
        free_rows_ = rows_.data;
        const auto none = [](const auto& batch, int d) { return Packet(0) - batch.r[d]; };
        with_walls([&](auto walls) { apply<typename decltype(walls)::type>(free, walls_, none); });
        apply<GrainRows>(free, grains_, none);
        free_rows_.swap(rows_.data);
        free_.walls.clear();
        for (const WallBody<M>& wall : free.walls) free_.walls.push_back(wall.speed);
    }

    /// V += M^-1 H dr, component d of dr being change(batch, d).
    template <class Other>
    void apply(ContactProblem<M>& problem, const Group& group, auto&& change) {
        for (std::size_t k = 0; k < group.count; ++k) {
            for (std::size_t lane = 0; lane < lanes; lane += Packet::width) {
                detail::Batch<M, Other> batch;
                batch.load(problem, rows_.data, group, k, lane);
                Packet dr[Layout::components];
                for (int d = 0; d < Layout::components; ++d) dr[d] = change(batch, d);
                batch.apply(dr);
                store_batch(problem, group, k, lane, batch);
            }
        }
    }

    /// Combines the velocities of bodies and driven walls by the coefficients that will combine the contacts' impulses.
    void combine_velocities(ContactProblem<M>& problem, const Anderson& anderson) {
        if (!batched_)
            for (std::size_t g = 0; g < problem.bodies.size(); ++g) rows_.set_velocity(g, problem.bodies[g].v);
        past_velocities_.combine(rows_, problem.walls, anderson);
        if (!batched_)
            for (std::size_t g = 0; g < problem.bodies.size(); ++g) problem.bodies[g].v = rows_.velocity(g);
    }

    void sweep_groups(ContactProblem<M>& problem, SweepPass pass, SweepPiece piece, auto&& acceleration) {
        if (pass != SweepPass::rest_grains)
            with_walls([&](auto walls) {
                sweep_group<typename decltype(walls)::type>(problem, walls_, pass, {}, acceleration);
            });
        if (pass != SweepPass::rest_walls) sweep_group<GrainRows>(problem, grains_, pass, piece, acceleration);
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
        for (std::size_t k = begin; k < end; ++k) {
            if (k + ahead < fetched) {
                group.prefetch(k + ahead);
                acceleration.prefetch(group, k + ahead);
            }
            if constexpr (!detail::Batch<M, Other>::wall) {
                if (group.open[k] && group.stays_open(k, rows_.data)) continue;
                group.open[k] = 0;
            }
            for (std::size_t lane = 0; lane < lanes; lane += Packet::width) {
                detail::Batch<M, Other> batch;
                batch.load(problem, rows_.data, group, k, lane);
                acceleration.before(batch, group, k, lane);
                Packet wn, wt, next[Layout::components], dr[Layout::components];
                batch.delassus(Packet(1), Packet(1), wn, wt);
                wn = wn * inverse_relaxation;
                if constexpr (M::friction) wt = wt * inverse_relaxation;
                batch.solve(wn, wt, group.coefficients[k], next);
                double* impulses = group.fields(k) + Layout::impulse_at * detail::batch_size + lane;
                for (int d = 0; d < Layout::components; ++d) {
                    dr[d] = next[d] - batch.r[d];
                    next[d].store(impulses + d * detail::batch_size);
                }
                acceleration.after(batch, group, k, lane, dr);
                batch.apply(dr);
                store_batch(problem, group, k, lane, batch);
            }
        }
    }

    template <class Other>
    EIGEN_ALWAYS_INLINE void store_batch(ContactProblem<M>& problem, const Group& group, std::size_t k,
                                         std::size_t lane, detail::Batch<M, Other>& batch) {
        batch.a.store(rows_.data.data(), group.body(k) + lane);
        if constexpr (detail::Batch<M, Other>::wall)
            batch.b.store(problem, group.other(k) + lane, group.batches.contact.data() + k * lanes + lane);
        else
            batch.b.store(rows_.data.data(), group.other(k) + lane);
    }

    /// Finds the open batches anew at every eighth sweep, because few change.
    void find_open() {
        if (sweeps_++ % 8 == 0) grains_.find_open(window_);
    }

    template <class Other>
    void add_group(const ContactProblem<M>& problem, const Group& group, ResidualParts& parts) const {
        detail::Batchful change{}, energy{}, next_energy{}, round_off{}, work{}, made{}, closing{}, miss{};
        for (std::size_t k = 0; k < group.count; ++k) {
            Packet share_i(1), share_j(1);
            for (std::size_t lane = 0, p = 0; lane < lanes; lane += Packet::width, ++p) {
                detail::Batch<M, Other> batch;
                batch.load(problem, rows_.data, group, k, lane);
                Packet wn, wt, next[Layout::components], dr[Layout::components];
                if (group.shared[k]) load_shares<Other>(group, k, lane, share_i, share_j);
                batch.delassus(share_i, share_j, wn, wt);
                batch.solve(wn, wt, group.coefficients[k], next);
                for (int d = 0; d < Layout::components; ++d) dr[d] = next[d] - batch.r[d];
                change[p] = change[p] + batch.energy(dr, wn, wt);
                energy[p] = energy[p] + batch.energy(batch.r, wn, wt);
                next_energy[p] = next_energy[p] + batch.energy(next, wn, wt);
                Packet speed[M::dim];
                for (int d = 0; d < M::dim; ++d) speed[d] = batch.a[d];
                round_off[p] = round_off[p] + batch.dot(speed, speed) / wn;
                batch.add_work(group.coefficients[k], work[p], made[p]);
                closing[p] = larger(closing[p], Packet(0) - batch.normal_speed() - batch.bias);
                miss[p] = larger(miss[p], batch.energy(dr, wn * wn, M::friction ? wt * wt : wt));
            }
        }
        parts.change += detail::sum(change);
        parts.energy += detail::sum(energy);
        parts.next_energy += detail::sum(next_energy);
        parts.round_off += detail::sum(round_off);
        parts.work += detail::sum(work);
        parts.made += detail::sum(made);
        parts.penetration = (std::max)(parts.penetration, problem.h * detail::largest(closing));
        parts.miss = (std::max)(parts.miss, std::sqrt(detail::largest(miss)));
    }

    template <class Other>
    void load_shares(const Group& group, std::size_t batch, std::size_t lane, Packet& share_i, Packet& share_j) const {
        alignas(sizeof(Packet)) double share[2][Packet::width];
        for (std::size_t k = 0; k < Packet::width; ++k) {
            const auto j = static_cast<std::size_t>(group.other(batch)[lane + k] + detail::Batch<M, Other>::wall);
            share[0][k] = rows_.share[static_cast<std::size_t>(group.body(batch)[lane + k]) / Layout::row];
            share[1][k] = detail::Batch<M, Other>::wall ? wall_share_[j] : rows_.share[j / Layout::row];
        }
        share_i = Packet::load(share[0]);
        share_j = Packet::load(share[1]);
    }

    detail::BodyRows<M> rows_;
    detail::AlignedDoubles free_rows_;  ///< V_free of bodies, where batched_
    FreeVelocities<M> free_;            ///< V_free of walls, and of bodies where not batched_

    detail::KeptIterate<M> kept_;
    std::vector<double> wall_share_;  ///< 1/multiplicity of each wall; the first is for lanes without a contact
    Group grains_, walls_;
    std::vector<int> order_;  ///< of contacts, while they are dealt to batches; kept for its memory
    bool batched_ = false;
    double inverse_relaxation_ = 1;  ///< 1/omega, by which W is multiplied
    int window_ = 0, sweeps_ = 0;
    detail::PastVelocities<M> past_velocities_;
    std::vector<double> metric_;             ///< of each contact, where not batched_
    std::vector<typename M::Impulse> past_;  ///< iterates and changes of each contact, where not batched_
};

}}  // namespace nscdd::NSCDD_ABI
