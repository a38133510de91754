#pragma once

#include "nscdd/comm/meter.hpp"
#include "nscdd/sweep/sweeper.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The sweeper of one problem, whose work a meter counts where it is done.
template <class M>
class MeteredSweeper {
  public:
    /// Of the k-th hosted rank. Without a meter nothing is counted.
    MeteredSweeper(Sweeper<M>& sweeper, ContactProblem<M>& problem, SweepFront front = {}, Meter* meter = nullptr,
                   std::size_t k = 0)
        : sweeper_(sweeper), problem_(problem), front_(front), meter_(meter), k_(k) {}

    void sweep(const Anderson* anderson, Anderson::Products& products) {
        if (anderson)
            sweeper_.sweep(problem_, *anderson, products);
        else
            sweeper_.sweep(problem_);
        count_pass(anderson, problem_.contact_count(), SweepPass::all);
    }
    void begin(const Anderson* anderson) { sweeper_.begin(problem_, anderson); }
    void pass(SweepPass which, const Anderson* anderson, Anderson::Products& products, SweepPiece piece = {}) {
        sweeper_.pass(problem_, which, anderson, &products, piece);
        const std::size_t grains = problem_.contacts.size() - front_.contacts,
                          walls = problem_.wall_contacts.size() - front_.wall_contacts;
        count_pass(anderson,
                   which == SweepPass::first        ? front_.contacts + front_.wall_contacts
                   : which == SweepPass::rest       ? walls + grains
                   : which == SweepPass::rest_walls ? walls
                                                    : piece.end(grains) - piece.begin(grains),
                   which);
    }
    ResidualParts residual() {
        count_test();
        return sweeper_.residual(problem_);
    }
    /// To be called by who goes through the contacts for an estimate, which costs what a residual does.
    void count_test() { count(Work::residual, problem_.contact_count()); }

  private:
    void count_pass(bool accelerated, std::size_t contacts, SweepPass which) {
        count(accelerated ? Work::accelerated : Work::sweep, contacts);
        count(Work::driven, sweeper_.driven_batches(which));
    }
    void count(Work kind, std::size_t units) {
        if (meter_) meter_->charge(k_, kind, double(units), double(sweeper_.bytes()));
    }

    Sweeper<M>& sweeper_;
    ContactProblem<M>& problem_;
    SweepFront front_;
    Meter* meter_;
    std::size_t k_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
