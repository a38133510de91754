/// @file
/// The work of an accelerated sweep besides solving contacts (anderson.hpp). Velocities are combined before it. At each
/// contact before() combines its iterates; after() adds its products and keeps its change.
#pragma once

#include "nscdd/iterate/anderson.hpp"
#include "nscdd/sweep/batch.hpp"
#include "nscdd/sweep/body_store.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The weight of a contact in the products of an Anderson: Anderson::metric() of its diagonal of W.
template <class M>
double anderson_metric(const ContactProblem<M>& problem, const Contact<M>& c, auto kind) {
    return Anderson::metric(delassus(problem, c, true, kind).normal, delassus(problem, c, false, kind).normal);
}

/// Past velocities of bodies and driven walls, combined as the impulses of the contacts will be.
template <class M>
class PastVelocities {
  public:
    void make_room(const BodyStore<M>& rows, std::size_t walls, int window) {
        const auto slots = static_cast<std::size_t>(window);
        rows_.assign(slots, AlignedDoubles(rows.data.size()));
        speeds_.assign(slots * walls, 0.0);
    }

    /// Keeps the velocities in `rows` and `walls` and puts their combination there.
    void combine(BodyStore<M>& rows, std::vector<WallBody<M>>& walls, const Anderson& anderson) {
        const int slots = anderson.window();
        for (std::size_t k = 0; k < rows.data.size(); k += Packet::width) {
            const Packet before = Packet::load(rows.data.data() + k);
            Packet combined = before;
            for (int j = 0; j < slots; ++j) {
                const Packet past = Packet::load(rows_[static_cast<std::size_t>(j)].data() + k);
                combined = madd(Packet(anderson.coefficient(j)), past - before, combined);
            }
            combined.store(rows.data.data() + k);
            before.store(rows_[static_cast<std::size_t>(anderson.last())].data() + k);
        }
        for (std::size_t w = 0; w < walls.size(); ++w) {
            double& speed = walls[w].speed;
            double* past = speeds_.data() + w * static_cast<std::size_t>(slots);
            const double before = speed;
            for (int j = 0; j < slots; ++j) speed += anderson.coefficient(j) * (past[j] - before);
            past[anderson.last()] = before;
        }
    }

  private:
    std::vector<AlignedDoubles> rows_;  ///< by slot
    std::vector<double> speeds_;        ///< by wall and slot
};

template <class M>
struct BatchByBatch {
    using Layout = BatchLayout<M>;
    const Anderson& anderson;
    std::array<Batchful, Anderson::largest_window + 1> products;

    EIGEN_ALWAYS_INLINE void prefetch(const BatchGroup<M>& group, std::size_t k) const {
        group.prefetch_past(k, anderson.window());
    }
    EIGEN_ALWAYS_INLINE void before(auto& batch, BatchGroup<M>& group, std::size_t k, std::size_t lane) {
        const int window = anderson.window();
        Packet iterate[Layout::components];
        for (int d = 0; d < Layout::components; ++d) iterate[d] = batch.r[d];
        for (int j = 0; j < window; ++j) {
            const double* past = group.iterate(k, j, window) + lane;
            const Packet c(anderson.coefficient(j));
            for (int d = 0; d < Layout::components; ++d)
                batch.r[d] = madd(c, Packet::load(past + d * batch_size) - iterate[d], batch.r[d]);
        }
        double* last = group.iterate(k, anderson.last(), window) + lane;
        for (int d = 0; d < Layout::components; ++d) iterate[d].store(last + d * batch_size);
    }
    EIGEN_ALWAYS_INLINE void after(const auto& batch, BatchGroup<M>& group, std::size_t k, std::size_t lane,
                                   const Packet* change) {
        const int window = anderson.window();
        const std::size_t part = lane / Packet::width;
        const Packet normal = Packet::load(group.metric(k, window) + lane);
        Packet weighted[Layout::components];
        batch.weigh(change, normal, Packet(Anderson::tangential_weight) * normal, weighted);
        const auto times = [&](auto&& other, Packet total) {
            for (int d = 0; d < Layout::components; ++d) total = madd(weighted[d], other(d), total);
            return total;
        };
        products[0][part] = times([&](int d) { return change[d]; }, products[0][part]);
        for (int j = 0; j < window; ++j) {
            const double* past = group.change(k, j, window) + lane;
            Packet& product = products[static_cast<std::size_t>(j) + 1][part];
            product = times([&](int d) { return Packet::load(past + d * batch_size); }, product);
        }
        double* now = group.change(k, anderson.now(), window) + lane;
        for (int d = 0; d < Layout::components; ++d) change[d].store(now + d * batch_size);
    }
};

template <class M>
struct OneByOne {
    const Anderson& anderson;
    const double* metric;       ///< of the contact at hand
    typename M::Impulse* past;  ///< of the contact at hand: iterate and change of each slot
    Anderson::Products& products;

    void before(Contact<M>& c) {
        const typename M::Impulse iterate = c.r;
        for (int j = 0; j < anderson.window(); ++j) c.r += anderson.coefficient(j) * (past[2 * j] - iterate);
        past[2 * anderson.last()] = iterate;
    }
    void after(const Contact<M>& c, const typename M::Impulse& change) {
        typename M::Impulse weighted = *metric * change;
        if constexpr (M::rolling) {
            constexpr double t = Anderson::tangential_weight;
            const typename M::Vec force = weighted.template head<M::dim>();
            weighted.template head<M::dim>() = t * force + (1 - t) * force.dot(c.normal) * c.normal;
            weighted.template tail<M::couples>() *= t * c.inv_wn / c.inv_ws;  // W_s/W_n
        } else if constexpr (M::friction) {
            constexpr double t = Anderson::tangential_weight;
            weighted = t * weighted + (1 - t) * weighted.dot(c.normal) * c.normal;
        }
        products[0] += weighted.dot(change);
        for (int j = 0; j < anderson.window(); ++j)
            products[static_cast<std::size_t>(j) + 1] += weighted.dot(past[2 * j + 1]);
        past[2 * anderson.now() + 1] = change;
        past += 2 * anderson.window();
        ++metric;
    }
};

}}}  // namespace nscdd::NSCDD_ABI::detail
