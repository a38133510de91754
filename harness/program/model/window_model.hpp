// The window of one model's step, see window.hpp. Included by run_model.hpp only.
#pragma once

#include <algorithm>

#include "model/run_costs.hpp"
#include "model/run_request.hpp"
#include "nscdd/nscdd.hpp"

namespace nscdd::run_detail {

// Thrown by a step solver to end the step without an answer.
struct StepAbandoned {};

// What a process has spent and done so far, as WindowResult has it for each of its ranks.
inline Buffer read_meters(const Communicator& comm, const PhaseSeconds& seconds, const WorkDone& done) {
    const Communicator::Seconds inside = comm.seconds();
    Buffer row{comm.now(), seconds.sweep.own + seconds.test.own, seconds.interface.own, inside.wait, inside.transfer};
    const Buffer sent = communicated(comm);
    row.insert(row.end(), sent.begin(), sent.end());
    row.insert(row.end(), done.begin(), done.end());
    return row;
}

// Solves the next step twice from one start, with `skip` iterations and with window.iterations more: the difference is
// the time of those, without set-up. solver(options) returns the step solver.
template <class M>
WindowResult time_window(Simulation<M>& simulation, const WindowRequest& window, SolveOptions options, auto&& solver) {
    Communicator& comm = simulation.comm();
    const LoadMeter load;
    options.tolerance = 0;  // never reached: both solves end at their cap
    std::vector<Buffer> repeats;
    double contacts = 0;
    const AnyStepSolver<M> time = [&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) -> SolveReport {
        const std::vector<Subdomain<M>> start(parts.begin(), parts.end());
        contacts = reduce(comm, 1, [&](std::size_t k) { return Buffer{double(parts[k].problem.contact_count())}; })[0];
        const auto spent = [&](int iterations) {
            options.max_iterations = iterations;
            const AnyStepSolver<M> solve = solver(options);
            std::ranges::copy(start, parts.begin());
            PhaseSeconds seconds;
            comm.reduce(std::vector<Buffer>(comm.ranks().size()), 0);  // all begin together
            Buffer row = read_meters(comm, seconds, window.done());
            solve(parts, comm, seconds);
            const Buffer after = read_meters(comm, seconds, window.done());
            for (std::size_t c = 0; c < row.size(); ++c) row[c] = after[c] - row[c];
            return row;
        };
        // The first solve on a simulated machine leaves its ranks 1 ms apart, which a window by CCS would count.
        spent(window.skip);
        for (int r = 0; r < window.repeat; ++r) {
            const Buffer shorter = spent(window.skip), longer = spent(window.skip + window.iterations);
            Buffer& row = repeats.emplace_back(longer);
            for (std::size_t c = 0; c < row.size(); ++c) row[c] = (longer[c] - shorter[c]) / window.iterations;
        }
        throw StepAbandoned{};
    };
    try {
        simulation.step(time);
    } catch (const StepAbandoned&) {
    }
    if (repeats.empty()) throw InputError("the step has no contacts, there is nothing to time");

    // by the slowest rank's time, the same order on all ranks
    std::vector<std::pair<double, std::size_t>> order;
    const auto by_each = [&comm](const Buffer& row) { return std::vector<Buffer>(comm.ranks().size(), row); };
    for (std::size_t r = 0; r < repeats.size(); ++r) order.emplace_back(comm.reduce(by_each({repeats[r][0]}), 0)[0], r);
    std::ranges::sort(order);
    if (order[(order.size() - 1) / 2].first <= 0)
        throw InputError("the iterations of a window take less than the clock can tell, choose a longer window");
    const Buffer& median = repeats[order[(order.size() - 1) / 2].second];
    WindowResult result;
    result.contacts = contacts;
    for (const auto& [seconds, r] : order) result.repeats.push_back(seconds);
    result.load = gather_load(load, comm);
    result.rows = rows_of(comm.all_gather(by_each(median)), median.size());
    return result;
}

}  // namespace nscdd::run_detail
