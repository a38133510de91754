// Moreau-Jean time stepping over any communicator: detection in two levels, one contact problem a step.
//
//   nscdd::InProcess comm(8);
//   nscdd::Simulation<Model> simulation(comm, settings, grains);
//   const auto solve = nscdd::by_nscdd<nscdd::Dcs<Model>>(options);
//   nscdd::StepReport report = simulation.step(solve);
//
// Every process passes all grains of the scene and keeps those that belong to its ranks.
#pragma once

#include <limits>
#include <stdexcept>
#include <string>

#include "nscdd/decompose/multiplicity.hpp"
#include "nscdd/decompose/nscdd_solve.hpp"
#include "nscdd/decompose/repartition.hpp"
#include "nscdd/detect/fine.hpp"

namespace nscdd {

template <class M>
struct SimulationSettings {
    std::vector<Wall<M>> walls;
    Materials materials{1};
    typename M::Vec gravity = M::Vec::Zero();
    double h = 1e-3;               // [s]
    double theta = 0.5;            // of the Moreau-Jean scheme, 0.5 to 1 in use
    int rough_every = 10;          // steps between rough detections; sooner when grains have moved too far
    GridCells<M::dim> cells{};     // subdomains per axis; zeros: chosen from the number of ranks
    double largest_overlap = 0.1;  // of a radius; more is an error
};

struct StepReport {
    SolveReport solve;
    int attempts = 1;     // more than one when the answer closed a pair that was no contact
    double contacts = 0;  // of the whole scene
    double interface_grains = 0;
    double free_norm = 0;  // sqrt(sum of V_free^T M V_free), driven walls included
};

template <class M>
class Simulation {
  public:
    // Throws std::invalid_argument for what no scene can have: no grain, a radius or mass that is not positive and
    // finite, an impulse that is not finite, a driven wall without mass.
    Simulation(Communicator& comm, SimulationSettings<M> settings, std::span<const Grain<M>> grains,
               std::span<const PairImpulse<M>> impulses = {})
        : comm_(comm), settings_(std::move(settings)) {
        check(grains);
        for (const auto& p : impulses)
            if (!p.r.allFinite())
                throw std::invalid_argument("the impulse of grain " + std::to_string(p.i) + " is not finite");
        typename M::Vec low = grains.front().position, high = low;
        least_radius_ = largest_radius_ = grains.front().radius;
        for (const auto& g : grains) {
            low = low.cwiseMin(g.position);
            high = high.cwiseMax(g.position);
            least_radius_ = std::min(least_radius_, g.radius);
            largest_radius_ = std::max(largest_radius_, g.radius);
        }
        if (settings_.cells[0] == 0) settings_.cells = choose_cells<M>(comm_.size(), high - low);
        const Grid<M> grid(settings_.cells, low, high);
        for (int rank : comm_.ranks()) {
            Subdomain<M>& part = parts_.emplace_back();
            part.rank = rank;
            for (const auto& g : grains) {
                if (grid.owner(g.position) != rank) continue;
                part.grains.push_back(g);
                part.sharers.push_back(rank);
                part.sharer_begin.push_back(static_cast<int>(part.sharers.size()));
            }
            part.rough_position.resize(part.grains.size());
            part.problem.h = settings_.h;
            part.problem.least_radius = least_radius_;
        }
        Stopwatch watch(comm_);
        rough(0);
        for (auto& part : parts_) set_impulses<M>(part, impulses);
        watch.lap(seconds_.detect);
    }

    // One step. Throws std::runtime_error, the
    // same on every rank, when grains overlap too much or the numbers are no longer finite.
    StepReport step(const StepSolver<M>& solve) {
        Stopwatch watch(comm_);
        StepReport report;
        drift((1 - settings_.theta) * settings_.h);
        watch.lap(seconds_.advance);
        const Survey before = survey([](const Subdomain<M>& part, std::size_t g) { return part.grains[g].velocity; });
        if (++since_rough_ > settings_.rough_every || 2 * before.moved > skin_) rough(0);
        int iterations = 0;
        for (;; ++report.attempts) {
            detect(std::max(2 * settings_.h * before.speed, 2e-3 * least_radius_), report);
            watch.lap(seconds_.detect);
            start_iteration(report);
            watch.lap(seconds_.advance);
            if (report.contacts > 0) report.solve = solve(parts_, comm_, seconds_);
            iterations += report.solve.iterations;
            watch.skip();
            for (auto& part : parts_) keep_impulses(part);
            share_velocities();
            watch.lap(seconds_.advance);
            const bool done = complete(report.attempts);
            watch.lap(seconds_.detect);
            if (done) break;
        }
        report.solve.iterations = iterations;
        commit();
        drift(settings_.theta * settings_.h);
        ++steps_;
        watch.lap(seconds_.advance);
        return report;
    }

    Communicator& comm() const { return comm_; }
    const std::vector<Subdomain<M>>& parts() const { return parts_; }
    const SimulationSettings<M>& settings() const { return settings_; }
    std::vector<Wall<M>>& walls() { return settings_.walls; }  // to change a force or a velocity between steps
    const std::vector<Wall<M>>& walls() const { return settings_.walls; }
    const PhaseSeconds& seconds() const { return seconds_; }
    double least_radius() const { return least_radius_; }
    int steps() const { return steps_; }

  private:
    struct Survey {
        double moved = 0;  // farthest that anything is from where the candidates were found [m]
        double speed = 0;  // largest [m/s]
    };

    void check(std::span<const Grain<M>> grains) const {
        if (grains.empty()) throw std::invalid_argument("the scene has no grains");
        for (const auto& g : grains) {
            const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
            const char* what = !positive(g.radius)                                           ? "radius"
                               : !positive(g.mass)                                           ? "mass"
                               : M::friction && !positive(g.inertia)                         ? "inertia"
                               : !g.position.allFinite()                                     ? "position"
                               : !g.velocity.allFinite() || !g.load.allFinite()              ? "velocity or load"
                               : g.material < 0 || g.material >= settings_.materials.count() ? "material"
                               : g.id < 0                                                    ? "id"
                                                                                             : nullptr;
            if (what) throw std::invalid_argument("grain " + std::to_string(g.id) + ": " + what + " is not valid");
        }
        std::vector<int> ids;
        for (const auto& g : grains) ids.push_back(g.id);
        std::sort(ids.begin(), ids.end());
        if (const auto twice = std::adjacent_find(ids.begin(), ids.end()); twice != ids.end())
            throw std::invalid_argument("grain " + std::to_string(*twice) + ": there are two of this id");
        if (!settings_.gravity.allFinite()) throw std::invalid_argument("gravity is not finite");
        if (!(settings_.h > 0 && std::isfinite(settings_.h)) || !(settings_.theta >= 0 && settings_.theta <= 1))
            throw std::invalid_argument("the step must be positive and theta within [0, 1]");
        if (!(settings_.largest_overlap >= 0)) throw std::invalid_argument("the largest overlap must not be negative");
        for (const auto& wall : settings_.walls) {
            const std::string name = "wall " + std::to_string(&wall - settings_.walls.data()) + ": ";
            if (!std::isfinite(wall.offset + wall.force + wall.mass + wall.speed) || !wall.velocity.allFinite())
                throw std::invalid_argument(name + "place, velocity, force or mass is not finite");
            if (wall.material < 0 || wall.material >= settings_.materials.count())
                throw std::invalid_argument(name + "material is not valid");
            if (wall.driven && !(wall.mass > 0)) throw std::invalid_argument("a driven wall needs a positive mass");
            if (!(std::abs(wall.normal.norm() - 1) < 1e-9))
                throw std::invalid_argument("a wall's normal must be a unit vector");
        }
        int product = 1;
        for (int cells : settings_.cells) product *= cells;
        if (settings_.cells[0] != 0 && product != comm_.size())
            throw std::invalid_argument("the grid's cells must be as many as the ranks");
    }

    void drift(double dt) {
        for (auto& part : parts_)
            for (auto& g : part.grains) g.position += dt * g.velocity.template head<M::dim>();
        for (auto& wall : settings_.walls) wall.offset += dt * wall.normal_speed();
    }

    // Unlike std::max it keeps a NaN.
    static double larger(double a, double b) { return std::isnan(a) || a >= b ? a : b; }

    // Largest values over the scene, with one all-gather. Throws std::runtime_error when they are not finite.
    Survey survey(auto&& velocity, double lookahead = 0) {
        std::vector<Buffer> mine;
        for (const auto& part : parts_) {
            Survey s;
            for (std::size_t g = 0; g < part.grains.size(); ++g) {
                const typename M::Vec v = velocity(part, g).template head<M::dim>();
                s.speed = larger(s.speed, v.norm());
                s.moved = larger(s.moved, (part.grains[g].position + lookahead * v - part.rough_position[g]).norm());
            }
            mine.push_back({s.moved, s.speed});
        }
        const std::span<const double> all = comm_.all_gather(mine);
        Survey total;
        for (std::size_t p = 0; p < all.size(); p += 2) {
            total.moved = larger(total.moved, all[p]);
            total.speed = larger(total.speed, all[p + 1]);
        }
        for (std::size_t w = 0; w < settings_.walls.size(); ++w) {
            const Wall<M>& wall = settings_.walls[w];
            double speed = wall.normal_speed();
            if (lookahead > 0) speed = wall.velocity.dot(wall.normal) + parts_[0].problem.walls[w].speed;
            total.speed = larger(total.speed, std::abs(speed));
            total.moved = larger(total.moved, std::abs(wall.offset + lookahead * speed - rough_offset_[w]));
        }
        total.speed += settings_.h * settings_.gravity.norm();
        if (!std::isfinite(total.moved + total.speed))
            throw std::runtime_error("step " + std::to_string(steps_ + 1) +
                                     ": positions or velocities are no longer finite");
        return total;
    }

    // Rough detection with a skin that the next steps should not use up, and at least `needed`.
    void rough(double needed) {
        std::vector<Buffer> mine;
        for (const auto& part : parts_) {
            typename M::Vec low = M::Vec::Constant(std::numeric_limits<double>::max()), high = -low;
            double speed = 0;
            for (const auto& g : part.grains) {
                low = low.cwiseMin(g.position);
                high = high.cwiseMax(g.position);
                speed = std::max(speed, g.velocity.template head<M::dim>().norm());
            }
            Buffer& out = mine.emplace_back(low.data(), low.data() + M::dim);
            out.insert(out.end(), high.data(), high.data() + M::dim);
            out.push_back(speed);
        }
        const std::span<const double> all = comm_.all_gather(mine);
        typename M::Vec low = Eigen::Map<const typename M::Vec>(all.data());
        typename M::Vec high = Eigen::Map<const typename M::Vec>(all.data() + M::dim);
        double speed = settings_.h * settings_.gravity.norm();
        for (std::size_t p = 0; p < all.size(); p += 2 * M::dim + 1) {
            low = low.cwiseMin(Eigen::Map<const typename M::Vec>(all.data() + p));
            high = high.cwiseMax(Eigen::Map<const typename M::Vec>(all.data() + p + M::dim));
            speed = std::max(speed, all[p + 2 * M::dim]);
        }
        for (const auto& wall : settings_.walls) speed = std::max(speed, std::abs(wall.normal_speed()));
        const double step_reach = settings_.h * speed;
        const double wanted =
            std::clamp(2.2 * settings_.rough_every * step_reach, 0.05 * least_radius_, 0.5 * least_radius_);
        skin_ = std::max({wanted, 4.4 * step_reach, needed});
        repartition<M>(parts_, comm_, Grid<M>(settings_.cells, low, high), settings_.walls, skin_, largest_radius_);
        rough_offset_.clear();
        for (const auto& wall : settings_.walls) rough_offset_.push_back(wall.offset);
        since_rough_ = 0;
    }

    // Contacts and multiplicities.
    void detect(double alert, StepReport& report) {
        std::vector<Buffer> mine(parts_.size());
        comm_.each_rank([&](std::size_t k) {
            const Overlap worst =
                detect_contacts<M>(parts_[k], settings_.walls, settings_.materials, settings_.h, alert);
            mine[k] = {double(parts_[k].problem.contact_count()), worst.ratio, double(worst.i), double(worst.j)};
        });
        Overlap worst;
        report.contacts = 0;
        const std::span<const double> all = comm_.all_gather(mine);
        for (std::size_t p = 0; p < all.size(); p += 4) {
            report.contacts += all[p];
            if (all[p + 1] > worst.ratio)
                worst = {all[p + 1], static_cast<int>(all[p + 2]), static_cast<int>(all[p + 3])};
        }
        if (worst.ratio > settings_.largest_overlap) throw std::runtime_error(overlap_message(worst));
        agree_on_multiplicities<M>(parts_, comm_, settings_.walls);
    }

    // Split masses, free velocities, warm start; counts over the scene.
    void start_iteration(StepReport& report) {
        split_masses<M>(parts_, settings_.walls, settings_.gravity, settings_.h);
        count_scene(report);
        comm_.each_rank([this](std::size_t k) {
            prepare_contacts(parts_[k].problem);  // for solvers of the caller's own
            apply_impulses(parts_[k].problem);
        });
    }

    std::string overlap_message(const Overlap& worst) const {
        const std::string other =
            worst.j < 0 ? "wall " + std::to_string(-1 - worst.j) : "grain " + std::to_string(worst.j);
        return "step " + std::to_string(steps_ + 1) + ": grain " + std::to_string(worst.i) + " and " + other +
               " overlap by " + std::to_string(100 * worst.ratio) + " % of a radius (at most " +
               std::to_string(100 * settings_.largest_overlap) + " %)";
    }

    void count_scene(StepReport& report) {
        std::vector<Buffer> mine;
        for (const auto& part : parts_) {
            double interface = 0, energy = 0;
            for (std::size_t g = 0; g < part.grains.size(); ++g) {
                if (!part.primary(g)) continue;
                const Grain<M>& grain = part.grains[g];
                const Body<M>& body = part.problem.bodies[g];
                interface += part.problem.multiplicity[g] > 1;
                energy += grain.mass * body.linear().squaredNorm() + grain.inertia * body.spin().squaredNorm();
            }
            mine.push_back({interface, energy});
        }
        std::array<double, 2> sum;
        sum_in_rank_order(comm_.all_gather(mine), sum);
        for (std::size_t w = 0; w < settings_.walls.size(); ++w)
            sum[1] += settings_.walls[w].mass * std::pow(parts_[0].problem.walls[w].speed, 2);
        report.interface_grains = sum[0];
        report.free_norm = std::sqrt(sum[1]);
    }

    static void keep_impulses(Subdomain<M>& part) {
        for (std::size_t c = 0; c < part.source.size(); ++c)
            part.pairs[static_cast<std::size_t>(part.source[c])].r = part.problem.contacts[c].r;
        for (std::size_t c = 0; c < part.wall_source.size(); ++c)
            part.wall_pairs[static_cast<std::size_t>(part.wall_source[c])].r = part.problem.wall_contacts[c].r;
    }

    // Could the velocities found close a pair that was no contact? Then look again, wider, and say no.
    bool complete(int attempt) {
        if (attempt > 50)
            throw std::runtime_error("step " + std::to_string(steps_ + 1) +
                                     ": detection does not settle, take a smaller step");
        const Survey after =
            survey([](const Subdomain<M>& part, std::size_t g) { return part.problem.bodies[g].v; }, settings_.h);
        std::vector<Buffer> mine;
        for (auto& part : parts_)
            mine.push_back({double(find_missed<M>(part, settings_.walls, settings_.h, after.speed))});
        double missed = 0;
        for (double flag : comm_.all_gather(mine)) missed += flag;
        if (2 * after.moved > skin_) {
            rough(2.2 * settings_.h * after.speed);
            return false;
        }
        return missed == 0;
    }

    // Copies take their velocity from the first active holder: those without a contact had no part in the iteration,
    // and after a factorised gluing copies agree to round-off only.
    void share_velocities() {
        std::vector<Links> links(parts_.size());
        for (std::size_t k = 0; k < parts_.size(); ++k) {
            Subdomain<M>& part = parts_[k];
            for (std::size_t l = 0; l < part.links.size(); ++l) {
                Link& link = part.links[l];
                link.send.clear();
                for (int g : part.linked[l]) {
                    const auto& v = part.problem.bodies[static_cast<std::size_t>(g)].v;
                    link.send.insert(link.send.end(), v.data(), v.data() + M::dof);
                }
                link.recv.resize(link.send.size());
            }
            links[k].swap(part.links);
        }
        comm_.exchange(links);
        for (std::size_t k = 0; k < parts_.size(); ++k) {
            Subdomain<M>& part = parts_[k];
            links[k].swap(part.links);
            for (std::size_t l = 0; l < part.links.size(); ++l)
                for (std::size_t s = 0; s < part.linked[l].size(); ++s) {
                    const auto g = static_cast<std::size_t>(part.linked[l][s]);
                    if (first_active(part, g) == part.links[l].peer)
                        part.problem.bodies[g].v =
                            Eigen::Map<const typename M::Velocity>(part.links[l].recv.data() + s * M::dof);
                }
        }
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

    static int first_active(const Subdomain<M>& part, std::size_t grain) {
        for (std::size_t s = part.first_sharer(grain); s < part.last_sharer(grain); ++s)
            if (part.active[s]) return part.sharers[s];
        return part.rank;  // nobody touches it: every copy has V_free
    }

    Communicator& comm_;
    SimulationSettings<M> settings_;
    std::vector<Subdomain<M>> parts_;
    std::vector<double> rough_offset_;
    double least_radius_ = 0, largest_radius_ = 0, skin_ = 0;
    int since_rough_ = 0, steps_ = 0;
    PhaseSeconds seconds_;
};

}  // namespace nscdd
