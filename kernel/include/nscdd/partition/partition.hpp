/// @file
/// A partition deals the points of space, and with them contacts, to ranks. Any class that answers the three questions
/// below is one. A new one is one file; grid.hpp, bisection.hpp and metis.hpp are examples.
#pragma once

#include <concepts>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/core/model.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

template <class P, class Vec>
concept KnowsOwner = requires(const P& partition, const Vec& point) {
    { partition.owner(point) } -> std::same_as<int>;
};
template <class P, class Vec>
concept VisitsOwners = requires(const P& partition, const Vec& point, double reach, void (*visit)(int)) {
    partition.visit_owners(point, reach, visit);
};
template <class P>
concept HasName = requires(const P& partition) {
    { partition.name() } -> std::convertible_to<std::string>;
};
template <class P>
concept HasNumbers = requires(const P& partition) {
    { partition.numbers() } -> std::convertible_to<Buffer>;
};

}  // namespace detail

/// A class with three functions:
///
/// - owner(point) returns the rank, 0 to size-1, whose subdomain the point is in; every point of space is in one.
/// - visit_owners(point, reach, visit) calls visit(rank) for each rank that owns a point at most `reach` [m] away along
///   each axis. Now and then it may call visit() for other ranks as well.
/// - name() returns the name in reports.
template <class P, class M>
concept PartitionOf =
    detail::KnowsOwner<P, typename M::Vec> && detail::VisitsOwners<P, typename M::Vec> && detail::HasName<P>;

/// Holds any partition. Copies share it.
template <class M>
class Partition {
  public:
    using Vec = typename M::Vec;

    /// Takes any class that is a `PartitionOf<M>`. The compiler says what another one lacks.
    template <class P>
        requires(!std::same_as<P, Partition>)
    Partition(P partition) {
        static_assert(detail::KnowsOwner<P, Vec>,
                      "nscdd: a partition needs `int owner(const Vec& point) const`, the rank that a point belongs to");
        static_assert(
            detail::VisitsOwners<P, Vec>,
            "nscdd: a partition needs `void visit_owners(const Vec& point, double reach, auto&& visit) const`, "
            "which calls visit(rank) for each rank that owns a point within reach");
        static_assert(detail::HasName<P>, "nscdd: a partition needs `std::string name() const`");
        if constexpr (PartitionOf<P, M>) held_ = std::make_shared<const Held<P>>(std::move(partition));
    }

    int owner(const Vec& point) const { return held_->owner(point); }  ///< rank, 0 to size-1
    /// Calls visit(rank) for each rank that owns a point at most `reach` [m] away along each axis (PartitionOf).
    void visit_owners(const Vec& point, double reach, auto&& visit) const {
        held_->visit_owners(point, reach, std::ref(visit));
    }
    std::string name() const { return held_->name(); }  ///< name in reports
    /// Numbers from which this partition can be made again, for a stored simulation that goes on; empty if it has none.
    Buffer numbers() const { return held_->numbers(); }

  private:
    using Visit = std::function<void(int)>;
    struct Any {
        virtual ~Any() = default;
        virtual int owner(const Vec& point) const = 0;
        virtual void visit_owners(const Vec& point, double reach, const Visit& visit) const = 0;
        virtual std::string name() const = 0;
        virtual Buffer numbers() const = 0;
    };
    template <class P>
    struct Held final : Any {
        P partition;
        explicit Held(P p) : partition(std::move(p)) {}
        int owner(const Vec& point) const override { return partition.owner(point); }
        void visit_owners(const Vec& point, double reach, const Visit& visit) const override {
            partition.visit_owners(point, reach, visit);
        }
        std::string name() const override { return partition.name(); }
        Buffer numbers() const override {
            if constexpr (detail::HasNumbers<P>)
                return partition.numbers();
            else
                return {};
        }
    };
    std::shared_ptr<const Any> held_;
};

/// Data from which a partition may be made.
template <class M>
struct PartitionInput {
    /// The least box around all grains' centres.
    struct Box {
        typename M::Vec low;   ///< lower corner [m]
        typename M::Vec high;  ///< upper corner [m]
    };

    /// Subdomains of the last broad phase, with its candidates. Before the first one there are no candidates, and the
    /// grains may lie on any rank.
    const std::vector<Subdomain<M>>& parts;
    Communicator& comm;  ///< communicator; parts[k] is of its k-th hosted rank
    Box box;             ///< box of all grains of the scene
    Buffer numbers;      ///< numbers of the partition until now; empty if there is none
};

namespace detail {
inline constexpr double default_imbalance = 1.1;  ///< of Partitioner, where it is worth what a new partition costs
}

/// Makes the partition of a simulation.
template <class M>
struct Partitioner {
    std::string kind;  ///< kind of partition, the same for all that restore() can make
    /// Makes the partition, the same on every process. Collective.
    std::function<Partition<M>(const PartitionInput<M>&)> make;
    /// Makes the partition that has these numbers, for `ranks` ranks; empty if they are no partition of this kind.
    /// Without this function the partition is made anew where a stored simulation goes on.
    std::function<std::optional<Partition<M>>(std::span<const double> numbers, int ranks)> restore = {};
    /// Bound on the number of candidates of the busiest rank over the mean. A partition is kept below it, and until the
    /// number is a tenth more than when the partition was made. 1: it is made anew at every broad phase.
    double imbalance = 1;
};

}}  // namespace nscdd::NSCDD_ABI
