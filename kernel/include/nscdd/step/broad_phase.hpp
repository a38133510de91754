// The broad phase of a simulation: rough detection, whose candidates serve until a grain has used up the skin, and with
// it the partition of space.
#pragma once

#include <limits>
#include <optional>
#include <unordered_map>

#include "nscdd/decompose/repartition.hpp"
#include "nscdd/partition/weights.hpp"
#include "nscdd/step/settings.hpp"

namespace nscdd::inline NSCDD_ABI {

struct Radii {
    double least = 0, largest = 0;  // of the scene [m]
};

template <class M>
class BroadPhase {
  public:
    double skin() const { return skin_; }                                // of the last rough detection
    int steps_since() const { return steps_since_; }                     // and the steps begun since
    const std::vector<double>& offsets() const { return offsets_; }      // of the walls, when it was made
    const Partition<M>& partition() const { return *partition_; }        // of the last rough detection
    double imbalance_when_made() const { return imbalance_when_made_; }  // of the partition (Partitioner)

    // Counts a step. True when rough detection is due by their number.
    bool due(const SimulationSettings<M>& settings) { return ++steps_since_ > settings.rough_every; }

    // Rough detection with a skin that the next steps should not use up, and at least `needed`.
    void renew(std::vector<Subdomain<M>>& parts, Communicator& comm, const SimulationSettings<M>& settings, Radii radii,
               double needed) {
        auto [box, speed] = find_extent(parts, comm);
        speed = std::max(speed, settings.h * settings.gravity.norm());
        for (const auto& wall : settings.walls) speed = std::max(speed, std::abs(wall.normal_speed()));
        const double step_reach = settings.h * speed;
        const double wanted =
            std::clamp(2.2 * settings.rough_every * step_reach, 0.05 * radii.least, 0.5 * radii.least);
        skin_ = std::max({wanted, 4.4 * step_reach, needed});
        renew_partition(parts, comm, settings, box,
                        [&] { repartition<M>(parts, comm, *partition_, settings.walls, skin_, radii.largest); });
        offsets_.clear();
        for (const auto& wall : settings.walls) offsets_.push_back(wall.offset);
        steps_since_ = 0;
    }

    // The rough detection that another simulation made.
    void repeat(std::vector<Subdomain<M>>& parts, Communicator& comm, const SimulationSettings<M>& settings,
                Radii radii, const RoughDetection<M>& last) {
        std::vector<Wall<M>> walls = settings.walls;
        for (std::size_t w = 0; w < walls.size(); ++w) walls[w].offset = last.offsets[w];
        std::vector<typename M::Vec> now;
        for (std::size_t g = 0; g < parts[0].grains.size(); ++g) {
            now.push_back(parts[0].grains[g].position);
            parts[0].grains[g].position = last.positions[g];
        }
        const Partitioner<M>& partitioner = settings.partition;
        if (last.kind == partitioner.kind && partitioner.restore)
            partition_ = partitioner.restore(last.partition, comm.size());
        skin_ = last.skin;
        steps_since_ = last.steps_since;
        offsets_ = last.offsets;
        std::vector<Buffer> positions;  // as they are now: id, x
        const auto detect_roughly = [&] {
            std::vector<Outbox> out(parts.size());
            for (std::size_t g = 0; g < now.size(); ++g) {
                const Grain<M>& grain = parts[0].grains[g];
                partition_->visit_owners(grain.position, detail::reach(grain, skin_, radii.largest), [&](int rank) {
                    Buffer& to = out[0][rank];
                    to.push_back(grain.id);
                    detail::Wire<M>::put(now[g], to);
                });
            }
            positions = comm.route(out);
            repartition<M>(parts, comm, *partition_, walls, skin_, radii.largest);
        };
        if (partition_) {
            imbalance_when_made_ = last.imbalance;
            detect_roughly();
        } else {
            renew_partition(parts, comm, settings, find_extent(parts, comm).first, detect_roughly);
        }
        for (std::size_t k = 0; k < parts.size(); ++k) {
            std::unordered_map<int, const double*> by_id;
            for (std::size_t p = 0; p < positions[k].size(); p += 1 + M::dim)
                by_id[static_cast<int>(positions[k][p])] = &positions[k][p + 1];
            for (auto& g : parts[k].grains) g.position = Eigen::Map<const typename M::Vec>(by_id.at(g.id));
        }
    }

  private:
    // Box of all grains, and the largest of their speeds.
    static std::pair<Box<M>, double> find_extent(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
        using Vector = Eigen::Map<const typename M::Vec>;
        const std::span<const double> all = reduce(comm, 0, [&parts](std::size_t k) {
            typename M::Vec low = M::Vec::Constant(std::numeric_limits<double>::max()), high = -low;
            double speed = 0;
            for (const auto& g : parts[k].grains) {
                low = low.cwiseMin(g.position);
                high = high.cwiseMax(g.position);
                speed = std::max(speed, g.velocity.template head<M::dim>().norm());
            }
            low = -low;
            Buffer out(low.data(), low.data() + M::dim);
            out.insert(out.end(), high.data(), high.data() + M::dim);
            out.push_back(speed);
            return out;
        });
        return {{-Vector(&all[0]), Vector(&all[M::dim])}, all[2 * M::dim]};
    }

    // The partition for the next rough detection, and how uneven it is once that is made.
    void renew_partition(std::vector<Subdomain<M>>& parts, Communicator& comm, const SimulationSettings<M>& settings,
                         const Box<M>& box, auto&& detect_roughly) {
        const double allowed = settings.partition.imbalance;
        const bool first = !partition_;
        const bool renew =
            first || allowed <= 1 || measure_imbalance(parts, comm) > std::max(allowed, 1.1 * imbalance_when_made_);
        if (renew) partition_ = settings.partition.make({parts, comm, box, first ? Buffer{} : partition_->numbers()});
        detect_roughly();
        // the first one is made before there are candidates: it does not count as well made
        if (renew && allowed > 1) imbalance_when_made_ = first ? 1 : measure_imbalance(parts, comm);
    }

    std::optional<Partition<M>> partition_;
    double imbalance_when_made_ = 1, skin_ = 0;
    std::vector<double> offsets_;
    int steps_since_ = 0;
};

}  // namespace nscdd
