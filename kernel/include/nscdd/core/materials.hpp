/// @file
/// Coefficients per pair of materials, such as friction and restitution.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/core/contact_law.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A symmetric table with one Pairing of the law (ContactLaw) for each pair of materials of a scene.
template <class M>
class Materials {
  public:
    using Pairing = typename M::Law::Pairing;  ///< coefficients of two materials
    static constexpr int most = 4096;          ///< materials that a table may have; then it takes 256 MB

    /// Makes a table of `count` materials, each pair with the defaults of Pairing. Throws std::invalid_argument unless
    /// 1 <= count <= most.
    explicit Materials(int count = 1) : count_(count) {
        if (count < 1 || count > most)
            throw std::invalid_argument(std::to_string(count) + " materials: needs 1 to " + std::to_string(most));
        table_.resize(static_cast<std::size_t>(count) * static_cast<std::size_t>(count));
    }

    /// Sets the coefficients of materials a and b, in both orders. Throws std::invalid_argument for materials out of
    /// range, and for coefficients that no pair can have.
    void set(int a, int b, Pairing pairing) {
        for (const int material : {a, b})
            if (material < 0 || material >= count_)
                throw std::invalid_argument("material " + std::to_string(material) + ": there are " +
                                            std::to_string(count_) + ", counted from 0");
        if (const char* fault = pairing.fault()) throw std::invalid_argument(fault);
        if (!(pairing.restitution >= 0 && pairing.restitution <= 1))
            throw std::invalid_argument("restitution must be within [0, 1]");
        table_[index(a, b)] = table_[index(b, a)] = pairing;
        known_ = true;
    }
    /// Of materials 0 to count()-1, unchecked.
    const Pairing& operator()(int a, int b) const { return table_[index(a, b)]; }
    int count() const { return count_; }   ///< number of materials
    bool known() const { return known_; }  ///< whether any pair has been set

  private:
    std::size_t index(int a, int b) const {
        return static_cast<std::size_t>(a) * static_cast<std::size_t>(count_) + static_cast<std::size_t>(b);
    }

    int count_;
    bool known_ = false;
    std::vector<Pairing> table_;
};

namespace detail {

/// The largest gap at which any pair is a contact, however slowly it moves (range_of()) [m].
template <class M>
double largest_range(const Materials<M>& materials) {
    double most = 0;
    for (int a = 0; a < materials.count(); ++a)
        for (int b = 0; b <= a; ++b) most = (std::max)(most, range_of<typename M::Law>(materials(a, b)));
    return most;
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
