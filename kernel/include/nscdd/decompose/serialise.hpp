/// @file
/// Grains and impulses of pairs as doubles, which travel between ranks; and the search of a pair by its ids.
#pragma once

#include <bit>
#include <compare>
#include <cstdint>
#include <utility>
#include <vector>

#include "nscdd/comm/communicator.hpp"
#include "nscdd/core/grain.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Impulse of a pair by ids, as it travels and is stored. j < 0: wall -1-j.
template <class M>
struct PairImpulse {
    int i;                  ///< id of the grain with the lower one
    int j;                  ///< id of the other grain, or -1 - number of the wall
    typename M::Impulse r;  ///< on i [N s]
};

namespace detail {

constexpr std::uint64_t pair_key(int i, int j) {
    return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32) | static_cast<std::uint32_t>(j);
}

/// A hash table from pairs to pointers, null unless set; for as many pairs as it was made for, at most.
/// std::unordered_map allocates for each pair, which took a tenth of the detection's time.
template <class T>
class PairTable {
  public:
    explicit PairTable(std::size_t pairs) : slots_(std::bit_ceil(2 * pairs + 2)) {}
    T*& operator[](std::uint64_t key) {
        const std::size_t mask = slots_.size() - 1;
        std::size_t at = (key * 0x9e3779b97f4a7c15u >> 32) & mask;
        while (slots_[at].second && slots_[at].first != key) at = (at + 1) & mask;
        slots_[at].first = key;
        return slots_[at].second;
    }

  private:
    std::vector<std::pair<std::uint64_t, T*>> slots_;
};

/// Records as doubles.
template <class M>
struct Serialise {
    static constexpr std::size_t grain_size = 5 + M::dim + 2 * M::dof;
    static constexpr std::size_t impulse_size = 2 + M::Impulse::RowsAtCompileTime;

    static void put(const auto& vector, Buffer& out) {
        out.insert(out.end(), vector.data(), vector.data() + vector.size());
    }
    static void put(const Grain<M>& g, Buffer& out) {
        out.insert(out.end(), {double(g.id), double(g.material), g.radius, g.mass, g.inertia});
        put(g.position, out), put(g.velocity, out), put(g.load, out);
    }
    static Grain<M> grain(const double* in) {
        Grain<M> g;
        g.id = static_cast<int>(in[0]), g.material = static_cast<int>(in[1]);
        g.radius = in[2], g.mass = in[3], g.inertia = in[4];
        g.position = Eigen::Map<const typename M::Vec>(in + 5);
        g.velocity = Eigen::Map<const typename M::Velocity>(in + 5 + M::dim);
        g.load = Eigen::Map<const typename M::Velocity>(in + 5 + M::dim + M::dof);
        return g;
    }
    static void put(const PairImpulse<M>& p, Buffer& out) {
        out.insert(out.end(), {double(p.i), double(p.j)});
        put(p.r, out);
    }
    static PairImpulse<M> impulse(const double* in) {
        return {static_cast<int>(in[0]), static_cast<int>(in[1]), Eigen::Map<const typename M::Impulse>(in + 2)};
    }
};

/// A rank that has a copy of a grain.
struct Holding {
    int grain, rank;  ///< the grain's id
    auto operator<=>(const Holding&) const = default;
};

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
