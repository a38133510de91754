/// @file
/// Packets of doubles, and rows of bodies that are loaded component by component. The fast sweep asks no more of the
/// machine.
///
/// The bits are the same on every processor with fused products (IEEE 754), whatever the width of its vectors.
/// Operations go lane by lane, each rounded once. Sums over lanes have a fixed order. No instruction is used that two
/// processors round differently. GCC's vectors are behind it; Clang has them, too.
#pragma once

#include "nscdd/core/abi.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__ARM_NEON) && defined(__aarch64__)
#include <arm_neon.h>
#endif

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <utility>
#include <vector>

// NSCDD_MM(op): the intrinsic for a packet, where x86 has one of its width.
#if NSCDD_LANES == 8 && defined(__AVX512F__)
#define NSCDD_MM(op) _mm512_##op##_pd
#elif NSCDD_LANES == 4 && defined(__AVX__)
#define NSCDD_MM(op) _mm256_##op##_pd
#elif NSCDD_LANES == 2 && defined(__SSE2__)
#define NSCDD_MM(op) _mm_##op##_pd
#endif

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// `count` doubles or words of 64 bits in one register, or in several where the machine has none of this size.
template <class T, int count>
struct Vector {
    typedef T type __attribute__((vector_size(count * sizeof(T))));
    typedef T in_memory __attribute__((vector_size(count * sizeof(T)), may_alias));
};

}  // namespace detail

/// Doubles that the machine computes with at once, one in each lane (abi.hpp). All operations go lane by lane.
struct Packet {
    static constexpr int width = NSCDD_LANES;                 ///< lanes, doubles in a packet
    using Native = detail::Vector<double, width>::type;       ///< the compiler's vector of `width` doubles
    using Bits = detail::Vector<std::uint64_t, width>::type;  ///< the compiler's vector of `width` words of 64 bits

    Native lanes;  ///< `width` doubles

    Packet() = default;
    explicit Packet(double x) : lanes(x - Native{}) {}  ///< x in every lane
    /// Makes a packet of these lanes.
    static Packet of(Native lanes) {
        Packet packet;
        packet.lanes = lanes;
        return packet;
    }

    /// Reads `width` doubles from memory aligned to sizeof(Packet). The first is that of lane 0.
    static Packet load(const double* from) {
        return of(*reinterpret_cast<const detail::Vector<double, width>::in_memory*>(from));
    }
    /// Writes `width` doubles as load() reads them.
    void store(double* to) const { *reinterpret_cast<detail::Vector<double, width>::in_memory*>(to) = lanes; }

    ///@{
    /// The operation is done in every lane.
    friend Packet operator+(Packet a, Packet b) { return of(a.lanes + b.lanes); }
    friend Packet operator-(Packet a, Packet b) { return of(a.lanes - b.lanes); }
    friend Packet operator*(Packet a, Packet b) { return of(a.lanes * b.lanes); }
    friend Packet operator/(Packet a, Packet b) { return of(a.lanes / b.lanes); }
    ///@}
    /// The sum a b + c, rounded once where the machine can (fuses).
    friend Packet madd(Packet a, Packet b, Packet c) {
#if defined(NSCDD_MM) && defined(__FMA__)
        return of(NSCDD_MM(fmadd)(a.lanes, b.lanes, c.lanes));
#elif NSCDD_LANES == 2 && defined(__ARM_NEON) && defined(__aarch64__)
        return of(vfmaq_f64(c.lanes, a.lanes, b.lanes));
#elif defined(__FP_FAST_FMA)
        for (int k = 0; k < width; ++k) c.lanes[k] = __builtin_fma(a.lanes[k], b.lanes[k], c.lanes[k]);
        return c;
#else
        return a * b + c;
#endif
    }
#if defined(__FP_FAST_FMA) || defined(__FMA__)
    static constexpr bool fuses = true;
#else
    static constexpr bool fuses = false;  ///< counts and last digits differ from those of machines that fuse
#endif
    /// The magnitude |a|.
    friend Packet magnitude(Packet a) {
        return of(reinterpret_cast<Native>(reinterpret_cast<Bits>(a.lanes) & ~std::uint64_t{0} >> 1));
    }
};

///@{
/// The larger of two packets, in every lane, or of two doubles. So a contact law has one formula for both.
inline double larger(double a, double b) { return a < b ? b : a; }
inline Packet larger(Packet a, Packet b) {
#if defined(NSCDD_MM)
    return Packet::of(NSCDD_MM(max)(b.lanes, a.lanes));  // one instruction; the compiler makes two of the other
#else
    return Packet::of(a.lanes < b.lanes ? b.lanes : a.lanes);
#endif
}
///@}
///@{
/// The smaller of two packets, in every lane, or of two doubles.
inline double smaller(double a, double b) { return b < a ? b : a; }
inline Packet smaller(Packet a, Packet b) {
#if defined(NSCDD_MM)
    return Packet::of(NSCDD_MM(min)(b.lanes, a.lanes));
#else
    return Packet::of(b.lanes < a.lanes ? b.lanes : a.lanes);
#endif
}
///@}

namespace detail {

/// The inverse root a^-1/2 to the last bit or two, for 1e-300 <= a <= 1e300. The processor's estimate is not used,
/// because it differs between makers. A shift halves the exponent; then a y^2 = 1 - h with |h| < 0.07. (1 - h)^-1/2
/// comes by a quadratic, off by at most 3e-5 over these h, and then by its series to the third order.
inline Packet inverse_root(Packet a) {
    const auto miss = [a](Packet y) { return madd(Packet::of(-(a * y).lanes), y, Packet(1)); };
    Packet y = Packet::of(
        reinterpret_cast<Packet::Native>(0x5FE6EB50C7B537A9u - (reinterpret_cast<Packet::Bits>(a.lanes) >> 1)));
    Packet h = miss(y);
    y = y * madd(madd(Packet(0.3752279281616211), h, Packet(0.5010948181152344)), h, Packet(1.0000009536743164));
    h = miss(y);
    const Packet series = h * madd(madd(Packet(0.3125), h, Packet(0.375)), h, Packet(0.5));
    return madd(y, series, y);
}

/// Aligned as packets are loaded. Not Eigen's allocator: it has one name for all instruction sets, and a unit for one
/// of them would free what a unit for another has allocated in another way.
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

/// One double for each contact of a batch. A batch has eight contacts on every machine, so that the order of a sweep is
/// the same; a machine with narrower packets takes it in parts, which share no body.
inline constexpr int batch_size = 8;
using Batchful = std::array<Packet, batch_size / Packet::width>;

inline std::array<double, batch_size> doubles(const Batchful& a) {
    std::array<double, batch_size> all;
    alignas(sizeof(Packet)) double lane[Packet::width];
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (k % Packet::width == 0) a[k / Packet::width].store(lane);
        all[k] = lane[k % Packet::width];
    }
    return all;
}
/// In the order of the contacts.
inline double sum(const Batchful& a) {
    double total = 0;
    for (const double x : doubles(a)) total += x;
    return total;
}
inline double largest(const Batchful& a) {
    double most = -std::numeric_limits<double>::infinity();
    for (const double x : doubles(a)) most = x > most ? x : most;
    return most;
}
inline bool none_negative(Packet a) {
    alignas(sizeof(Packet)) double lane[Packet::width];
    a.store(lane);
    bool none = true;
    for (const double x : lane) none &= x >= 0;
    return none;
}

/// Which lane of (a, b) comes to lane l. First stage: lanes of a and b in turn. Later stages: pairs of lanes, in each
/// group the even (or odd) ones of a, then those of b; whole 128-bit lanes, which move at a lower price.
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

/// Transposes `count` packets in each group of `count` lanes, by count log2(count) shuffles (Eigen's 8 x 8 takes 40).
template <int count, int stage = 1>
EIGEN_ALWAYS_INLINE void transpose(Packet* packets) {
    if constexpr (stage < count) {
        mix_stage<count, stage>(packets, std::make_integer_sequence<int, count / 2>{});
        transpose<count, 2 * stage>(packets);
    }
}

/// One row of `row` doubles per lane, seen by component. Always inlined: as calls they cost a sweep a fifth more, a
/// residual a third.
template <int row>
class Rows {
  public:
    static constexpr int lanes = Packet::width;
    static_assert(row % lanes == 0 || lanes == 2 * row);

    /// The row of lane k begins at base[offset[k]].
    EIGEN_ALWAYS_INLINE void load(const double* base, const int* offset) {
        const auto at = [&](int k) { return base + offset[k]; };
        if constexpr (row >= lanes) {
            for (int p = 0; p < row / lanes; ++p)
                for (int k = 0; k < lanes; ++k) packets_[p * lanes + k] = Packet::load(at(k) + p * lanes);
        } else {
            for (int k = 0; k < row; ++k)
                packets_[k] = join(part(at(k)), part(at(k + row)), std::make_integer_sequence<int, lanes>{});
        }
        transpose();
    }
    /// Rows of one call are distinct, but for padding that is stored as it was loaded.
    EIGEN_ALWAYS_INLINE void store(double* base, const int* offset) {
        const auto at = [&](int k) { return base + offset[k]; };
        transpose();
        if constexpr (row >= lanes) {
            for (int p = 0; p < row / lanes; ++p)
                for (int k = 0; k < lanes; ++k) packets_[p * lanes + k].store(at(k) + p * lanes);
        } else {
            constexpr auto lanes_of_row = std::make_integer_sequence<int, row>{};
            for (int k = 0; k < row; ++k) {
                part(at(k)) = half<0>(packets_[k], lanes_of_row);
                part(at(k + row)) = half<row>(packets_[k], lanes_of_row);
            }
        }
    }
    Packet& operator[](int component) { return packets_[component]; }
    const Packet& operator[](int component) const { return packets_[component]; }

  private:
    using Part = typename Vector<double, row>::type;
    using PartInMemory = typename Vector<double, row>::in_memory;
    static constexpr int group = row < lanes ? row : lanes;

    EIGEN_ALWAYS_INLINE void transpose() {
        for (int p = 0; p < row / group; ++p) detail::transpose<group>(packets_ + p * group);
    }
    template <int... lane>
    EIGEN_ALWAYS_INLINE static Packet join(Part a, Part b, std::integer_sequence<int, lane...>) {
        return Packet::of(__builtin_shufflevector(a, b, lane...));
    }
    EIGEN_ALWAYS_INLINE static const PartInMemory& part(const double* from) {
        return *reinterpret_cast<const PartInMemory*>(from);
    }
    EIGEN_ALWAYS_INLINE static PartInMemory& part(double* to) { return *reinterpret_cast<PartInMemory*>(to); }
    template <int first, int... lane>
    EIGEN_ALWAYS_INLINE static Part half(Packet a, std::integer_sequence<int, lane...>) {
        return __builtin_shufflevector(a.lanes, a.lanes, (first + lane)...);
    }

    Packet packets_[static_cast<std::size_t>(row)];
};

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI

#undef NSCDD_MM
