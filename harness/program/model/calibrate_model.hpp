// What the work of one model's step costs on this core, see calibrate.hpp. Included by run_model.hpp only.
#pragma once

#include <time.h>

#include <array>
#include <thread>

#include "model/run_request.hpp"
#include "model/window_model.hpp"
#include "nscdd/nscdd.hpp"
#include "registry/factors.hpp"

namespace nscdd::run_detail {

// Of this thread [s].
inline double thread_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// CPU seconds of one call: the median of five samples of at least `least` seconds, as windows are measured
// (window_model.hpp). begin() is called, untimed, before each batch of calls, which are 200 at most.
double seconds_of(double least, auto&& begin, auto&& call) {
    std::array<double, 5> samples;
    begin();
    call();  // brings the data into the caches
    for (double& sample : samples) {
        double took = 0, calls = 0;
        for (int batch = 1; took < least; batch = std::min(2 * batch, 200)) {  // reading the clock takes time too
            begin();
            const double began = thread_seconds();
            for (int c = 0; c < batch; ++c) call();
            took += thread_seconds() - began;
            calls += batch;
        }
        sample = took / calls;
    }
    std::ranges::sort(samples);
    return samples[2];
}
double seconds_of(double least, auto&& call) {
    return seconds_of(
        least, [] {}, call);
}

// Seconds of task(k) for the middle subdomain, while other cores run task(k) for other subdomains, as many as there are
// cores: ranks that share a memory slow each other down. begin(): as of seconds_of(), for the middle subdomain.
double seconds_among(std::size_t subdomains, const CalibrationRequest& request, auto&& begin, auto&& task) {
    const std::size_t mine = subdomains / 2, busy = std::min(subdomains, static_cast<std::size_t>(request.cores));
    std::vector<std::jthread> others;
    for (std::size_t c = 1; c < busy; ++c)
        others.emplace_back([&task, k = (mine + c) % subdomains](const std::stop_token& stop) {
            while (!stop.stop_requested()) task(k);
        });
    return seconds_of(request.least_seconds, begin, [&] { task(mine); });
}

// Cost of a contact from the time of a sweep: a batch with driven walls costs more than its contacts.
template <class M>
class SweepCosts {
  public:
    // `seconds`: of a sweep of `told`. Batches are measured on the subdomain that has most of them.
    SweepCosts(std::span<Subdomain<M>> parts, const Subdomain<M>& told, double seconds, double least)
        : contacts_(double(told.problem.contact_count())),
          driven_(double(told.sweeper.driven_batches(detail::SweepPass::all))) {
        const auto count = [](const Subdomain<M>& p) {
            return double(p.sweeper.driven_batches(detail::SweepPass::rest_walls));
        };
        Subdomain<M>& part = *std::ranges::max_element(parts, {}, count);
        batches_ = count(part);
        if (batches_ == 0) return;
        part.sweeper.begin(part.problem);
        const double walls = seconds_of(least, [&] { part.sweeper.pass(part.problem, detail::SweepPass::rest_walls); }),
                     touching = double(part.problem.wall_contacts.size() - part.interface_wall_contacts);
        // seconds = contacts_ c + driven_ b, walls = touching c + batches_ b
        const double contact = (seconds * batches_ - walls * driven_) / (contacts_ * batches_ - touching * driven_);
        batch_ = std::max(0.0, walls - touching * contact) / batches_;
    }
    bool any_driven() const { return batches_ > 0; }
    double batch() const { return batch_; }  // beyond its contacts [s]
    double contact(double seconds) const { return (seconds - driven_ * batch_) / contacts_; }  // of a sweep [s]

  private:
    double contacts_, driven_, batches_ = 0, batch_ = 0;
};

// Sweeps and tests one subdomain on each core, repeatedly, so that its data come from the cache that they would come
// from in a run.
template <class M>
void calibrate_sweeps(std::span<Subdomain<M>> parts, const CalibrationRequest& request,
                      std::vector<MeasuredCost>& costs) {
    Subdomain<M>& told = parts[parts.size() / 2];
    const std::vector<Subdomain<M>> start(parts.begin(), parts.end());
    const auto restart = [&](std::size_t k) { parts[k] = start[k]; };
    const auto note = [&](Work kind, double seconds) {
        costs.push_back({kind, double(told.sweeper.bytes()), 1e9 * seconds});
    };
    // Sweeps begin anew from the iteration that the step has come to, as long as in a window: a subdomain swept alone
    // for longer comes to rest, and whether its contacts stick is then foreseen by the processor. The sweeper keeps the
    // layout of the step's beginning: loaded now, it would put open contacts together, and sweep disks 12 % faster.
    constexpr int warm = 10;
    const auto seconds_of_sweep = [&](auto&& begin_anew, auto&& sweep) {
        const auto begin = [&] {
            begin_anew(parts.size() / 2);
            for (int s = 0; s < warm; ++s) sweep(parts.size() / 2);
        };
        for (std::size_t k = 0; k < parts.size(); ++k) begin_anew(k);
        return seconds_among(parts.size(), request, begin, sweep);
    };
    const double swept = seconds_of_sweep(restart, [&](std::size_t k) {
        Subdomain<M>& part = parts[k];
        part.sweeper.begin(part.problem);
        for (const detail::SweepPass pass : {detail::SweepPass::first, detail::SweepPass::rest})
            part.sweeper.pass(part.problem, pass);
    });
    const SweepCosts<M> sweep(parts, told, swept, request.least_seconds);
    note(Work::sweep, sweep.contact(swept));
    if (sweep.any_driven()) note(Work::driven, sweep.batch());
    std::vector<double> tested(parts.size());  // used below, lest the tests be optimised away
    const double testing = seconds_among(
        parts.size(), request, [] {},
        [&](std::size_t k) { tested[k] += parts[k].sweeper.residual(parts[k].problem).contacts; });
    note(Work::residual, testing / double(told.problem.contact_count()));
    if (tested[parts.size() / 2] == 0) throw std::logic_error("no contact was tested");
    const int window = SolveOptions{}.accelerated().window;
    std::vector<detail::Anderson> anderson(parts.size(), detail::Anderson(window));
    const double accelerated = seconds_of_sweep(
        [&](std::size_t k) {
            restart(k);
            anderson[k] = detail::Anderson(window);
            parts[k].sweeper.accelerate(parts[k].problem, window);
        },
        [&](std::size_t k) {
            Subdomain<M>& part = parts[k];
            detail::Anderson::Products products{};
            part.sweeper.begin(part.problem, &anderson[k]);
            for (const detail::SweepPass pass : {detail::SweepPass::first, detail::SweepPass::rest})
                part.sweeper.pass(part.problem, pass, &anderson[k], &products);
            anderson[k].update(products.data());
        });
    note(Work::accelerated, sweep.contact(accelerated));
}

// Packing and gluing of all subdomains in turn. Gluing includes the copy of the messages that a process makes of its
// own.
template <class Scheme, class M = typename Scheme::Model>
void calibrate_gluing(std::span<Subdomain<M>> parts, Communicator& comm, double least, Work glue,
                      std::vector<MeasuredCost>& costs) {
    Scheme scheme;
    scheme.setup(parts, comm);
    double copies = 0, bytes = 0;
    for (std::size_t k = 0; k < parts.size(); ++k) {
        bytes += double(parts[k].sweeper.bytes()) / double(parts.size());
        for (const int g : parts[k].interface) copies += parts[k].multiplicity(static_cast<std::size_t>(g));
    }
    double packed = 0;
    const auto pack = [&] {
        packed = 0;
        for (std::size_t k = 0; k < parts.size(); ++k) packed += double(scheme.pack(parts[k], k));
    };
    pack();
    if (packed == 0) return;  // no grain is shared
    const double packing = seconds_of(least, pack);
    if (glue == Work::glue) costs.push_back({Work::pack, bytes, 1e9 * packing / packed});
    costs.push_back({glue, bytes, 1e9 / copies * seconds_of(least, [&] {
                                      scheme.start();
                                      scheme.finish(parts, comm);
                                  })});
}

// Measures on the next step, after some of its iterations.
template <class M>
CalibrationResult calibrate_work(Simulation<M>& simulation, const CalibrationRequest& request, SolveOptions options) {
    options.tolerance = 0;
    options.max_newton_contacts = 0;  // all iterations are made, and nothing else
    options.max_iterations = 50;
    CalibrationResult result;
    const AnyStepSolver<M> measure = [&](std::span<Subdomain<M>> parts, Communicator& comm,
                                         PhaseSeconds& seconds) -> SolveReport {
        by_nscdd<Dcs<M, ClosedForm>>(options)(parts, comm, seconds);
        for (const Subdomain<M>& part : parts)
            result.contacts += double(part.problem.contact_count()) / double(parts.size());
        if (parts[parts.size() / 2].problem.contact_count() == 0) throw StepAbandoned{};  // the one that is measured
        calibrate_gluing<Dcs<M, ClosedForm>>(parts, comm, request.least_seconds, Work::glue, result.costs);
        calibrate_gluing<Dcs<M, Cholmod>>(parts, comm, request.least_seconds, Work::factorised, result.costs);
        calibrate_sweeps(parts, request, result.costs);
        throw StepAbandoned{};
    };
    try {
        simulation.step(measure);
    } catch (const StepAbandoned&) {
    }
    if (result.contacts == 0) throw InputError("the step has no contacts, there is nothing to measure");
    return result;
}

}  // namespace nscdd::run_detail
