// Random numbers that follow from a seed and counters alone: the same in every order and on any number of ranks.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>

namespace nscdd {

// 64 bits of the numbers, by the mixing of SplitMix64 [Steele, Lea, Flood 2014].
inline std::uint64_t random_bits(std::initializer_list<std::uint64_t> numbers) {
    std::uint64_t state = 0;
    for (const std::uint64_t number : numbers) {
        state += number + 0x9e3779b97f4a7c15;
        state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9;
        state = (state ^ (state >> 27)) * 0x94d049bb133111eb;
        state ^= state >> 31;
    }
    return state;
}

// Uniform in [0, 1).
inline double random_number(std::initializer_list<std::uint64_t> numbers) {
    return std::ldexp(static_cast<double>(random_bits(numbers) >> 11), -53);
}

// A permutation of 0 to n - 1 of which each place is found by itself: a Feistel network of four rounds on the least
// even number of bits that holds n, entered again until it comes out below n.
class Permutation {
  public:
    Permutation(std::uint64_t n, std::uint64_t seed)
        : n_(n), seed_(seed), half_(static_cast<int>(std::bit_width(n > 1 ? n - 1 : 1) + 1) / 2) {}

    std::uint64_t operator()(std::uint64_t k) const {
        const std::uint64_t mask = (std::uint64_t{1} << half_) - 1;
        do {
            std::uint64_t left = k >> half_, right = k & mask;
            for (std::uint64_t round = 0; round < 4; ++round) {
                const std::uint64_t next = left ^ (random_bits({seed_, round, right}) & mask);
                left = right;
                right = next;
            }
            k = left << half_ | right;
        } while (k >= n_);
        return k;
    }

  private:
    std::uint64_t n_, seed_;
    int half_;  // bits
};

}  // namespace nscdd
