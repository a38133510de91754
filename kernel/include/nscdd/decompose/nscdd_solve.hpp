/// @file
/// Alg. 1 of the paper, one step: sweeps on every subdomain, then gluing, until the residual is small.
#pragma once

#include <optional>

#include "nscdd/decompose/joined_components.hpp"
#include "nscdd/decompose/scheme.hpp"
#include "nscdd/decompose/step_solver.hpp"
#include "nscdd/sweep/nlgs.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Alg. 1: a sweep on every subdomain, interface contacts first; while the velocities of their grains are under way the
/// other contacts are swept. Interface contacts come last in two cases (METHOD.md, section 6.6). Before a test of
/// convergence, which otherwise sees a larger eta: 1 to 9 % more iterations. In accelerated iterations, because
/// Anderson needs every iteration in the same order (else 20 to 30 % more). The iteration waits for the sums of
/// products anyway, and the exchange runs during that wait.
template <class M>
class SweptTogether {
  public:
    SweptTogether(std::span<Subdomain<M>> parts, Communicator& comm, CommunicationScheme<M>& scheme,
                  const SolveOptions& options, HandOver<M> other, PhaseSeconds& seconds)
        : parts_(parts),
          comm_(comm),
          scheme_(scheme),
          options_(options),
          hand_over_(other),
          seconds_(seconds),
          watch_(comm),
          walls_(parts[0].wall_active.size()),
          sums_(parts.size(), Buffer(Anderson::largest_window + 1 + walls_)) {
        for (std::size_t k = 0; k < parts.size(); ++k)
            sweepers_.emplace_back(parts[k].sweeper, parts[k].problem, front(parts[k]), &comm.meter(), k);
        load();
        comm_.each_rank([this](std::size_t k) {
            parts_[k].sweeper.store(parts_[k].problem);
            distance_[k].begin(parts_[k].problem, parts_[k].sweeper.free_velocities(parts_[k].problem));
        });
        watch_.lap(seconds_.load);
    }

    void keep() {
        comm_.each_rank([this](std::size_t k) { parts_[k].sweeper.keep(parts_[k].problem); });
    }

    const double* iterate(const Anderson* anderson, bool tested) {
        const bool interface_last = tested || anderson;
        comm_.each_rank([&](std::size_t k) {
            begin_last_sweep(k, anderson);
            if (interface_last) pass(k, SweepPass::rest, anderson);
            pass(k, SweepPass::first, anderson);
        });
        watch_.lap(seconds_.sweep);
        pack(scheme_, parts_, comm_);
        scheme_.start();
        watch_.lap(seconds_.interface);
        const std::size_t products = anderson ? anderson->products() : 0;
        if (interface_last)
            start_sums(products);
        else
            sweep_rest();
        const double* sums = finish_sums(products);
        scheme_.finish(parts_, comm_);
        watch_.lap(seconds_.interface);
        return sums;
    }

    /// The same bits on every rank.
    ResidualParts residual() {
        const ResidualParts all =
            nscdd::reduce<ResidualParts>(comm_, [this](std::size_t k) { return sweepers_[k].residual(); });
        watch_.lap(seconds_.test);
        return all;
    }

    /// The same bits on every rank.
    detail::DistanceEstimate distance(const ResidualParts& residual) {
        add_up();
        const detail::DistanceEstimate all = joined_->estimate(comm_, distance_, residual);
        watch_.lap(seconds_.test);
        return all;
    }
    void mark() {
        comm_.each_rank([this](std::size_t k) {
            parts_[k].sweeper.store(parts_[k].problem);
            distance_[k].mark(parts_[k].problem);
        });
        watch_.lap(seconds_.test);
    }

    HandedOver hand_over(const ResidualParts& residual) {
        if (!hand_over_) return {};
        add_up();
        const HandedOver solved = hand_over_(parts_, comm_, distance_, *joined_, residual, options_);
        watch_.lap(seconds_.test);
        if (solved.contacts > 0) {
            comm_.each_rank([this](std::size_t k) { distance_[k].set_velocities(parts_[k].problem); });
            load();
        }
        return solved;
    }

    void restore_velocities() {
        comm_.each_rank([this](std::size_t k) { parts_[k].sweeper.restore_velocities(parts_[k].problem); });
        watch_.lap(seconds_.test);
        glue();
    }

    double least_radius() const { return parts_[0].problem.least_radius; }

    void store() {
        comm_.each_rank([this](std::size_t k) { parts_[k].sweeper.store(parts_[k].problem); });
        watch_.lap(seconds_.load);
    }

  private:
    static SweepFront front(const Subdomain<M>& part) {
        return {part.interface_contacts, part.interface_wall_contacts};
    }

    /// Makes all sweeps of the iteration but the last, and begins that one. With `anderson` the first sweep is
    /// accelerated.
    void begin_last_sweep(std::size_t k, const Anderson* anderson) {
        products_[k] = {};
        if (anderson) parts_[k].sweeper.accelerate(parts_[k].problem, options_.window);
        for (int s = 1; s < options_.sweeps; ++s) sweepers_[k].sweep(s == 1 ? anderson : nullptr, products_[k]);
        sweepers_[k].begin(accelerated_pass(anderson));
    }

    void pass(std::size_t k, SweepPass which, const Anderson* anderson, SweepPiece piece = {}) {
        sweepers_[k].pass(which, accelerated_pass(anderson), products_[k], piece);
    }

    /// Runs while messages are under way. Contacts with walls are swept first: then the wall speeds of this sweep are
    /// final and their reduction starts. Contacts between grains push the sides of a cell, whose speeds are final last.
    void sweep_rest() {
        comm_.each_rank([&](std::size_t k) { pass(k, SweepPass::rest_walls, nullptr); });
        const auto& flow = parts_[0].problem.flow;
        const bool sides = flow && flow->driven();
        if (!sides) start_sums(0);
        const bool rounds = walls_ > 0 && !sides && comm_.ranks().size() < static_cast<std::size_t>(comm_.size());
        // Four pieces, so advance() is called three times; up to 64 ranks need three rounds.
        const std::size_t pieces = rounds ? 4 : 1;
        for (std::size_t n = 0; n < pieces; ++n) {
            if (n > 0) comm_.advance();
            comm_.each_rank([&](std::size_t k) { pass(k, SweepPass::rest_grains, nullptr, {n, pieces}); });
        }
        if (sides) start_sums(0);
        watch_.lap(seconds_.sweep);
    }

    /// The sums that an estimate is made of, and the components when first asked for.
    void add_up() {
        comm_.each_rank([this](std::size_t k) {
            sweepers_[k].count_test();
            parts_[k].sweeper.store(parts_[k].problem);
            distance_[k].add_contacts(parts_[k].problem, parts_[k].sweeper.kept(parts_[k].problem));
        });
        add_asked<M>(parts_, comm_, distance_);
        comm_.each_rank([this](std::size_t k) { distance_[k].add_bodies(parts_[k].problem); });
        if (!joined_) joined_.emplace(parts_, comm_, distance_);
    }

    const Anderson* accelerated_pass(const Anderson* anderson) const {
        return options_.sweeps == 1 ? anderson : nullptr;
    }

    /// The problems into the sweepers, with V_free + M_E^-1 H_E r_E, and gluing.
    void load() {
        // Before gluing: load() computes V_free = V - M_E^-1 H r, true only while nothing but the impulses has changed
        // V.
        comm_.each_rank([this](std::size_t k) {
            Subdomain<M>& part = parts_[k];
            part.sweeper.load(part.problem, options_.relaxation, front(part));
        });
        watch_.lap(seconds_.load);
        scheme_.setup(parts_, comm_);
        // The warm start was applied to each copy with its split mass, so copies of a grain differ until they are
        // glued.
        glue();
    }

    void glue() {
        detail::glue(scheme_, parts_, comm_);
        start_sums(0);
        finish_sums(0);
        watch_.lap(seconds_.interface);
    }

    /// Starts the sums of the products and of the speeds of driven walls: each wall takes the mean over the copies that
    /// touch it.
    void start_sums(std::size_t products) {
        if (products + walls_ == 0) return;
        for (std::size_t k = 0; k < parts_.size(); ++k) {
            sums_[k].resize(products + walls_);
            std::copy_n(products_[k].begin(), products, sums_[k].begin());
            for (std::size_t w = 0; w < walls_; ++w)
                sums_[k][products + w] = parts_[k].wall_active[w] ? parts_[k].problem.walls[w].speed : 0;
        }
        comm_.start_reduce(sums_, products + walls_);
    }
    /// Sets the speeds of driven walls; returns the sums, products first.
    const double* finish_sums(std::size_t products) {
        if (products + walls_ == 0) return nullptr;
        const std::span<const double> total = comm_.finish_reduce();
        for (Subdomain<M>& part : parts_)
            for (std::size_t w = 0; w < walls_; ++w)
                if (part.wall_touched[w])
                    part.problem.walls[w].speed = total[products + w] / part.problem.wall_copies(w);
        return total.data();
    }

    std::span<Subdomain<M>> parts_;
    Communicator& comm_;
    CommunicationScheme<M>& scheme_;
    const SolveOptions& options_;
    HandOver<M> hand_over_;
    PhaseSeconds& seconds_;
    Stopwatch watch_;
    std::size_t walls_;  ///< 0 where none is driven
    std::vector<Buffer> sums_;
    std::vector<MeteredSweeper<M>> sweepers_;  ///< by hosted rank
    std::vector<Anderson::Products> products_{sums_.size()};
    std::vector<detail::DistanceSums<M>> distance_{sums_.size()};  ///< by hosted rank
    std::optional<JoinedComponents<M>> joined_;                    ///< found when first asked for
};

}  // namespace detail

/// Solves a step. In: split and prepared problems with V_free + M_E^-1 H_E r_E (warm start). Out: impulses, and
/// velocities equal in all active copies. With one subdomain the numbers are those of nlgs(), bit for bit.
template <class M>
SolveReport nscdd_solve(std::span<Subdomain<M>> parts, Communicator& comm, CommunicationScheme<M>& scheme,
                        const SolveOptions& options, PhaseSeconds& seconds, detail::HandOver<M> hand_over = nullptr) {
    detail::check_options(options);
    detail::check_hand_over<M>(options, hand_over);
    detail::SweptTogether<M> system(parts, comm, scheme, options, hand_over, seconds);
    const SolveReport report = detail::iterate(system, options);
    system.store();
    return report;
}

}}  // namespace nscdd::NSCDD_ABI
