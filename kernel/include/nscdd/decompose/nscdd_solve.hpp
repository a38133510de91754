// Alg. 1 of the paper, one step: sweeps on every subdomain, then gluing, until the residual is small.
#pragma once

#include <functional>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/decompose/scheme.hpp"
#include "nscdd/solve/nlgs.hpp"

namespace nscdd::inline NSCDD_ABI {

// Where the time of a process goes [s], what it spends inside the communicator left out. The phases of Alg. 1:
struct PhaseSeconds {
    double detect = 0;                // contact detection, new decomposition of the domain, multiplicities
    double sweep = 0, interface = 0;  // the iteration
    double advance = 0;               // initial velocities and impulses, motion of the grains
};

// Adds the time since the last lap to a phase.
class Stopwatch {
  public:
    explicit Stopwatch(const Communicator& comm) : comm_(comm), last_(reading()) {}
    void lap(double& phase) {
        const double now = reading();
        phase += now - last_;
        last_ = now;
    }
    void skip() { last_ = reading(); }

  private:
    double reading() const {
        const CommSeconds inside = comm_.seconds();
        return comm_.now() - inside.wait - inside.transfer;
    }
    const Communicator& comm_;
    double last_;
};

// What a step is solved by: by_nlgs(), by_nscdd(), or the caller's own.
template <class M>
using StepSolver = std::function<SolveReport(std::vector<Subdomain<M>>&, Communicator&, PhaseSeconds&)>;

// The residual of the whole scene, the same bits on every rank.
template <class M>
ResidualParts scene_residual(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
    std::vector<Buffer> mine(parts.size());
    comm.each_rank([&parts, &mine](std::size_t p) {
        const auto packed = parts[p].sweeper.residual(parts[p].problem).pack();
        mine[p].assign(packed.begin(), packed.end());
    });
    const std::span<const double> all = comm.all_gather(mine);
    ResidualParts total;
    for (std::size_t p = 0; p < all.size(); p += ResidualParts::size) total.add(ResidualParts::unpack(&all[p]));
    return total;
}

// In: split and prepared problems with V_free + M_E^-1 H_E r_E (warm start). Out: impulses, and velocities equal in
// all active copies. With one subdomain the numbers are those of nlgs(), bit for bit.
template <class M>
SolveReport nscdd_solve(std::vector<Subdomain<M>>& parts, Communicator& comm, CommunicationScheme<M>& scheme,
                        const SolveOptions& options, PhaseSeconds& seconds) {
    check_options(options);
    Stopwatch watch(comm);
    Anderson anderson(options.window);
    Buffer product(anderson.products());
    std::vector<Buffer> products(parts.size(), product);
    const std::function<void(std::size_t)> load = [&](std::size_t p) {
        prepare_contacts(parts[p].problem, options.relaxation);
        parts[p].sweeper.load(parts[p].problem, options.relaxation);
    };
    SolveReport report;
    bool accelerated = false;
    const std::function<void(std::size_t)> iterate = [&](std::size_t p) {
        ContactProblem<M>& problem = parts[p].problem;
        Sweeper<M>& sweeper = parts[p].sweeper;
        if (accelerated) {
            sweeper.accelerate(problem, options.window);
            std::copy_n(sweeper.sweep(problem, anderson).begin(), product.size(), products[p].begin());
        } else {
            sweeper.sweep(problem);
        }
        for (int s = 1; s < options.sweeps; ++s) sweeper.sweep(problem);
        sweeper.store(problem, parts[p].interface);
    };
    const std::function<void(std::size_t)> take_glued = [&](std::size_t p) {
        parts[p].sweeper.load(parts[p].problem, parts[p].interface);
    };
    const std::function<void(std::size_t)> restore_velocities = [&](std::size_t p) {
        parts[p].sweeper.restore_velocities(parts[p].problem);
        parts[p].sweeper.store(parts[p].problem, parts[p].interface);
    };
    comm.each_rank(load);  // before gluing: V_free follows from what the impulses alone have made of the copies
    watch.lap(seconds.sweep);
    scheme.setup(parts, comm);
    scheme.glue(parts, comm);  // the warm start's impulses met split masses: let the copies agree
    comm.each_rank(take_glued);
    watch.lap(seconds.interface);
    ResidualParts residual;
    bool over = false;
    while (!over) {
        accelerated = pays_to_accelerate(options, report, residual.contacts);
        const int count = until_test(options, report);
        for (int k = 0; k < count; ++k) {
            comm.each_rank(iterate);
            for (std::size_t p = 0; p < parts.size(); ++p)
                comm.charge(static_cast<int>(p),
                            options.sweeps * static_cast<double>(parts[p].problem.contact_count()));
            watch.lap(seconds.sweep);
            scheme.glue(parts, comm);
            comm.each_rank(take_glued);
            if (accelerated) {
                sum_in_rank_order(comm.all_gather(products), product);
                anderson.update(product.data());
            }
            watch.lap(seconds.interface);
        }
        report.iterations += count;
        residual = scene_residual(parts, comm);
        over = finished(residual, options, parts.front().problem.least_radius, report);
        if (over && anderson.parted()) {
            comm.each_rank(restore_velocities);
            watch.lap(seconds.sweep);
            scheme.glue(parts, comm);
            comm.each_rank(take_glued);
            watch.lap(seconds.interface);
            anderson.forget();
            residual = scene_residual(parts, comm);
            over = finished(residual, options, parts.front().problem.least_radius, report);
        }
        watch.lap(seconds.sweep);
    }
    comm.each_rank([&parts](std::size_t p) { parts[p].sweeper.store(parts[p].problem); });
    return report;
}

}  // namespace nscdd
