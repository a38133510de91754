// Moreau-Jean time stepping over any communicator: detection in two levels, one contact problem a step.
//
//   nscdd::InProcess comm(8);
//   nscdd::Simulation<Model> simulation(comm, settings, grains);
//   const auto solve = nscdd::by_nscdd<nscdd::Dcs<Model>>(options);
//   nscdd::StepReport report = simulation.step(solve);
//
// No process ever has all grains or contacts: what belongs to a rank is sent there.
#pragma once

#include <array>
#include <limits>
#include <stdexcept>
#include <string>

#include "nscdd/decompose/directory.hpp"
#include "nscdd/decompose/multiplicity.hpp"
#include "nscdd/decompose/nscdd_solve.hpp"
#include "nscdd/detect/fine.hpp"
#include "nscdd/detect/passage.hpp"
#include "nscdd/step/broad_phase.hpp"
#include "nscdd/step/energy.hpp"
#include "nscdd/step/refusals.hpp"
#include "nscdd/step/settings.hpp"

namespace nscdd::inline NSCDD_ABI {

struct StepReport {               // of one step, the same on every rank
    SolveReport solve;            // of the last attempt; the iterations are those of all
    int attempts = 1;             // more than one when the answer closed a pair that was no contact
    double contacts = 0;          // number in the whole scene
    double interface_grains = 0;  // number in the whole scene: grains with contacts in several subdomains
    double free_norm = 0;         // sqrt(sum of V_free^T M V_free), driven walls included [J^1/2]
    StepEnergy energy;            // what changed the kinetic energy
};

template <class M>
class Simulation {
  public:
    // Collective. Each process passes the grains that it has, whichever; all others of the scene come from the other
    // processes, each grain from one. Impulses likewise.
    //
    // To go on where another simulation stopped, pass what it had: the grains and, as `last`, gather_rough(), whose
    // positions are in the order of the grains passed; pair() of gather_contacts(); settings() with its walls. On as
    // many ranks the steps are then, to the last bit, those of a simulation that goes on. On another number of ranks
    // `last` still tells when the next rough detection comes.
    //
    // Throws std::invalid_argument, the same on every process, for what no scene can have: no grain, two of one id, a
    // radius or mass that is not positive and finite, an impulse that is not finite, a driven wall without mass.
    Simulation(Communicator& comm, SimulationSettings<M> settings, std::span<const Grain<M>> grains,
               std::span<const PairImpulse<M>> impulses = {}, const RoughDetection<M>* last = nullptr)
        : comm_(comm), settings_(std::move(settings)) {
        check_settings(settings_);
        refuse_together(comm_, [&](std::size_t k) {
            if (k > 0) return;
            check_grains<M>(grains, settings_.materials.count());
            check_impulses<M>(impulses);
            if (last) check_rough(*last, grains.size(), settings_.walls.size());
        });
        for (int rank : comm_.ranks()) parts_.emplace_back().rank = rank;
        for (const auto& grain : grains) {
            parts_[0].grains.push_back(grain);
            parts_[0].sharers.push_back(parts_[0].rank);
            parts_[0].sharer_begin.push_back(static_cast<int>(parts_[0].sharers.size()));
        }
        check_ids(parts_, comm_);
        count_grains();
        Stopwatch watch(comm_);
        if (last)
            broad_.repeat(parts_, comm_, settings_, radii_, *last);
        else
            detect_roughly(0);
        std::vector<std::vector<PairImpulse<M>>> handed(parts_.size());
        handed[0].assign(impulses.begin(), impulses.end());
        hand_out_impulses(parts_, comm_, handed);
        watch.lap(seconds_.detect);
    }

    // One step of h. Collective. Throws, the same on every rank, std::runtime_error when grains overlap too much, pass
    // through each other unseen, or the numbers are no longer finite, std::invalid_argument for no solver and for walls
    // that have become what no scene can have; std::logic_error, on its own process, when a solver has left another
    // number of contacts, bodies or walls than it was given.
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
    StepReport step(const AnyStepSolver<M>& solve) {
        if (!solve) throw std::invalid_argument("Simulation::step: the solver is empty");
        if (parts_.empty()) throw std::logic_error("Simulation::step: nothing is left of a simulation that was moved");
        check_walls<M>(settings_.walls, settings_.materials.count());
        Stopwatch watch(comm_);
        StepReport report;
        if (steps_ == 0) check_first_drift();
        watch.lap(seconds_.detect);
        drift((1 - settings_.theta) * settings_.h);
        watch.lap(seconds_.advance);
        const Survey before = survey(Velocities::known);
        if (broad_.due(settings_) || 2 * before.moved > broad_.skin()) detect_roughly(0);
        int iterations = 0;
        for (;; ++report.attempts) {
            detect(std::max(2 * settings_.h * before.speed, 2e-3 * radii_.least), report);
            watch.lap(seconds_.detect);
            start_iteration(report);
            watch.lap(seconds_.advance);
            if (report.contacts > 0) report.solve = solve_checked(solve);
            iterations += report.solve.iterations;
            watch.skip();
            for (auto& part : parts_) keep_impulses(part);
            share_velocities(parts_, comm_);
            watch.lap(seconds_.advance);
            const bool done = complete(report.attempts);
            watch.lap(seconds_.detect);
            if (done) break;
        }
        report.solve.iterations = iterations;
        report.energy = step_energy<M>(parts_, comm_, settings_.walls, settings_.gravity, settings_.h);
        commit();
        drift(settings_.theta * settings_.h);
        ++steps_;
        watch.lap(seconds_.advance);
        return report;
    }

    Communicator& comm() const { return comm_; }                         // that it was made with
    const std::vector<Subdomain<M>>& parts() const { return parts_; }    // of the ranks that the process hosts
    const SimulationSettings<M>& settings() const { return settings_; }  // with the walls as they are now
    std::span<Wall<M>> walls() { return settings_.walls; }  // to change a force or a velocity between steps
    const std::vector<Wall<M>>& walls() const { return settings_.walls; }  // as they are now
    const PhaseSeconds& seconds() const { return seconds_; }               // time of this process so far, by phases [s]
    std::size_t grain_count() const { return grains_; }                    // of the whole scene
    double least_radius() const { return radii_.least; }                   // of the whole scene [m]
    int steps() const { return steps_; }                                   // number of steps made by step()
    const BroadPhase<M>& broad_phase() const { return broad_; }            // the last rough detection

  private:
    struct Survey {
        double moved = 0;  // farthest that anything is from where the candidates were found [m]
        double speed = 0;  // largest [m/s]
        auto summed() { return std::tie(); }
        auto largest() { return std::tie(moved, speed); }
    };

    enum class Velocities { known, solved };  // before the step, or of its problem

    auto velocity(const Subdomain<M>& part, std::size_t g, Velocities which) const -> typename M::Vec {
        return which == Velocities::known ? part.grains[g].velocity.template head<M::dim>()
                                          : part.problem.bodies[g].linear();
    }
    double normal_speed(std::size_t w, Velocities which) const {
        const Wall<M>& wall = settings_.walls[w];
        if (which == Velocities::solved) return wall.velocity.dot(wall.normal) + parts_[0].problem.walls[w].speed;
        return wall.normal_speed();
    }

    void drift(double dt) {
        for (auto& part : parts_)
            for (auto& g : part.grains) g.position += dt * g.velocity.template head<M::dim>();
        for (auto& wall : settings_.walls) wall.offset += dt * wall.normal_speed();
    }

    // Unlike std::max it keeps a NaN.
    static double larger_or_nan(double a, double b) { return std::isnan(a) || a >= b ? a : b; }

    // Largest values over the scene, by one reduction. Throws std::runtime_error when they are not finite.
    Survey survey(Velocities which, double lookahead = 0) {
        Survey total = reduce<Survey>(comm_, [&](std::size_t k) {
            const Subdomain<M>& part = parts_[k];
            Survey s;
            for (std::size_t g = 0; g < part.grains.size(); ++g) {
                const typename M::Vec v = velocity(part, g, which);
                s.speed = larger_or_nan(s.speed, v.norm());
                s.moved =
                    larger_or_nan(s.moved, (part.grains[g].position + lookahead * v - part.rough_position[g]).norm());
            }
            return s;
        });
        for (std::size_t w = 0; w < settings_.walls.size(); ++w) {
            const Wall<M>& wall = settings_.walls[w];
            const double speed = normal_speed(w, which);
            total.speed = larger_or_nan(total.speed, std::abs(speed));
            total.moved = larger_or_nan(total.moved, std::abs(wall.offset + lookahead * speed - broad_.offsets()[w]));
        }
        total.speed += settings_.h * settings_.gravity.norm();
        if (!std::isfinite(total.moved + total.speed))
            throw std::runtime_error("step " + std::to_string(steps_ + 1) +
                                     ": positions or velocities are no longer finite");
        return total;
    }

    struct GrainCount {
        double grains = 0;
        double minus_least = -std::numeric_limits<double>::infinity(), most = minus_least;  // radii [m]
        auto summed() { return std::tie(grains); }
        auto largest() { return std::tie(minus_least, most); }
    };

    void count_grains() {
        const GrainCount all = reduce<GrainCount>(comm_, [this](std::size_t k) {
            GrainCount mine;
            mine.grains = double(parts_[k].grains.size());
            for (const auto& g : parts_[k].grains) {
                mine.minus_least = std::max(mine.minus_least, -g.radius);
                mine.most = std::max(mine.most, g.radius);
            }
            return mine;
        });
        if (all.grains == 0) throw std::invalid_argument("the scene has no grains");
        grains_ = static_cast<std::size_t>(all.grains);
        radii_ = {-all.minus_least, all.most};
        for (auto& part : parts_) {
            part.problem.h = settings_.h;
            part.problem.least_radius = radii_.least;
        }
    }

    void detect_roughly(double needed) { broad_.renew(parts_, comm_, settings_, radii_, needed); }

    struct Detected {
        double contacts = 0, worst_overlap = 0;  // over the smaller radius
        auto summed() { return std::tie(contacts); }
        auto largest() { return std::tie(worst_overlap); }
    };

    // Contacts and multiplicities.
    void detect(double alert, StepReport& report) {
        std::vector<Overlap> worst(parts_.size());
        comm_.each_rank([&](std::size_t k) {
            worst[k] = detect_contacts<M>(parts_[k], settings_.walls, settings_.materials, settings_.h, alert);
        });
        const Detected all = reduce<Detected>(comm_, [&](std::size_t k) {
            return Detected{double(parts_[k].problem.contact_count()), worst[k].ratio};
        });
        report.contacts = all.contacts;
        if (all.worst_overlap > settings_.largest_overlap) {
            Overlap deepest;
            for (const Buffer& o : gathered([&](std::size_t k) {
                     return Buffer{worst[k].ratio, double(worst[k].i), double(worst[k].j)};
                 }))
                if (o[0] > deepest.ratio) deepest = {o[0], static_cast<int>(o[1]), static_cast<int>(o[2])};
            throw std::runtime_error(refusal(steps_ + 1, deepest, settings_.largest_overlap));
        }
        agree_on_multiplicities<M>(parts_, comm_, settings_.walls);
    }

    // Split masses, free velocities, warm start; counts over the scene.
    void start_iteration(StepReport& report) {
        split_masses<M>(parts_, settings_.walls, settings_.gravity, settings_.h);
        count_scene(report);
        comm_.each_rank([this](std::size_t k) { apply_impulses(parts_[k].problem); });
    }

    struct SceneCount {
        double interface_grains = 0, energy = 0;  // energy: V_free^T M V_free [J]
        auto summed() { return std::tie(interface_grains, energy); }
        auto largest() { return std::tie(); }
    };

    void count_scene(StepReport& report) {
        SceneCount all = reduce<SceneCount>(comm_, [this](std::size_t k) {
            const Subdomain<M>& part = parts_[k];
            SceneCount mine;
            for (std::size_t g = 0; g < part.grains.size(); ++g) {
                if (!part.primary(g)) continue;
                const Grain<M>& grain = part.grains[g];
                const Body<M>& body = part.problem.bodies[g];
                mine.interface_grains += part.problem.multiplicity[g] > 1;
                mine.energy += grain.mass * body.linear().squaredNorm() + grain.inertia * body.spin().squaredNorm();
            }
            return mine;
        });
        for (std::size_t w = 0; w < settings_.walls.size(); ++w)
            all.energy += settings_.walls[w].mass * std::pow(parts_[0].problem.walls[w].speed, 2);
        report.interface_grains = all.interface_grains;
        report.free_norm = std::sqrt(all.energy);
    }

    SolveReport solve_checked(const AnyStepSolver<M>& solve) {
        const auto sizes = [](const ContactProblem<M>& p) {
            return std::array{p.contacts.size(), p.wall_contacts.size(), p.bodies.size(), p.walls.size()};
        };
        constexpr std::array names{"contacts between grains", "contacts with walls", "bodies", "walls"};
        std::vector<std::array<std::size_t, names.size()>> given;
        for (const auto& part : parts_) given.push_back(sizes(part.problem));
        const SolveReport report = solve(parts_, comm_, seconds_);
        for (std::size_t k = 0; k < parts_.size(); ++k)
            for (std::size_t n = 0; n < names.size(); ++n)
                if (const std::size_t left = sizes(parts_[k].problem)[n]; left != given[k][n])
                    throw std::logic_error("step " + std::to_string(steps_ + 1) + ", subdomain " +
                                           std::to_string(parts_[k].rank) + ": " + names[n] + " were " +
                                           std::to_string(given[k][n]) + ", the solver has made them " +
                                           std::to_string(left));
        return report;
    }

    static void keep_impulses(Subdomain<M>& part) {
        for (std::size_t c = 0; c < part.source.size(); ++c)
            part.pairs[static_cast<std::size_t>(part.source[c])].r = part.problem.contacts[c].r;
        for (std::size_t c = 0; c < part.wall_source.size(); ++c)
            part.wall_pairs[static_cast<std::size_t>(part.wall_source[c])].r = part.problem.wall_contacts[c].r;
    }

    // Checks the motion of (1 - theta) h before the first detection: no step has checked it, and a stored state may
    // come from another h.
    void check_first_drift() {
        const double time = (1 - settings_.theta) * settings_.h;
        const Survey start = survey(Velocities::known, time);
        if (2 * start.moved > broad_.skin()) detect_roughly(2.2 * time * start.speed);
        std::vector<Passage> passages;
        const std::span<const double> all = reduce(comm_, 0, [&](std::size_t k) {
            passages.push_back(find_early_passage<M>(parts_[k], settings_.walls, settings_.materials, settings_.h,
                                                     settings_.theta, settings_.largest_overlap));
            return Buffer{double(passages[k].found())};
        });
        if (all[0] > 0) refuse_passage(passages);
    }

    // What task(k) returns for each rank, of all ranks. Only called once something is wrong.
    std::vector<Buffer> gathered(auto&& task) const {
        std::vector<Buffer> mine, all;
        for (std::size_t k = 0; k < parts_.size(); ++k) mine.push_back(task(k));
        const std::span<const double> rows = comm_.all_gather(mine);
        for (std::size_t p = 0; p < rows.size(); p += mine[0].size())
            all.emplace_back(rows.begin() + static_cast<std::ptrdiff_t>(p),
                             rows.begin() + static_cast<std::ptrdiff_t>(p + mine[0].size()));
        return all;
    }

    // passages[k]: of the k-th hosted rank; on some rank there is one.
    [[noreturn]] void refuse_passage(const std::vector<Passage>& passages) const {
        Passage worst;
        for (const Buffer& p : gathered([&](std::size_t k) {
                 return Buffer{passages[k].h, double(passages[k].i), double(passages[k].j)};
             }))
            worst.note({p[0], static_cast<int>(p[1]), static_cast<int>(p[2])});
        throw std::runtime_error(refusal(steps_ + 1, worst, settings_.largest_overlap));
    }

    // False if the velocities found could close a pair that was not among the contacts: the step is then solved again
    // with that pair. The broad phase is renewed first if grains move farther than its skin allows.
    bool complete(int attempt) {
        if (attempt > 50)
            throw std::runtime_error("step " + std::to_string(steps_ + 1) +
                                     ": detection does not settle, take a smaller step");
        const Survey after = survey(Velocities::solved, settings_.h);
        if (2 * after.moved > broad_.skin()) {
            detect_roughly(2.2 * settings_.h * after.speed);
            return false;
        }
        std::vector<Passage> passages;
        const std::span<const double> all = reduce(comm_, 0, [&](std::size_t k) {
            const Unseen unseen = find_unseen<M>(parts_[k], settings_.walls, settings_.materials, settings_.h,
                                                 after.speed, settings_.largest_overlap);
            passages.push_back(unseen.passage);
            return Buffer{double(unseen.missed), double(unseen.passage.found())};
        });
        if (all[0] > 0) return false;
        if (all[1] > 0) refuse_passage(passages);
        return true;
    }

    // Velocities of the step into grains and walls.
    void commit() {
        for (auto& part : parts_) {
            for (std::size_t g = 0; g < part.grains.size(); ++g) part.grains[g].velocity = part.problem.bodies[g].v;
            for (auto& c : part.pairs) c.missed = false;
            for (auto& c : part.wall_pairs) c.missed = false;
        }
        for (std::size_t w = 0; w < settings_.walls.size(); ++w)
            settings_.walls[w].speed = parts_[0].problem.walls[w].speed;
    }

    Communicator& comm_;
    SimulationSettings<M> settings_;
    std::vector<Subdomain<M>> parts_;
    BroadPhase<M> broad_;
    Radii radii_;
    std::size_t grains_ = 0;
    int steps_ = 0;
    PhaseSeconds seconds_;
};

}  // namespace nscdd
