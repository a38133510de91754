#pragma once

#include <limits>
#include <optional>
#include <unordered_map>

#include "nscdd/decompose/repartition.hpp"
#include "nscdd/decompose/serialise.hpp"
#include "nscdd/partition/weights.hpp"
#include "nscdd/step/scene_sums.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The broad phase of a simulation, and with it the partition of space. Its candidates serve until a grain has used up
/// the skin.
template <class M>
class BroadPhase {
  public:
    double skin() const { return skin_; }  ///< of the last broad phase [m]
    /// What grains may use up of it: beyond it pairs would be missed that the law makes contacts at a distance [m].
    double spare_skin(const SimulationSettings<M>& settings) const {
        return skin_ - largest_range<M>(settings.materials);
    }
    int steps_since() const { return steps_since_; }                  ///< steps begun since the last broad phase
    const std::vector<double>& offsets() const { return offsets_; }   ///< of the walls at the last broad phase [m]
    double time() const { return time_; }                             ///< of the scene then, where it has obstacles [s]
    const typename M::Gradient& stretch() const { return stretch_; }  ///< of places by the cell's flow since then
    const Cell<M>& cell() const { return cell_; }                     ///< at the last broad phase
    const Partition<M>& partition() const { return *partition_; }     ///< of the last broad phase
    double imbalance_when_made() const { return imbalance_when_made_; }  ///< of the partition (Partitioner) [1]

    /// Counts a step. Returns true when the broad phase is due by the number of steps since the last one.
    bool due(const SimulationSettings<M>& settings) { return ++steps_since_ > settings.broad_phase_every; }

    /// Grains have moved with a flow for `dt` [s].
    void flow(const typename M::Gradient& flow, double dt) { stretch_ = stretched(flow, dt); }
    /// What a flow will have taken of the skin after `dt` [s], besides the grains' own motion: it brings a pair nearer
    /// by less than this [m].
    double strained(const typename M::Gradient& flow, double dt, double largest_radius) const {
        const typename M::Gradient strain = stretched(flow, dt) - M::Gradient::Identity();
        return M::dim * strain.cwiseAbs().maxCoeff() * (2 * largest_radius + skin_);
    }

    /// Makes a broad phase with a skin that the next steps should not use up, of at least `needed` [m]. Collective.
    void renew(std::vector<Subdomain<M>>& parts, Communicator& comm, const SimulationSettings<M>& settings, Radii radii,
               double needed) {
        for (auto& part : parts)
            for (auto& g : part.grains) g.position = part.cell.wrapped(g.position);
        const Extent extent = find_extent(parts, comm);
        double speed = (std::max)(extent.speed, settings.h * settings.gravity.norm());
        for (const auto& wall : settings.walls) speed = (std::max)(speed, std::abs(wall.normal_speed()));
        if (const auto& obstacles = parts[0].obstacles) {
            time_ = obstacles->time();
            speed = (std::max)(speed, obstacles->moved(time_, time_ + settings.h) / settings.h);
        }
        speed += M::dim * settings.cell.gradient.cwiseAbs().maxCoeff() * 1.25 * radii.largest;
        const double step_reach = settings.h * speed;
        const double wanted =
            std::clamp(2.2 * settings.broad_phase_every * step_reach, 0.05 * radii.least, 0.5 * radii.least);
        skin_ = (std::max)({wanted, 4.4 * step_reach, needed}) + largest_range<M>(settings.materials);
        detect(parts, comm, settings, settings.walls, radii, extent.box(settings.cell));
        cell_ = settings.cell;
        stretch_.setIdentity();
        offsets_.clear();
        for (const auto& wall : settings.walls) offsets_.push_back(wall.offset);
        steps_since_ = 0;
    }

    /// Repeats the last broad phase of another simulation. Collective.
    void repeat(std::vector<Subdomain<M>>& parts, Communicator& comm, const SimulationSettings<M>& settings,
                Radii radii, const BroadPhaseState<M>& last) {
        std::vector<Wall<M>> walls = settings.walls;
        for (std::size_t w = 0; w < walls.size(); ++w) walls[w].offset = last.offsets[w];
        struct Moved {
            int id;
            double reach;
            typename M::Vec from, to;
        };
        std::vector<Moved> moved;
        for (std::size_t g = 0; g < parts[0].grains.size(); ++g) {
            Grain<M>& grain = parts[0].grains[g];
            moved.push_back(
                {grain.id, detail::reach(grain, last.skin, radii.largest), last.positions[g], grain.position});
            grain.position = last.positions[g];
        }
        const Partitioner<M>& partitioner = settings.partition;
        if (last.kind == partitioner.kind && partitioner.restore)
            partition_ = partitioner.restore(last.partition, comm.size());
        skin_ = last.skin;
        cell_ = last.cell;
        stretch_ = last.stretch;
        for (auto& part : parts) part.cell = cell_;
        steps_since_ = last.steps_since;
        time_ = last.time;
        offsets_ = last.offsets;
        if (partition_) {
            imbalance_when_made_ = last.imbalance;
            detail::repartition<M>(parts, comm, *partition_, walls, skin_, radii.largest, true);
        } else {
            detect(parts, comm, settings, walls, radii, find_extent(parts, comm).box(cell_));
        }
        std::vector<Communicator::Outbox> out(parts.size());
        std::vector<int> owners;
        for (const Moved& m : moved) {
            find_owners(*partition_, cell_, m.from, m.reach, owners);
            for (const int rank : owners) {
                out[0][rank].push_back(m.id);
                Serialise<M>::put(m.to, out[0][rank]);
            }
        }
        const std::vector<Buffer> positions = route_by_square(comm, out);  // id, x
        for (std::size_t k = 0; k < parts.size(); ++k) {
            std::unordered_map<int, const double*> by_id;
            for (std::size_t p = 0; p < positions[k].size(); p += 1 + M::dim)
                by_id[static_cast<int>(positions[k][p])] = &positions[k][p + 1];
            for (auto& g : parts[k].grains) g.position = Eigen::Map<const typename M::Vec>(by_id.at(g.id));
            parts[k].cell = settings.cell;
        }
    }

  private:
    typename M::Gradient stretched(const typename M::Gradient& flow, double dt) const {
        typename M::Gradient moved = stretch_;
        for (int d = 0; d < M::dim; ++d) moved.col(d) += dt * flow_over<M>(flow, stretch_.col(d));
        return moved;
    }

    /// Sums over all grains.
    struct Extent {
        typename M::Vec minus_low = M::Vec::Constant(-(std::numeric_limits<double>::max)()),
                        high = minus_low;  // box [m]
        double speed = 0;                  ///< largest [m/s]
        auto summed() { return std::tie(); }
        auto largest() { return std::tie(minus_low, high, speed); }
        typename PartitionInput<M>::Box box(const Cell<M>& cell) const {
            typename PartitionInput<M>::Box all{-minus_low, high};
            if (!(all.low[0] <= all.high[0])) all.low.setZero(), all.high.setZero();  // of no grains
            for (int d = 0; d < M::dim; ++d)
                if (cell.periodic[static_cast<std::size_t>(d)])
                    all.low[d] = cell.low[d], all.high[d] = cell.low[d] + cell.size[d];
            return all;
        }
    };
    static Extent find_extent(const std::vector<Subdomain<M>>& parts, Communicator& comm) {
        return reduce<Extent>(comm, [&parts](std::size_t k) {
            Extent mine;
            for (const auto& g : parts[k].grains) {
                mine.minus_low = mine.minus_low.cwiseMax(-g.position);
                mine.high = mine.high.cwiseMax(g.position);
                mine.speed = (std::max)(mine.speed, g.velocity.template head<M::dim>().norm());
            }
            return mine;
        });
    }

    /// Makes a broad phase in the partition as it is or, where that has become uneven, in a new one. The first
    /// partition is made from grains, as there are no candidates yet, and then again from the candidates that it leads
    /// to.
    void detect(std::vector<Subdomain<M>>& parts, Communicator& comm, const SimulationSettings<M>& settings,
                const std::vector<Wall<M>>& walls, Radii radii, const typename PartitionInput<M>::Box& box) {
        const double allowed = settings.partition.imbalance;
        const bool first = !partition_;
        const bool renew =
            first || allowed <= 1 || measure_imbalance(parts, comm) > (std::max)(allowed, 1.1 * imbalance_when_made_);
        for (int times = !renew ? 0 : first && allowed > 1 ? 2 : 1; times > 0; --times) {
            partition_ = settings.partition.make({parts, comm, box, partition_ ? partition_->numbers() : Buffer{}});
            if (times > 1) detail::repartition<M>(parts, comm, *partition_, walls, skin_, radii.largest, true);
        }
        detail::repartition<M>(parts, comm, *partition_, walls, skin_, radii.largest, renew);
        if (renew && allowed > 1) imbalance_when_made_ = measure_imbalance(parts, comm);
    }

    std::optional<Partition<M>> partition_;
    double imbalance_when_made_ = 1, skin_ = 0, time_ = 0;
    std::vector<double> offsets_;
    Cell<M> cell_{};
    typename M::Gradient stretch_ = M::Gradient::Identity();
    int steps_since_ = 0;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
