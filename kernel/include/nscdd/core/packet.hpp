// What the fast sweep asks of the machine: packets of doubles, and rows of bodies loaded component by component.
//
// Underneath are Eigen's packets (AVX-512, AVX, SSE, NEON and others behind one set of names, chosen by what the
// compiler targets), because Eigen is a dependency already. Where Eigen does not vectorise, a packet is one double and
// the same code is the scalar path.
#pragma once

#include "nscdd/core/abi.hpp"

#include <cstddef>
#include <limits>
#include <new>
#include <utility>
#include <vector>

namespace nscdd::inline NSCDD_ABI {

// Doubles that the machine computes with at once, one in each lane: 8 with AVX-512, 4 with AVX, 2 with SSE or NEON, 1
// where Eigen does not vectorise. The fast sweep gives each contact a lane. All operations go lane by lane.
struct Packet {
    using Native = Eigen::internal::packet_traits<double>::type;                // Eigen's name of the machine's type
    static constexpr int width = Eigen::internal::packet_traits<double>::size;  // lanes, doubles in a packet

    Native lanes;  // `width` doubles

    Packet() = default;
    explicit Packet(double x) : lanes(Eigen::internal::pset1<Native>(x)) {}  // in every lane
    // A packet of these lanes.
    static Packet of(Native lanes) {
        Packet packet;
        packet.lanes = lanes;
        return packet;
    }

    // `width` doubles, from or to memory aligned to sizeof(Packet); the first is that of lane 0.
    static Packet load(const double* from) { return of(Eigen::internal::pload<Native>(from)); }
    void store(double* to) const { Eigen::internal::pstore(to, lanes); }  // see load()

    // The operation in every lane.
    friend Packet operator+(Packet a, Packet b) { return of(Eigen::internal::padd(a.lanes, b.lanes)); }
    friend Packet operator-(Packet a, Packet b) { return of(Eigen::internal::psub(a.lanes, b.lanes)); }
    friend Packet operator*(Packet a, Packet b) { return of(Eigen::internal::pmul(a.lanes, b.lanes)); }
    friend Packet operator/(Packet a, Packet b) { return of(Eigen::internal::pdiv(a.lanes, b.lanes)); }
    // a b + c, rounded once where the machine can.
    friend Packet madd(Packet a, Packet b, Packet c) { return of(Eigen::internal::pmadd(a.lanes, b.lanes, c.lanes)); }
    friend Packet magnitude(Packet a) { return of(Eigen::internal::pabs(a.lanes)); }       // |a|
    friend Packet inverse_root(Packet a) { return of(Eigen::internal::prsqrt(a.lanes)); }  // a^-1/2, a > 0
};

// The larger of two, in every lane, and of two doubles: so a contact law has one formula for both.
inline Packet larger(Packet a, Packet b) { return Packet::of(Eigen::internal::pmax(a.lanes, b.lanes)); }
inline double larger(double a, double b) { return a < b ? b : a; }
// The smaller of two, in every lane, and of two doubles.
inline Packet smaller(Packet a, Packet b) { return Packet::of(Eigen::internal::pmin(a.lanes, b.lanes)); }
inline double smaller(double a, double b) { return b < a ? b : a; }

namespace detail {

// Aligned as packets are loaded. Not Eigen's allocator: it has one name for all instruction sets, and a unit for one of
// them would free what a unit for another has allocated in another way.
template <class T>
struct PacketAllocator {
    using value_type = T;
    static constexpr std::align_val_t alignment{alignof(Packet)};

    PacketAllocator() = default;
    template <class U>
    PacketAllocator(const PacketAllocator<U>&) {}

    T* allocate(std::size_t n) {
        if (n > (std::numeric_limits<std::size_t>::max)() / sizeof(T)) throw std::bad_array_new_length();
        return static_cast<T*>(::operator new(n * sizeof(T), alignment));
    }
    void deallocate(T* memory, std::size_t) { ::operator delete(memory, alignment); }
    bool operator==(const PacketAllocator&) const = default;
};

using AlignedDoubles = std::vector<double, PacketAllocator<double>>;

// Lane by lane, in a fixed order.
inline double sum(Packet a) {
    alignas(sizeof(Packet)) double lane[Packet::width];
    a.store(lane);
    double total = 0;
    for (double x : lane) total += x;
    return total;
}
inline bool none_negative(Packet a) { return Eigen::internal::predux_min(a.lanes) >= 0; }
inline double largest(Packet a) {
    alignas(sizeof(Packet)) double lane[Packet::width];
    a.store(lane);
    double most = lane[0];
    for (double x : lane) most = x > most ? x : most;
    return most;
}

// Which lane of (a, b) comes to lane l. First stage: lanes of a and b in turn. Later stages: pairs of lanes, in each
// group the even (or odd) ones of a, then those of b; whole 128-bit lanes, which move at a lower price.
constexpr int interleaved(int l, int lanes, bool odd) { return (l & 1 ? lanes : 0) + (l & ~1) + odd; }
constexpr int deinterleaved(int l, int group, int lanes, bool odd) {
    const int first = l / group * group, pair = (l - first) / 2, pairs = group / 2;
    return (pair >= pairs / 2 ? lanes : 0) + first + (2 * (pair % (pairs / 2)) + odd) * 2 + l % 2;
}

template <int count, int stage, bool odd, int... lane>
EIGEN_ALWAYS_INLINE Packet mixed(Packet a, Packet b, std::integer_sequence<int, lane...>) {
    constexpr int lanes = sizeof...(lane);
    return Packet::of(__builtin_shufflevector(
        a.lanes, b.lanes, (stage == 1 ? interleaved(lane, lanes, odd) : deinterleaved(lane, count, lanes, odd))...));
}

template <int count, int stage>
EIGEN_ALWAYS_INLINE void mix_pair(Packet& low, Packet& high) {
    constexpr auto lanes = std::make_integer_sequence<int, Packet::width>{};
    const Packet a = low, b = high;
    low = mixed<count, stage, false>(a, b, lanes);
    high = mixed<count, stage, true>(a, b, lanes);
}

template <int count, int stage, int... k>
EIGEN_ALWAYS_INLINE void mix_stage(Packet* packets, std::integer_sequence<int, k...>) {
    (mix_pair<count, stage>(packets[k / stage * 2 * stage + k % stage],
                            packets[k / stage * 2 * stage + k % stage + stage]),
     ...);
}

// Transposes `count` packets in each group of `count` lanes, by count log2(count) shuffles (Eigen's 8 x 8 takes 40).
template <int count, int stage = 1>
EIGEN_ALWAYS_INLINE void transpose(Packet* packets) {
    if constexpr (stage < count) {
        mix_stage<count, stage>(packets, std::make_integer_sequence<int, count / 2>{});
        transpose<count, 2 * stage>(packets);
    }
}

// One row of `row` doubles per lane, seen by component. Always inlined: as calls they cost a sweep a fifth more, a
// residual a third.
template <int row>
class Rows {
  public:
    static constexpr int lanes = Packet::width;
    static_assert(row % lanes == 0 || lanes == 2 * row);

    // The row of lane k begins at base[offset[k]].
    EIGEN_ALWAYS_INLINE void load(const double* base, const int* offset) {
        const auto at = [&](int k) { return base + offset[k]; };
        if constexpr (row >= lanes) {
            for (int p = 0; p < row / lanes; ++p)
                for (int k = 0; k < lanes; ++k) packets_[p * lanes + k] = Packet::load(at(k) + p * lanes);
        } else {
            for (int k = 0; k < row; ++k)
                packets_[k] = join(Eigen::internal::pload<Part>(at(k)), Eigen::internal::pload<Part>(at(k + row)),
                                   std::make_integer_sequence<int, lanes>{});
        }
        transpose();
    }
    // Rows of one call are distinct, but for padding that is stored as it was loaded.
    EIGEN_ALWAYS_INLINE void store(double* base, const int* offset) {
        const auto at = [&](int k) { return base + offset[k]; };
        transpose();
        if constexpr (row >= lanes) {
            for (int p = 0; p < row / lanes; ++p)
                for (int k = 0; k < lanes; ++k) packets_[p * lanes + k].store(at(k) + p * lanes);
        } else {
            constexpr auto half = std::make_integer_sequence<int, row>{};
            for (int k = 0; k < row; ++k) {
                Eigen::internal::pstore(at(k), part<0>(packets_[k], half));
                Eigen::internal::pstore(at(k + row), part<row>(packets_[k], half));
            }
        }
    }
    Packet& operator[](int component) { return packets_[component]; }
    const Packet& operator[](int component) const { return packets_[component]; }

  private:
    using Part = Eigen::internal::packet_traits<double>::half;
    static constexpr int group = row < lanes ? row : lanes;

    EIGEN_ALWAYS_INLINE void transpose() {
        for (int p = 0; p < row / group; ++p) detail::transpose<group>(packets_ + p * group);
    }
    template <int... lane>
    EIGEN_ALWAYS_INLINE static Packet join(Part a, Part b, std::integer_sequence<int, lane...>) {
        return Packet::of(__builtin_shufflevector(a, b, lane...));
    }
    template <int first, int... lane>
    EIGEN_ALWAYS_INLINE static Part part(Packet a, std::integer_sequence<int, lane...>) {
        return __builtin_shufflevector(a.lanes, a.lanes, (first + lane)...);
    }

    Packet packets_[static_cast<std::size_t>(row)];
};

}  // namespace detail

}  // namespace nscdd
