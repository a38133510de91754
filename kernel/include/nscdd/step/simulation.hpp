#pragma once

#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "nscdd/decompose/step_solver.hpp"
#include "nscdd/detect/narrow_phase.hpp"
#include "nscdd/detect/tunnelling.hpp"
#include "nscdd/step/broad_phase.hpp"
#include "nscdd/step/report.hpp"
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
    /// - as `last` its gather_broad_phase(), whose positions are in the order of the grains passed;
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

    /// A solve of a step, which is solved again while its answer changes which pairs are contacts.
    struct Attempt {
        int number = 1;
        double speed = 0;    ///< largest of any body, before the step and in its answers [m/s]
        bool seeks = true;   ///< contacts of grains that pass each other, see complete()
        bool wide() const {  ///< all pairs that bodies so fast could close are contacts
            return number > 5;
        }
    };

    /// Changes that a further attempt needs, above 0 on any rank. A contact is to be none, a candidate is to be one, or
    /// there is tunnelling.
    struct Unsettled {
        double passes = 0, closes = 0, tunnelling = 0;
        auto summed() { return std::tie(); }
        auto largest() { return std::tie(passes, closes, tunnelling); }
    };

    void check_there() const {
        if (parts_.empty()) throw std::logic_error("Simulation: nothing is left of one that was moved");
    }
    /// Time of the scene after a share of the next step [s]. Of a simulation that goes on, the same to the last bit.
    double time(double share) const {
        return settings_.start_time + (double(settings_.steps_before + steps_) + share) * settings_.h;
    }
    void count_grains();
    void renew_broad_phase(double needed) { broad_.renew(parts_, comm_, settings_, radii_, needed); }
    /// Counts grains and finds candidates after some have come or gone.
    void take_stock();

    /// All moves for `dt` [s] by the velocities that it got `since` [s] ago. In a cell that flows these are what they
    /// were then, also of images: so a gap that the law keeps open at the detection is open at the next one.
    /// Walls with a path are where it is at the end: it begins and ends after these shares of the step.
    void drift(double dt, double since, double begin, double end);
    /// Tells subdomains where obstacles are at a time [s], and what they do in the next step.
    void place_obstacles(double now);
    /// Sets the velocities of walls with a path for the next step.
    void follow_paths();
    /// Refuses a cell that has become too small.
    void check_sides() const;
    /// Motion of the scene. Throws std::runtime_error when it is not finite.
    detail::Motion motion(Velocities which, double lookahead = 0);

    /// Pairs that may close their gap in the step become contacts. A step that has not settled after some attempts
    /// takes in more: a blow goes on through a row of gaps, one an attempt.
    detail::Alert alert(const Attempt& attempt) const;
    /// Finds contacts and multiplicities.
    void detect(const detail::Alert& alert, StepReport& report);
    /// Splits masses, sets free velocities and warm start, and counts over the scene.
    void start_iteration(StepReport& report);
    /// Checks the motion of (1 - theta) h before the first detection. No step has checked it, and a stored state may
    /// come from another h.
    void check_first_drift();
    /// Returns false if the velocities found could close a pair that was not among the contacts, or if grains of a
    /// contact pass each other. The step is then solved again with that pair, or without. The broad phase is renewed
    /// first if grains move farther than its skin allows.
    bool complete(Attempt& attempt);
    /// Throws StepRefused for a reason that is the same on every rank.
    [[noreturn]] void refuse(std::string reason) const;
    /// Throws StepRefused. Collective.
    [[noreturn]] void refuse_tunnelling(const std::vector<detail::Tunnelling>& tunnelling, Velocities which) const;
    /// Writes velocities of the step into grains and walls.
    void commit();

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

}}  // namespace nscdd::NSCDD_ABI

// Members, not in the class: functions there are compiled by all who call them, even where declared `extern template`.
#include "nscdd/step/attempts.hpp"
#include "nscdd/step/exchange.hpp"
#include "nscdd/step/motion.hpp"
#include "nscdd/step/start.hpp"
