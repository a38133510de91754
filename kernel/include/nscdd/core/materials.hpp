// Friction and restitution, per pair of materials.
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/core/abi.hpp"

namespace nscdd::inline NSCDD_ABI {

struct Pairing {
    double friction = 0;     // Coulomb's mu
    double restitution = 0;  // Newton's e, 0 to 1
};

class Materials {
  public:
    static constexpr int most = 4096;  // a table of 256 MB

    // Throws std::invalid_argument unless 1 <= count <= most.
    explicit Materials(int count = 1) : count_(count) {
        if (count < 1 || count > most)
            throw std::invalid_argument(std::to_string(count) + " materials: needs 1 to " + std::to_string(most));
        table_.resize(static_cast<std::size_t>(count) * static_cast<std::size_t>(count));
    }

    // Throws std::invalid_argument for materials that there are not, and for what no pair can have.
    void set(int a, int b, Pairing pairing) {
        for (const int material : {a, b})
            if (material < 0 || material >= count_)
                throw std::invalid_argument("material " + std::to_string(material) + ": there are " +
                                            std::to_string(count_) + ", counted from 0");
        if (!(pairing.friction >= 0 && std::isfinite(pairing.friction)) ||
            !(pairing.restitution >= 0 && pairing.restitution <= 1))
            throw std::invalid_argument("friction must be >= 0 and finite, restitution within [0, 1]");
        table_[index(a, b)] = table_[index(b, a)] = pairing;
    }
    const Pairing& operator()(int a, int b) const { return table_[index(a, b)]; }
    int count() const { return count_; }

  private:
    std::size_t index(int a, int b) const {
        return static_cast<std::size_t>(a) * static_cast<std::size_t>(count_) + static_cast<std::size_t>(b);
    }

    int count_;
    std::vector<Pairing> table_;
};

}  // namespace nscdd
