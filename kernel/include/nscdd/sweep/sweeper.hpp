#pragma once

#include "nscdd/sweep/batch_sweeper.hpp"
#include "nscdd/sweep/contact_sweeper.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// What Sweeper asks of its two kinds, whose members mean what its own do. make_room(): accelerate() for the first
/// time.
template <class S, class M>
concept Sweeps = requires(S& s, const S& told, ContactProblem<M>& problem, const Anderson* anderson,
                          Anderson::Products* products, const std::vector<int>& bodies) {
    s.make_room(problem, 1);
    s.restore_velocities(problem);
    s.begin(problem, anderson);
    s.pass(problem, SweepPass::all, anderson, products, SweepPiece{});
    { told.residual(problem) } -> std::same_as<ResidualParts>;
    { told.free_velocities(problem) } -> std::same_as<FreeVelocities<M>>;
    told.store(problem);
    s.keep(problem);
    { s.kept(problem) } -> std::same_as<const detail::Iterate<M>*>;
    { s.row(std::size_t{0}) } -> std::same_as<double*>;
    s.put_rows(problem, bodies);
    told.read_rows(problem, bodies);
    { told.driven_batches(SweepPass::all) } -> std::same_as<std::size_t>;
    { told.bytes() } -> std::same_as<std::size_t>;
};

}  // namespace detail

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
    /// Takes over velocities and impulses. `relaxation` is omega, between 0 and 2. The layout fits levers and inertias
    /// of solid grains in 3D. A problem that it does not fit is swept where it is, all of it in the first pass.
    void load(ContactProblem<M>& problem, double relaxation = 1, detail::SweepFront front = {});

    /// Prepares sweeps with an Anderson of this window. The first call makes room for its iterates and changes, and
    /// sets its metric.
    void accelerate(const ContactProblem<M>& problem, int window);

    /// Sets V = V_free + M^-1 H r of the impulses held here. Copies have to be glued after it.
    void restore_velocities(ContactProblem<M>& problem);

    ///@{
    /// Makes one sweep over all contacts. `problem` is that of load(); the speeds of its walls are used and changed.
    /// With an Anderson the sweep starts from its combination of iterates, and adds the products of these contacts to
    /// `products` [J].
    void sweep(ContactProblem<M>& problem) {
        begin(problem);
        pass(problem, detail::SweepPass::all);
    }
    void sweep(ContactProblem<M>& problem, const detail::Anderson& anderson, detail::Anderson::Products& products) {
        begin(problem, &anderson);
        pass(problem, detail::SweepPass::all, &anderson, &products);
    }
    ///@}

    /// Begins the passes of a sweep; to be called once before them. Without acceleration `anderson` is null, and
    /// `products` of pass() may be null.
    void begin(ContactProblem<M>& problem, const detail::Anderson* anderson = nullptr);
    /// Makes a part of a sweep. SweepPass::first comes before or after all others. `anderson` is as in begin(),
    /// `products` as in sweep().
    void pass(ContactProblem<M>& problem, detail::SweepPass which, const detail::Anderson* anderson = nullptr,
              detail::Anderson::Products* products = nullptr, detail::SweepPiece piece = {});

    /// Sums of residual_parts(problem), for the velocities and impulses held here.
    ResidualParts residual(const ContactProblem<M>& problem) const;
    /// V_free of the problem of load().
    detail::FreeVelocities<M> free_velocities(const ContactProblem<M>& problem) const;
    /// Writes velocities and impulses back into the problem.
    void store(ContactProblem<M>& problem) const;

    /// Keeps the iterate as it is. The cost is a fifth of a sweep.
    void keep(const ContactProblem<M>& problem);
    /// The iterate that keep() has kept last, or null if it has not been called since load().
    const detail::Iterate<M>* kept(const ContactProblem<M>& problem);

    /// Velocity of a body, M::dof doubles until the next load(): linear [m/s], then spins, in one unit for all copies.
    double* row(int body) {
        return of(*this, [&](auto& sweeps) { return sweeps.row(static_cast<std::size_t>(body)); });
    }
    /// Fills these bodies' rows from their velocities in the problem of load(), before rows are glued; only where not
    /// batched().
    void put_rows(const ContactProblem<M>& problem, const std::vector<int>& bodies);
    /// Reads the velocities of these bodies from their rows, after rows are glued; only where not batched().
    void read_rows(ContactProblem<M>& problem, const std::vector<int>& bodies) const;

    bool batched() const { return batched_; }  ///< whether the layout fits the problem of load()
    /// Number of batches with driven walls in a pass. Each waits for the speeds that the one before it leaves.
    std::size_t driven_batches(detail::SweepPass which) const {
        return of(*this, [&](auto& sweeps) { return sweeps.driven_batches(which); });
    }
    /// Indices into problem.contacts in the order of a sweep, where batched(): detail::batch_size a batch, padded by
    /// -1.
    const std::vector<int>& order() const { return batches_.order(); }
    const std::vector<int>& wall_order() const { return batches_.wall_order(); }  ///< of wall_contacts

    /// Memory that a sweep reads and writes [bytes], without that of acceleration.
    std::size_t bytes() const {
        return of(*this, [](auto& sweeps) { return sweeps.bytes(); });
    }

  private:
    static_assert(detail::Sweeps<detail::BatchSweeper<M>, M> && detail::Sweeps<detail::ContactSweeper<M>, M>);

    /// Calls call(sweeps) with the kind of sweeps that has the problem.
    static decltype(auto) of(auto& self, auto&& call) {
        return self.batched_ ? call(self.batches_) : call(self.contacts_);
    }

    bool batched_ = false;
    int window_ = 0;  ///< of accelerate() since the last load(); 0: not accelerated
    detail::BatchSweeper<M> batches_;
    detail::ContactSweeper<M> contacts_;
};

// Defined outside of the class, so that an explicit instantiation elsewhere is the only one.

template <class M>
void Sweeper<M>::load(ContactProblem<M>& problem, double relaxation, detail::SweepFront front) {
    batched_ = batches_.load(problem, relaxation, front);
    if (!batched_) contacts_.load(problem, relaxation);
    window_ = 0;
}

template <class M>
void Sweeper<M>::accelerate(const ContactProblem<M>& problem, int window) {
    if (window_ != 0) return;
    window_ = window;
    of(*this, [&](auto& sweeps) { sweeps.make_room(problem, window); });
}

template <class M>
void Sweeper<M>::restore_velocities(ContactProblem<M>& problem) {
    of(*this, [&](auto& sweeps) { sweeps.restore_velocities(problem); });
}

template <class M>
void Sweeper<M>::begin(ContactProblem<M>& problem, const detail::Anderson* anderson) {
    of(*this, [&](auto& sweeps) { sweeps.begin(problem, anderson); });
}

template <class M>
void Sweeper<M>::pass(ContactProblem<M>& problem, detail::SweepPass which, const detail::Anderson* anderson,
                      detail::Anderson::Products* products, detail::SweepPiece piece) {
    of(*this, [&](auto& sweeps) { sweeps.pass(problem, which, anderson, products, piece); });
}

template <class M>
ResidualParts Sweeper<M>::residual(const ContactProblem<M>& problem) const {
    return of(*this, [&](auto& sweeps) { return sweeps.residual(problem); });
}

template <class M>
detail::FreeVelocities<M> Sweeper<M>::free_velocities(const ContactProblem<M>& problem) const {
    return of(*this, [&](auto& sweeps) { return sweeps.free_velocities(problem); });
}

template <class M>
void Sweeper<M>::store(ContactProblem<M>& problem) const {
    of(*this, [&](auto& sweeps) { sweeps.store(problem); });
}

template <class M>
void Sweeper<M>::keep(const ContactProblem<M>& problem) {
    of(*this, [&](auto& sweeps) { sweeps.keep(problem); });
}

template <class M>
const detail::Iterate<M>* Sweeper<M>::kept(const ContactProblem<M>& problem) {
    return of(*this, [&](auto& sweeps) -> const detail::Iterate<M>* { return sweeps.kept(problem); });
}

template <class M>
void Sweeper<M>::put_rows(const ContactProblem<M>& problem, const std::vector<int>& bodies) {
    of(*this, [&](auto& sweeps) { sweeps.put_rows(problem, bodies); });
}

template <class M>
void Sweeper<M>::read_rows(ContactProblem<M>& problem, const std::vector<int>& bodies) const {
    of(*this, [&](auto& sweeps) { sweeps.read_rows(problem, bodies); });
}

}}  // namespace nscdd::NSCDD_ABI
