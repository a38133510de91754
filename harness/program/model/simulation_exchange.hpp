// Lets grains enter and leave a simulation between its steps, as [[insert]] and [[remove]] of the scene say.
#pragma once

#include "model/run_request.hpp"
#include "nscdd/step/exchange.hpp"

namespace nscdd {

template <class M>
class Exchange {
  public:
    // so_far: of the scene, kept up to date here.
    Exchange(const Scene& scene, State::SoFar& so_far) : scene_(scene), so_far_(so_far) {
        if (!scene.exchange.any()) return;
        so_far.removed.resize(scene.exchange.removals.size());
        so_far.inserted.resize(scene.exchange.insertions.size());
        so_far.came.resize(State::SoFar::amounts);
        so_far.left.resize(State::SoFar::amounts);
    }

    // Before each step, with the time at its beginning and its number in the scene. Collective.
    void before_step(Simulation<M>& simulation, double time, std::int64_t step) {
        if (!scene_.exchange.removals.empty()) remove(simulation);
        if (!scene_.exchange.insertions.empty()) insert(simulation, time, static_cast<std::uint64_t>(step));
    }

  private:
    using Vec = typename M::Vec;

    static constexpr int most_at_once = 100;  // grains of an entry that a step tries to insert
    static constexpr int trials = 10;         // places that it tries for each

    void remove(Simulation<M>& simulation) {
        const std::vector<SceneRemoval>& removals = scene_.exchange.removals;
        const SimulationSettings<M>& settings = simulation.settings();
        const auto begins = [&](int later) {  // a step, to the bits of the one before it or after it
            return settings.start_time + double(settings.steps_before + simulation.steps() + later) * settings.h;
        };
        const StepTimes times{begins(-1), begins(0), begins(1)};
        std::vector<double> allowed;
        for (const SceneRemoval& removal : removals) allowed.push_back(removal.allowed(times));
        if (std::ranges::none_of(allowed, [](double count) { return count > 0; })) return;
        // the first entry whose region has the grain
        const auto entry = [&](const Grain<M>& grain) {
            std::size_t e = 0;
            if (grain.fixed()) return removals.size();
            const Vec x = simulation.settings().cell.wrapped(grain.position);
            while (e < removals.size() && !(allowed[e] > 0 && removals[e].region.contains(x))) ++e;
            return e;
        };
        Communicator& comm = simulation.comm();
        const auto count = [&](auto&& taken) {  // grains, mass and energy by entry, of all ranks
            const std::size_t columns = State::SoFar::amounts;
            const std::span<const double> all = reduce(comm, columns * removals.size(), [&](std::size_t k) {
                Buffer mine(columns * removals.size());
                const Subdomain<M>& part = simulation.parts()[k];
                for (std::size_t g = 0; g < part.grains.size(); ++g) {
                    const Grain<M>& grain = part.grains[g];
                    const std::size_t e = part.primary(g) ? entry(grain) : removals.size();
                    if (e == removals.size() || !taken(grain, e)) continue;
                    const double of[] = {1, grain.mass, grain.kinetic_energy()};
                    for (std::size_t n = 0; n < columns; ++n) mine[columns * e + n] += of[n];
                }
                return mine;
            });
            return Buffer(all.begin(), all.end());
        };
        Buffer found = count([](const Grain<M>&, std::size_t) { return true; });
        std::vector<int> last(removals.size(), std::numeric_limits<int>::max());  // id that may go
        bool any = false, fewer = false;
        for (std::size_t e = 0; e < removals.size(); ++e) {
            const double here = found[State::SoFar::amounts * e];
            any |= here > 0;
            if (here <= allowed[e]) continue;
            last[e] = nth_id(simulation, static_cast<std::size_t>(allowed[e]),
                             [&](const Grain<M>& grain) { return entry(grain) == e; });
            fewer = true;
        }
        if (!any) return;
        const auto taken = [&](const Grain<M>& grain, std::size_t e) { return grain.id <= last[e]; };
        if (fewer) found = count(taken);
        simulation.remove(
            [&](const Grain<M>& grain) {
                const std::size_t e = entry(grain);
                return e < removals.size() && taken(grain, e);
            },
            Simulation<M>::Numbering::closed_up);  // ids are rows of files
        for (std::size_t e = 0; e < removals.size(); ++e) {
            so_far_.removed[e] += found[State::SoFar::amounts * e];
            for (std::size_t n = 0; n < State::SoFar::amounts; ++n)
                so_far_.left[n] += found[State::SoFar::amounts * e + n];
        }
    }

    // The n-th lowest id, from 1 on, of the grains for which which(grain) is true. Collective.
    static int nth_id(const Simulation<M>& simulation, std::size_t n, auto&& which) {
        std::vector<Communicator::Outbox> out(simulation.parts().size());
        for (std::size_t k = 0; k < out.size(); ++k) {
            const Subdomain<M>& part = simulation.parts()[k];
            for (std::size_t g = 0; g < part.grains.size(); ++g)
                if (part.primary(g) && which(part.grains[g]))
                    for (int rank = 0; rank < simulation.comm().size(); ++rank)
                        out[k][rank].push_back(part.grains[g].id);
        }
        Buffer ids = simulation.comm().route(out)[0];
        std::ranges::nth_element(ids, ids.begin() + static_cast<std::ptrdiff_t>(n - 1));
        return static_cast<int>(ids[n - 1]);
    }

    // A grain that waits for a place, and the places that are tried.
    struct Waiting {
        std::size_t entry;
        double radius;
        std::vector<Vec> places;
    };

    void insert(Simulation<M>& simulation, double time, std::uint64_t step) {
        std::vector<Waiting> waiting;
        for (std::size_t e = 0; e < scene_.exchange.insertions.size(); ++e) {
            const SceneInsertion& insertion = scene_.exchange.insertions[e];
            const double due = insertion.due(time) - so_far_.inserted[e];
            for (int k = 0; k < std::min<double>(due, most_at_once); ++k) {
                const auto number = static_cast<std::uint64_t>(so_far_.inserted[e]) + static_cast<std::uint64_t>(k);
                Waiting& grain = waiting.emplace_back(Waiting{e, insertion.radius_of(e, number, M::dim), {}});
                for (std::uint64_t trial = 0; trial < trials; ++trial)
                    grain.places.emplace_back(insertion.place_of(e, number, step, trial, grain.radius));
            }
        }
        if (waiting.empty()) return;
        const Cell<M>& cell = simulation.settings().cell;
        const std::span<const double> blocked = reduce(simulation.comm(), 0, [&](std::size_t k) {
            return blocked_places(simulation, simulation.parts()[k], waiting);
        });
        std::vector<Grain<M>> coming;
        std::vector<char> stuck(scene_.exchange.insertions.size());  // entries whose next grain waits
        for (std::size_t w = 0; w < waiting.size(); ++w) {
            const Waiting& grain = waiting[w];
            if (stuck[grain.entry]) continue;
            const SceneInsertion& insertion = scene_.exchange.insertions[grain.entry];
            const auto free = [&](std::size_t trial) {
                return blocked[w * trials + trial] == 0 && std::ranges::none_of(coming, [&](const Grain<M>& other) {
                           return cell.apart(other.position, grain.places[trial]).norm() <= other.radius + grain.radius;
                       });
            };
            std::size_t trial = 0;
            while (trial < trials && !free(trial)) ++trial;
            if (trial == trials) {  // those behind it wait too: else the large ones would never come
                stuck[grain.entry] = true;
                continue;
            }
            Grain<M>& made = coming.emplace_back(
                make_grain<M>(static_cast<int>(simulation.grain_count() + coming.size()), grain.radius,
                              scene_.materials[static_cast<std::size_t>(insertion.material)].density,
                              grain.places[trial], insertion.material));
            made.velocity.template head<M::dim>() = insertion.velocity;
            ++so_far_.inserted[grain.entry];
            const double of[] = {1, made.mass, made.kinetic_energy()};
            for (std::size_t n = 0; n < State::SoFar::amounts; ++n) so_far_.came[n] += of[n];
        }
        if (coming.empty()) return;
        const bool mine = simulation.comm().ranks()[0] == 0;
        simulation.insert(mine ? std::span<const Grain<M>>(coming) : std::span<const Grain<M>>());
    }

    // For each place of each grain that waits, 1 where a grain of the subdomain, a wall or an obstacle would overlap
    // it.
    static Buffer blocked_places(const Simulation<M>& simulation, const Subdomain<M>& part,
                                 const std::vector<Waiting>& waiting) {
        Buffer blocked(waiting.size() * trials);
        const Cell<M>& cell = simulation.settings().cell;
        Vec low = waiting[0].places[0], high = low;
        double largest = 0;
        for (const Waiting& grain : waiting) {
            largest = std::max(largest, grain.radius);
            for (const Vec& place : grain.places) low = low.cwiseMin(place), high = high.cwiseMax(place);
        }
        std::vector<const Grain<M>*> near;
        for (const Grain<M>& grain : part.grains) {
            const double reach = grain.radius + largest;
            if (cell.repeats() ||
                ((grain.position - low).minCoeff() >= -reach && (high - grain.position).minCoeff() >= -reach))
                near.push_back(&grain);
        }
        for (std::size_t w = 0; w < waiting.size(); ++w)
            for (std::size_t trial = 0; trial < trials; ++trial) {
                const Vec& place = waiting[w].places[trial];
                const double radius = waiting[w].radius;
                const bool full =
                    std::ranges::any_of(near,
                                        [&](const Grain<M>* other) {
                                            return cell.apart(other->position, place).norm() <= other->radius + radius;
                                        }) ||
                    std::ranges::any_of(simulation.walls(),
                                        [&](const Wall<M>& wall) { return wall.distance(place) <= radius; }) ||
                    near_obstacle(simulation, place, radius);
                blocked[w * trials + trial] = full;
            }
        return blocked;
    }

    static bool near_obstacle(const Simulation<M>& simulation, const Vec& place, double radius) {
        bool near = false;
        if (const detail::PlacedObstacles<M>* obstacles = simulation.obstacles())
            obstacles->visit_near(place, radius, [&near](int) { near = true; });
        return near;
    }

    const Scene& scene_;
    State::SoFar& so_far_;
};

}  // namespace nscdd
