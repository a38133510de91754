// All partitions, and one that a stranger writes.
#pragma once

#include "nscdd/partition/metis.hpp"
#include "random_scenes.hpp"

namespace nscdd::test {

// All that a partition needs: rank by the distance from the middle of the box [0, edge]^dim. Its shells are not convex,
// and one is around another.
template <class M>
struct Shells {
    int ranks;
    double edge;

    int owner(const typename M::Vec& x) const { return shell(distance(x)); }
    void visit_owners(const typename M::Vec& x, double reach, auto&& visit) const {
        const double wide = std::sqrt(double(M::dim)) * reach;
        for (int rank = shell(distance(x) - wide); rank <= shell(distance(x) + wide); ++rank) visit(rank);
    }
    std::string name() const { return "shells"; }

  private:
    double distance(const typename M::Vec& x) const { return (x - M::Vec::Constant(edge / 2)).norm(); }
    int shell(double distance) const { return std::clamp(static_cast<int>(distance / edge * ranks), 0, ranks - 1); }
};

template <class M>
std::vector<Partitioner<M>> partitioners(double edge, double imbalance = 1.1) {
    const auto shells = [edge](const PartitionInput<M>& scene) { return Shells<M>{scene.comm.size(), edge}; };
    return {by_grid<M>(), by_bisection<M>(imbalance), by_metis<M>(imbalance), {.kind = "shells", .make = shells}};
}

}  // namespace nscdd::test
