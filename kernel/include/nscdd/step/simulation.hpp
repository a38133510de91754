#pragma once

#include <array>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "nscdd/decompose/directory.hpp"
#include "nscdd/decompose/multiplicity.hpp"
#include "nscdd/decompose/nscdd_solve.hpp"
#include "nscdd/detect/narrow_phase.hpp"
#include "nscdd/detect/tunnelling.hpp"
#include "nscdd/step/broad_phase.hpp"
#include "nscdd/step/checked_solve.hpp"
#include "nscdd/step/energy.hpp"
#include "nscdd/step/missed.hpp"
#include "nscdd/step/refusals.hpp"
#include "nscdd/step/scene_sums.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Moreau-Jean time stepping over any communicator: detection in two levels, one contact problem a step.
/// ```
/// nscdd::InProcess comm(8);
/// nscdd::Simulation<Model> simulation(comm, settings, grains);
/// const auto solve = nscdd::by_nscdd<nscdd::Dcs<Model>>(options);
/// nscdd::StepReport report = simulation.step(solve);
/// ```
/// No process ever has all grains or contacts. Each rank is sent what belongs to it.
template <class M>
class Simulation {
  public:
    /// Ids of the grains that stay where others are removed.
    enum class Numbering {
        kept,       ///< as they are
        closed_up,  ///< less by the number of lower ones that were removed: ids from 0 on stay so
    };

    /// Makes a simulation. Collective. Each process passes the grains that it has, whichever they are. All others of
    /// the scene come from the other processes, each grain from one. Impulses likewise.
    ///
    /// A simulation can go on where another one stopped. It needs:
    ///
    /// - the grains of that one;
    /// - as `last` its gather_rough(), whose positions are in the order of the grains passed;
    /// - pair() of its gather_contacts();
    /// - its settings() with its walls.
    ///
    /// On as many ranks the steps are then, to the last bit, those of a simulation that goes on. On another number of
    /// ranks `last` still tells when the next broad phase comes.
    ///
    /// Throws std::invalid_argument, the same on every process, for a scene that cannot be:
    ///
    /// - no step h, or no grain (unless SimulationSettings::may_be_empty);
    /// - two grains of one id, or a radius or mass that is not positive and finite;
    /// - an impulse that is not finite;
    /// - a driven wall without mass, or a cell that check_cell() refuses;
    /// - a partition that does not know whose a grain is (repartition()).
    ///
    /// Throws std::logic_error as Communicator::turn() says.
    Simulation(Communicator& comm, SimulationSettings<M> settings, std::span<const Grain<M>> grains,
               std::span<const PairImpulse<M>> impulses = {}, const BroadPhaseState<M>* last = nullptr);

    ///@{
    /// Makes one step of h. Collective. It throws, the same on every rank:
    ///
    /// - StepRefused when grains overlap too much or pass through each other unseen;
    /// - another std::runtime_error when the numbers are no longer finite;
    /// - std::invalid_argument for no solver, and for walls that no scene can have;
    /// - the exceptions of repartition().
    ///
    /// It throws std::logic_error, on its own process, when a solver has left other contacts, bodies or walls than it
    /// was given. So it does for a call within tasks of each_rank() or beside another thread that uses the
    /// communicator.
    template <class Solver>
    StepReport step(const Solver& solve) {
        using Held = std::decay_t<Solver>;  // a function is held by its address
        static_assert(std::copy_constructible<Held>,
                      "Simulation::step: a solver is copied, so what it has must be, or is held by std::shared_ptr");
        static_assert(StepSolver<Held, M> || !std::copy_constructible<Held>,
                      "Simulation::step: a solver is called with (std::span<Subdomain<M>>, Communicator&, "
                      "PhaseSeconds&) and returns a SolveReport, see decompose/step_solver.hpp");
        if constexpr (StepSolver<Held, M>) return step(AnyStepSolver<M>(solve));
    }
    StepReport step(const AnyStepSolver<M>& solve);
    ///@}

    ///@{
    /// Grains enter and leave, between two steps. Collective. The next broad phase comes at once; impulses stay with
    /// their pairs. measure() and the like see no contacts until a step is made.
    ///
    /// Each process passes the grains that it inserts, with ids that the scene does not have. Throws
    /// std::invalid_argument, the same on every process and before anything has changed, for a grain that cannot be,
    /// for an id that there is, and where a stress drives the cell. A grain that overlaps another one is refused by the
    /// next step.
    void insert(std::span<const Grain<M>> grains);
    /// Asks which(grain) for every grain, on one process each; it must not throw. Returns those removed, each on the
    /// process that was asked. Loads, friction and radii of others stay. A scene may lose all of its grains.
    std::vector<Grain<M>> remove(const std::function<bool(const Grain<M>&)>& which,
                                 Numbering numbering = Numbering::kept);
    ///@}

    Communicator& comm() const { return comm_; }  ///< communicator that it was made with
    /// Subdomains of the ranks that the process hosts. Throws std::logic_error for a simulation that was moved; so do
    /// all functions that measure or gather one.
    const std::vector<Subdomain<M>>& parts() const {
        check_there();
        return parts_;
    }
    const SimulationSettings<M>& settings() const { return settings_; }  ///< with walls and cell as they are now
    std::span<Wall<M>> walls() { return settings_.walls; }  ///< to change a force or a velocity between steps
    const std::vector<Wall<M>>& walls() const { return settings_.walls; }  ///< as they are now
    /// Obstacles where they are now; null where there are none.
    const detail::PlacedObstacles<M>* obstacles() const {
        check_there();
        return parts_[0].obstacles.get();
    }
    const PhaseSeconds& seconds() const { return seconds_; }  ///< time of this process so far, by phases [s]
    std::size_t grain_count() const { return grains_; }       ///< of the whole scene
    double least_radius() const { return radii_.least; }      ///< of the whole scene [m]
    int steps() const { return steps_; }                      ///< number of steps made by step()
    double time() const { return time(0); }                   ///< of the scene now [s]
    /// Of the grains of a hosted subdomain, mass times change of velocity in the last step [kg m/s] (measures.hpp).
    double largest_momentum_change(std::size_t part) const {
        return momentum_changes_.empty() ? 0 : momentum_changes_[part];
    }
    /// The last broad phase. Throws std::logic_error for a simulation that was moved.
    const detail::BroadPhase<M>& broad_phase() const {
        check_there();
        return broad_;
    }

  private:
    using Velocities = detail::Velocities;

    /// Counts grains and finds candidates after some have come or gone.
    void take_stock();

    void check_there() const {
        if (parts_.empty()) throw std::logic_error("Simulation: nothing is left of one that was moved");
    }

    /// All moves for `dt` [s] by the velocities that it got `since` [s] ago. In a cell that flows these are what they
    /// were then, also of images: so a gap that the law keeps open at the detection is open at the next one.
    /// Walls with a path are where it is at the end: it begins and ends after these shares of the step.
    void drift(double dt, double since, double begin, double end) {
        Cell<M>& cell = settings_.cell;
        const bool flows = cell.flows();
        const typename M::Gradient flow = cell.gradient_after(since);
        comm_.each_rank([&](std::size_t k) {
            for (auto& g : parts_[k].grains) {
                typename M::Vec v = g.velocity.template head<M::dim>();
                if (flows) v += detail::flow_over<M>(flow, g.position - cell.low - since * v);
                g.position += dt * v;
            }
        });
        for (auto& wall : settings_.walls)
            wall.offset +=
                wall.path ? wall.normal.dot(wall.path(time(end)) - wall.path(time(begin))) : dt * wall.normal_speed();
        place_obstacles(time(end));
        if (!flows) return;
        broad_.flow(flow, dt);
        cell.move_images(flow, dt);
        for (auto& part : parts_) part.cell = cell;
    }

    /// Time of the scene after a share of the next step [s]. Of a simulation that goes on, the same to the last bit.
    double time(double share) const {
        return settings_.start_time + (double(settings_.steps_before + steps_) + share) * settings_.h;
    }
    /// Tells subdomains where obstacles are at a time [s], and what they do in the next step.
    void place_obstacles(double now) {
        if (settings_.obstacles.empty()) return;
        detail::PlacedObstacles<M> placed =
            parts_[0].obstacles
                ? *parts_[0].obstacles
                : detail::PlacedObstacles<M>(std::make_shared<const std::vector<Obstacle<M>>>(settings_.obstacles),
                                             settings_.walls.size());
        const double detection = 1 - settings_.theta;
        placed.move_to(now);
        placed.begin_step(time(detection - 1), time(detection + 1), settings_.h);
        const auto shared = std::make_shared<const detail::PlacedObstacles<M>>(std::move(placed));
        for (auto& part : parts_) part.obstacles = shared;
    }
    /// Sets the velocities of walls with a path for the next step.
    void follow_paths() {
        const double detection = 1 - settings_.theta, h = settings_.h;
        for (auto& wall : settings_.walls) {
            if (!wall.path) continue;
            const typename M::Vec before = wall.path(time(detection - 1)), now = wall.path(time(detection)),
                                  next = wall.path(time(detection + 1));
            wall.velocity = (next - now) / h;
            wall.change = wall.velocity - (now - before) / h;
        }
    }

    /// Throws StepRefused for a reason that is the same on every rank.
    [[noreturn]] void refuse(std::string reason) const {
        throw StepRefused({.step = steps_ + 1, .reason = std::move(reason)});
    }
    /// Refuses a cell that has become too small.
    void check_sides() const {
        for (int d = 0; d < M::dim; ++d) {
            if (!settings_.cell.too_short(d, radii_.largest)) continue;
            std::string reason = "the side of the cell along ";
            reason += "xyz"[d];
            reason += " is ";
            reason += Cell<M>::shortest;
            refuse(std::move(reason));
        }
    }

    /// Motion of the scene. Throws std::runtime_error when it is not finite.
    detail::Motion motion(Velocities which, double lookahead = 0) {
        detail::Motion all = detail::find_motion<M>(parts_, comm_, settings_.walls, broad_.offsets(), broad_.stretch(),
                                                    which, lookahead);
        all.speed += settings_.h * settings_.gravity.norm();
        if (const auto& obstacles = parts_[0].obstacles) {
            all.note(obstacles->moved(broad_.time(), obstacles->time() + lookahead),
                     obstacles->moved(obstacles->time(), obstacles->time() + settings_.h) / settings_.h);
        }
        if (settings_.cell.flows()) {
            all.moved += 0.5 * broad_.strained(settings_.cell.gradient, lookahead, radii_.largest);
            all.speed +=
                M::dim * settings_.cell.gradient.cwiseAbs().maxCoeff() * (radii_.largest + 0.5 * broad_.skin());
        }
        if (!std::isfinite(all.moved + all.speed))
            throw std::runtime_error("step " + std::to_string(steps_ + 1) +
                                     ": positions or velocities are no longer finite");
        if (const double most = 0.2 * settings_.cell.least_size(); settings_.h * all.speed > most)
            refuse("grains move by more than a fifth of the cell within the step: take h <= " +
                   detail::two_digits(0.999 * most / all.speed, std::floor) + " s");
        return all;
    }

    void count_grains() {
        const detail::GrainCount all = detail::count_grains(parts_, comm_);
        grains_ = static_cast<std::size_t>(all.grains);
        radii_ = all.radii();
        mass_ = all.mass;
        for (auto& part : parts_) {
            part.problem.h = settings_.h;
            part.problem.least_radius = radii_.least;
        }
    }

    void detect_roughly(double needed) { broad_.renew(parts_, comm_, settings_, radii_, needed); }

    struct Detected {
        double contacts = 0, worst_overlap = 0;  ///< over the smaller radius
        auto summed() { return std::tie(contacts); }
        auto largest() { return std::tie(worst_overlap); }
    };

    /// A solve of a step, which is solved again while its answer changes which pairs are contacts.
    struct Attempt {
        int number = 1;
        double speed = 0;    ///< largest of any body, before the step and in its answers [m/s]
        bool seeks = true;   ///< contacts of grains that pass each other, see complete()
        bool wide() const {  ///< all pairs that bodies so fast could close are contacts
            return number > 5;
        }
    };

    /// Pairs that may close their gap in the step become contacts. A step that has not settled after some attempts
    /// takes in more: a blow goes on through a row of gaps, one an attempt.
    detail::Alert alert(const Attempt& attempt) const {
        const double h = settings_.h, small = 2e-3 * radii_.least;
        return {h, 2 * h * h * settings_.gravity.norm(),
                attempt.wide() ? (std::max)(2 * h * attempt.speed, small) : small};
    }

    /// Finds contacts and multiplicities.
    void detect(const detail::Alert& alert, StepReport& report) {
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

    /// Splits masses, sets free velocities and warm start, and counts over the scene.
    void start_iteration(StepReport& report) {
        detail::split_masses<M>(parts_, settings_.walls, settings_.gravity, settings_.h);
        const detail::FreeState all = detail::find_free_state(parts_, comm_, settings_.walls);
        report.interface_grains = all.interface_grains;
        report.free_norm = std::sqrt(all.energy);
        comm_.each_rank([this](std::size_t k) { detail::apply_impulses(parts_[k].problem); });
    }

    /// Checks the motion of (1 - theta) h before the first detection. No step has checked it, and a stored state may
    /// come from another h.
    void check_first_drift() {
        const double time = (1 - settings_.theta) * settings_.h;
        const detail::Motion start = motion(Velocities::known, time);
        if (2 * start.moved > broad_.spare_skin(settings_)) detect_roughly(2.2 * time * start.speed);
        std::vector<detail::Passage> passages(parts_.size());
        const Unsettled any = reduce<Unsettled>(comm_, [&](std::size_t k) {
            passages[k] = detail::find_early_passage<M>(parts_[k], settings_.walls, settings_.materials, settings_.h,
                                                        settings_.theta, settings_.largest_overlap);
            return Unsettled{.passages = double(passages[k].found())};
        });
        if (any.passages > 0) refuse_passages(passages, Velocities::known);
    }

    /// Changes that a further attempt needs, above 0 on any rank. A contact is to be none, a candidate is to be one, or
    /// there is a passage.
    struct Unsettled {
        double passes = 0, closes = 0, passages = 0;
        auto summed() { return std::tie(); }
        auto largest() { return std::tie(passes, closes, passages); }
    };

    /// Returns false if the velocities found could close a pair that was not among the contacts, or if grains of a
    /// contact pass each other. The step is then solved again with that pair, or without. The broad phase is renewed
    /// first if grains move farther than its skin allows.
    bool complete(Attempt& attempt) {
        if (attempt.number > 50)
            throw std::runtime_error("step " + std::to_string(steps_ + 1) +
                                     ": detection does not settle, take a smaller step");
        const detail::Motion after = motion(Velocities::solved, settings_.h);
        attempt.speed = (std::max)(attempt.speed, after.speed);
        if (2 * after.moved > broad_.spare_skin(settings_)) {
            detect_roughly(2.2 * settings_.h * after.speed);
            attempt.seeks = true;  // candidates are new
            return false;
        }
        std::vector<detail::Passage> passages(parts_.size());
        const Unsettled any = reduce<Unsettled>(comm_, [&](std::size_t k) {
            const bool passes = attempt.seeks && detail::mark_passing(parts_[k], settings_.h);
            const detail::Tunnelled unseen = detail::find_tunnelled<M>(
                parts_[k], settings_.walls, settings_.materials, settings_.h, after.speed, settings_.largest_overlap);
            passages[k] = unseen.passage;
            return Unsettled{double(passes), double(unseen.closes), double(unseen.passage.found())};
        });
        if (any.closes > 0) detail::mark_missed(parts_, comm_, any.passes > 0);
        // Not each time, as of many grains some pass in each attempt: 55,000 did not settle in 50.
        attempt.seeks = !attempt.wide() && Attempt{attempt.number + 1}.wide();
        if (any.passes > 0 || any.closes > 0) return false;
        if (any.passages > 0) refuse_passages(passages, Velocities::solved);
        return true;
    }

    /// Throws StepRefused. Collective.
    [[noreturn]] void refuse_passages(const std::vector<detail::Passage>& passages, Velocities which) const {
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
        detail::refuse(comm_, steps_ + 1, passages, within, settings_.largest_overlap);
    }

    /// Writes velocities of the step into grains and walls.
    void commit() {
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
        parts_[0].problem.each_side([this](const WallBody<M>& side, int d) {
            settings_.cell.gradient(d, d) = side.speed / settings_.cell.length;
        });
        for (auto& part : parts_) part.cell.gradient = settings_.cell.gradient;
    }

    Communicator& comm_;
    SimulationSettings<M> settings_;
    std::vector<Subdomain<M>> parts_;
    detail::BroadPhase<M> broad_;
    detail::Radii radii_;
    double mass_ = 0;  ///< of all grains [kg]
    std::size_t grains_ = 0;
    int steps_ = 0;
    std::vector<double> momentum_changes_;  ///< largest change of a momentum in each part, in the last step [kg m/s]
    PhaseSeconds seconds_;
};

// Not in the class: functions there are compiled by all who call them, even where they are declared `extern template`.

template <class M>
Simulation<M>::Simulation(Communicator& comm, SimulationSettings<M> settings, std::span<const Grain<M>> grains,
                          std::span<const PairImpulse<M>> impulses, const BroadPhaseState<M>* last)
    : comm_(comm), settings_(std::move(settings)) {
    const Turn::Hold hold(comm_.turn(), "Simulation");
    detail::check_settings(settings_);
    detail::throw_collectively(comm_, [&](std::size_t k) {
        if (k > 0) return;
        detail::check_grains<M>(grains, settings_.materials.count());
        detail::check_impulses<M>(impulses);
        if (last) detail::check_rough(*last, grains.size(), settings_.walls.size());
    });
    for (int rank : comm_.ranks()) {
        Subdomain<M>& part = parts_.emplace_back();
        part.rank = rank;
    }
    for (const auto& grain : grains) {
        parts_[0].grains.push_back(grain);
        parts_[0].replicas.push_back(parts_[0].rank);
        parts_[0].replica_begin.push_back(static_cast<int>(parts_[0].replicas.size()));
    }
    detail::check_ids<M>(parts_, comm_);
    count_grains();
    if (grains_ == 0 && !settings_.may_be_empty) throw std::invalid_argument("the scene has no grains");
    settings_.cell.length = 2 * radii_.largest;
    follow_paths();
    detail::check_cell<M>(settings_.cell, settings_.walls, radii_.largest, mass_);
    for (auto& part : parts_) part.cell = settings_.cell;
    Stopwatch watch(comm_);
    if (last) place_obstacles(last->time);
    if (last) broad_.repeat(parts_, comm_, settings_, radii_, *last);
    place_obstacles(time(0));
    if (!last) detect_roughly(0);
    std::vector<std::vector<PairImpulse<M>>> handed(parts_.size());
    handed[0].assign(impulses.begin(), impulses.end());
    detail::hand_out_impulses(parts_, comm_, handed);
    watch.lap(seconds_.detect);
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
    if (broad_.due(settings_) || 2 * before.moved > broad_.spare_skin(settings_)) detect_roughly(0);
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

#include "nscdd/step/exchange.hpp"
