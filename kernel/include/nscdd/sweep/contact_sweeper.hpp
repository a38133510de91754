#pragma once

#include "nscdd/law/iterate.hpp"
#include "nscdd/law/residual.hpp"
#include "nscdd/sweep/anderson_update.hpp"
#include "nscdd/sweep/pass.hpp"
#include "nscdd/sweep/sweep.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Sweeps contact by contact, on the problem where it is: for problems that the layout of BatchSweeper does not fit.
/// Members: Sweeps (sweeper.hpp).
template <class M>
class ContactSweeper {
  public:
    void load(ContactProblem<M>& problem, double relaxation) {
        rows_.begin(problem);
        rows_.load(problem);
        prepare_contacts(problem, relaxation);
        kept_ = false;
        bytes_ = problem.bytes();
        free_ = detail::free_velocities(problem);
    }

    void make_room(const ContactProblem<M>& problem, int window) {
        past_velocities_.make_room(rows_, problem.walls.size(), window);
        past_.assign(problem.contact_count() * 2 * static_cast<std::size_t>(window), M::Impulse::Zero());
        metric_.clear();
        for (const Contact<M>& c : problem.wall_contacts) metric_.push_back(anderson_metric(problem, c, WithWall{}));
        for (const Contact<M>& c : problem.contacts) metric_.push_back(anderson_metric(problem, c, BetweenGrains{}));
    }

    void restore_velocities(ContactProblem<M>& problem) {
        for (std::size_t w = 0; w < problem.walls.size(); ++w) problem.walls[w].speed = free_.walls[w];
        for (std::size_t g = 0; g < problem.bodies.size(); ++g) problem.bodies[g].v = free_.bodies[g];
        apply_impulses(problem);
    }

    void begin(ContactProblem<M>& problem, const Anderson* anderson) {
        if (!anderson) return;
        for (std::size_t g = 0; g < problem.bodies.size(); ++g) rows_.set_velocity(g, problem.bodies[g].v);
        past_velocities_.combine(rows_, problem.walls, *anderson);
        for (std::size_t g = 0; g < problem.bodies.size(); ++g) problem.bodies[g].v = rows_.velocity(g);
    }

    /// All contacts in the first pass.
    void pass(ContactProblem<M>& problem, SweepPass which, const Anderson* anderson, Anderson::Products* products,
              SweepPiece) {
        if (which != SweepPass::all && which != SweepPass::first) return;
        if (anderson)
            nscdd::sweep(problem, OneByOne<M>{*anderson, metric_.data(), past_.data(), *products});
        else
            nscdd::sweep(problem);
    }

    ResidualParts residual(const ContactProblem<M>& problem) const { return residual_parts(problem, free_); }
    FreeVelocities<M> free_velocities(const ContactProblem<M>&) const { return free_; }
    void store(ContactProblem<M>&) const {}  // is there

    void keep(const ContactProblem<M>& problem) {
        kept_ = true;
        iterate_.take(problem);
    }
    const detail::Iterate<M>* kept(const ContactProblem<M>&) const { return kept_ ? &iterate_ : nullptr; }

    double* row(std::size_t body) { return rows_.row(body); }
    void put_rows(const ContactProblem<M>& problem, const std::vector<int>& bodies) {
        for (const int b : bodies)
            rows_.set_velocity(static_cast<std::size_t>(b), problem.bodies[static_cast<std::size_t>(b)].v);
    }
    void read_rows(ContactProblem<M>& problem, const std::vector<int>& bodies) const {
        for (const int b : bodies)
            problem.bodies[static_cast<std::size_t>(b)].v = rows_.velocity(static_cast<std::size_t>(b));
    }

    std::size_t driven_batches(SweepPass) const { return 0; }
    std::size_t bytes() const { return bytes_; }

  private:
    BodyStore<M> rows_;  ///< for gluing and combining alone
    FreeVelocities<M> free_;
    std::size_t bytes_ = 0;
    bool kept_ = false;
    detail::Iterate<M> iterate_;
    PastVelocities<M> past_velocities_;
    std::vector<double> metric_;             ///< of each contact, in the order of a sweep
    std::vector<typename M::Impulse> past_;  ///< iterates and changes of each contact
};

}}}  // namespace nscdd::NSCDD_ABI::detail
