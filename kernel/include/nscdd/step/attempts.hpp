/// @file
/// A step of a simulation: attempts, each with its contacts, until the answer changes them no more.
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "nscdd/decompose/multiplicity.hpp"
#include "nscdd/detect/narrow_phase.hpp"
#include "nscdd/detect/tunnelling.hpp"
#include "nscdd/step/checked_solve.hpp"
#include "nscdd/step/energy.hpp"
#include "nscdd/step/missed.hpp"
#include "nscdd/step/refusals.hpp"
#include "nscdd/step/simulation.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

template <class M>
detail::Alert Simulation<M>::alert(const Attempt& attempt) const {
    const double h = settings_.h, small = 2e-3 * radii_.least;
    return {h, 2 * h * h * settings_.gravity.norm(), attempt.wide() ? (std::max)(2 * h * attempt.speed, small) : small};
}

template <class M>
void Simulation<M>::detect(const detail::Alert& alert, StepReport& report) {
    struct Detected {
        double contacts = 0, worst_overlap = 0;  ///< over the smaller radius
        auto summed() { return std::tie(contacts); }
        auto largest() { return std::tie(worst_overlap); }
    };
    std::vector<detail::Overlap> worst(parts_.size());
    comm_.each_rank([&](std::size_t k) {
        worst[k] = detail::detect_contacts<M>(parts_[k], settings_.walls, settings_.materials, settings_.h, alert);
    });
    const Detected all = reduce<Detected>(comm_, [&](std::size_t k) {
        return Detected{double(parts_[k].problem.contact_count()), worst[k].ratio};
    });
    report.contacts = all.contacts;
    if (all.worst_overlap > settings_.largest_overlap)
        detail::refuse(comm_, steps_ + 1, worst, settings_.largest_overlap);
    detail::agree_on_multiplicities<M>(parts_, comm_, settings_.walls, settings_.multiplicity);
}

template <class M>
void Simulation<M>::start_iteration(StepReport& report) {
    detail::split_masses<M>(parts_, settings_.walls, settings_.gravity, settings_.h);
    const detail::FreeState all = detail::find_free_state(parts_, comm_, settings_.walls);
    report.interface_grains = all.interface_grains;
    report.free_norm = std::sqrt(all.energy);
    comm_.each_rank([this](std::size_t k) { detail::apply_impulses(parts_[k].problem); });
}

template <class M>
void Simulation<M>::check_first_drift() {
    const double time = (1 - settings_.theta) * settings_.h;
    const detail::Motion start = motion(Velocities::known, time);
    if (2 * start.moved > broad_.spare_skin(settings_)) renew_broad_phase(2.2 * time * start.speed);
    std::vector<detail::Tunnelling> tunnelling(parts_.size());
    const Unsettled any = reduce<Unsettled>(comm_, [&](std::size_t k) {
        tunnelling[k] = detail::find_early_tunnelling<M>(parts_[k], settings_.walls, settings_.materials, settings_.h,
                                                         settings_.theta, settings_.largest_overlap);
        return Unsettled{.tunnelling = double(tunnelling[k].found())};
    });
    if (any.tunnelling > 0) refuse_tunnelling(tunnelling, Velocities::known);
}

template <class M>
bool Simulation<M>::complete(Attempt& attempt) {
    if (attempt.number > 50)
        throw std::runtime_error("step " + std::to_string(steps_ + 1) +
                                 ": detection does not settle, take a smaller step");
    const detail::Motion after = motion(Velocities::solved, settings_.h);
    attempt.speed = (std::max)(attempt.speed, after.speed);
    if (2 * after.moved > broad_.spare_skin(settings_)) {
        renew_broad_phase(2.2 * settings_.h * after.speed);
        attempt.seeks = true;  // candidates are new
        return false;
    }
    std::vector<detail::Tunnelling> tunnelling(parts_.size());
    const Unsettled any = reduce<Unsettled>(comm_, [&](std::size_t k) {
        const bool passes = attempt.seeks && detail::mark_passing(parts_[k], settings_.h);
        const detail::Tunnelled unseen = detail::find_tunnelled<M>(parts_[k], settings_.walls, settings_.materials,
                                                                   settings_.h, after.speed, settings_.largest_overlap);
        tunnelling[k] = unseen.tunnelling;
        return Unsettled{double(passes), double(unseen.closes), double(unseen.tunnelling.found())};
    });
    if (any.closes > 0) detail::mark_missed(parts_, comm_, any.passes > 0);
    // Not each time, as of many grains some pass in each attempt: 55,000 did not settle in 50.
    attempt.seeks = !attempt.wide() && Attempt{attempt.number + 1}.wide();
    if (any.passes > 0 || any.closes > 0) return false;
    if (any.tunnelling > 0) refuse_tunnelling(tunnelling, Velocities::solved);
    return true;
}

template <class M>
void Simulation<M>::refuse(std::string reason) const {
    throw StepRefused({.step = steps_ + 1, .reason = std::move(reason)});
}

template <class M>
void Simulation<M>::refuse_tunnelling(const std::vector<detail::Tunnelling>& tunnelling, Velocities which) const {
    std::vector<double> within;
    for (const Subdomain<M>& part : parts_) {
        const auto velocity = [&](int grain) -> typename M::Vec {
            const auto g = static_cast<std::size_t>(grain);
            if (which == Velocities::solved) return part.problem.bodies[g].linear();
            return part.grains[g].velocity.template head<M::dim>();
        };
        const auto speed = [&](int number) {
            const auto w = static_cast<std::size_t>(number);
            const Wall<M>& wall = settings_.walls[w];
            return wall.velocity.dot(wall.normal) +
                   (which == Velocities::solved ? part.problem.walls[w].speed : wall.speed);
        };
        within.push_back(detail::step_that_sees_all<M>(part, settings_.walls, settings_.materials,
                                                       settings_.largest_overlap, velocity, speed));
    }
    detail::refuse(comm_, steps_ + 1, tunnelling, within, settings_.largest_overlap);
}

template <class M>
void Simulation<M>::commit() {
    momentum_changes_.assign(parts_.size(), 0.0);
    comm_.each_rank([this](std::size_t k) {
        Subdomain<M>& part = parts_[k];
        double largest = 0;
        for (std::size_t g = 0; g < part.grains.size(); ++g) {
            const typename M::Velocity& v = part.problem.bodies[g].v;
            const typename M::Velocity change = v - part.grains[g].velocity;
            if (!part.grains[g].fixed())
                largest = (std::max)(largest, part.grains[g].mass * change.template head<M::dim>().norm());
            part.grains[g].velocity = v;
        }
        momentum_changes_[k] = largest;
        for (auto& c : part.pairs) c.missed = c.passes = false;
        for (auto& c : part.wall_pairs) c.missed = false;
    });
    for (std::size_t w = 0; w < settings_.walls.size(); ++w)
        settings_.walls[w].speed = parts_[0].problem.walls[w].speed;
    if (!settings_.cell.any_driven()) return;
    parts_[0].problem.each_side(
        [this](const WallBody<M>& side, int d) { settings_.cell.gradient(d, d) = side.speed / settings_.cell.length; });
    for (auto& part : parts_) part.cell.gradient = settings_.cell.gradient;
}

template <class M>
StepReport Simulation<M>::step(const AnyStepSolver<M>& solve) {
    if (!solve) throw std::invalid_argument("Simulation::step: the solver is empty");
    const Turn::Hold hold(comm_.turn(), "Simulation::step");
    check_there();
    detail::check_walls<M>(settings_.walls, settings_.materials.count());
    Stopwatch watch(comm_);
    StepReport report;
    follow_paths();
    if (steps_ == 0) check_first_drift();
    watch.lap(seconds_.detect);
    const double detection = 1 - settings_.theta;
    drift(detection * settings_.h, settings_.theta * settings_.h, 0, detection);
    check_sides();
    watch.lap(seconds_.advance);
    const detail::Motion before = motion(Velocities::known, settings_.h);
    if (broad_.due(settings_) || 2 * before.moved > broad_.spare_skin(settings_)) renew_broad_phase(0);
    int iterations = 0;
    Attempt attempt{.speed = before.speed};
    for (;; ++attempt.number) {
        detect(alert(attempt), report);
        watch.lap(seconds_.detect);
        start_iteration(report);
        watch.lap(seconds_.advance);
        if (report.contacts > 0) report.solve = detail::solve_checked<M>(solve, parts_, comm_, seconds_, steps_ + 1);
        iterations += report.solve.iterations;
        watch.skip();
        comm_.each_rank([&](std::size_t k) { detail::keep_impulses(parts_[k], settings_.walls.size(), steps_ + 1); });
        detail::share_velocities(parts_, comm_);
        watch.lap(seconds_.advance);
        const bool done = complete(attempt);
        watch.lap(seconds_.detect);
        if (done) break;
    }
    report.solve.iterations = iterations;
    report.attempts = attempt.number;
    report.energy = detail::step_energy<M>(parts_, comm_, settings_.walls, settings_.gravity, settings_.h);
    commit();
    drift(settings_.theta * settings_.h, 0, detection, 1);
    ++steps_;
    watch.lap(seconds_.advance);
    return report;
}

}}  // namespace nscdd::NSCDD_ABI
