// Random numbers that are the same on every machine: those of std::uniform_real_distribution are not.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace wild {

class Draw {
  public:
    explicit Draw(std::uint64_t seed) : random_(seed) {}

    double uniform(double low, double high) { return low + (high - low) * (double(random_() >> 11) * 0x1p-53); }
    double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
    int integer(int low, int high) { return low + static_cast<int>(random_() % std::uint64_t(high - low + 1)); }
    bool chance(double probability) { return uniform(0, 1) < probability; }
    double normal() {
        return std::sqrt(-2 * std::log(1 - uniform(0, 1))) * std::cos(2 * std::numbers::pi * uniform(0, 1));
    }
    // A vector type of fixed size with normally distributed entries.
    template <class Vector>
    Vector vector(double deviation) {
        Vector v;
        for (int d = 0; d < v.size(); ++d) v[d] = deviation * normal();
        return v;
    }

  private:
    std::mt19937_64 random_;
};

}  // namespace wild
