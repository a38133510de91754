// Friction and restitution, per pair of materials.
#pragma once

#include <cmath>
#include <stdexcept>
#include <vector>

namespace nscdd {

struct Pairing {
    double friction = 0;     // Coulomb's mu
    double restitution = 0;  // Newton's e, 0 to 1
};

class Materials {
  public:
    explicit Materials(int count = 1) : count_(count), table_(index(count, 0)) {}

    void set(int a, int b, Pairing pairing) {
        if (!(pairing.friction >= 0 && std::isfinite(pairing.friction)) ||
            !(pairing.restitution >= 0 && pairing.restitution <= 1))
            throw std::invalid_argument("friction must be >= 0 and finite, restitution within [0, 1]");
        table_.at(index(a, b)) = table_.at(index(b, a)) = pairing;
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
