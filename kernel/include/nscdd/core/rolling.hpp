/// @file
/// Coulomb's law with resistance to rolling and to twisting.
/// ```
/// using Model = nscdd::Model<3, nscdd::Rolling>;
/// settings.materials.set(0, 0, {.friction = 0.5, .rolling = 1e-4, .twisting = 5e-5});
/// ```
#pragma once

#include "nscdd/core/contact_law.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Coulomb's law, and a couple by which a contact holds the spins of its bodies together (METHOD.md, section 3.2). Its
/// part along the normal is at most mu_tw r_n, the other one at most mu_r r_n; each opposes its part of the relative
/// spin. Both coefficients are lengths: a sphere on a slope begins to roll at tan(slope) = mu_r/R. In 2D nothing
/// twists.
struct Rolling : Coulomb {
    static constexpr const char* name = "Coulomb with rolling resistance";  ///< in messages
    static constexpr bool rolling = true;                                   ///< impulses have couples
    /// Coefficients of two materials.
    struct Pairing {
        double friction = 0;     ///< Coulomb's mu, >= 0
        double restitution = 0;  ///< Newton's e, 0 to 1
        double rolling = 0;      ///< mu_r, >= 0 [m]
        double twisting = 0;     ///< mu_tw, >= 0 [m]

        /// Returns null, or a text that says what is wrong.
        const char* fault() const {
            return !is_sound(friction)   ? "friction must be >= 0 and finite"
                   : !is_sound(rolling)  ? "rolling must be >= 0 and finite"
                   : !is_sound(twisting) ? "twisting must be >= 0 and finite"
                                         : nullptr;
        }
    };
    /// Numbers of the law that one contact stores.
    struct Coefficients : Coulomb::Coefficients {
        double rolling_coefficient = 0;                        ///< mu_r [m]
        double twisting_coefficient = 0;                       ///< mu_tw [m]
        bool operator==(const Coefficients&) const = default;  ///< whether all are the same
    };

    /// Returns the coefficients of the pair of materials. The gap [m] and the step h [s] do not matter.
    static Coefficients coefficients(const Pairing& pairing, double /*gap*/, double /*h*/) {
        return {{pairing.friction}, pairing.rolling, pairing.twisting};
    }
    /// Returns null, or a text where a coefficient is negative or not finite.
    static const char* fault(const Coefficients& k) {
        return is_sound(k.friction_coefficient) && is_sound(k.rolling_coefficient) && is_sound(k.twisting_coefficient)
                   ? nullptr
                   : "the coefficient of friction, rolling or twisting is negative or not finite";
    }
    /// The largest couple across the normal, which is mu_r r_n [N m s].
    template <class Real>
    static Real rolling_limit(Real normal, const Coefficients& k) {
        return Real(k.rolling_coefficient) * normal;
    }
    /// The largest couple along the normal, which is mu_tw r_n [N m s].
    template <class Real>
    static Real twisting_limit(Real normal, const Coefficients& k) {
        return Real(k.twisting_coefficient) * normal;
    }

  private:
    static bool is_sound(double x) { return x >= 0 && x <= (std::numeric_limits<double>::max)(); }
};

}}  // namespace nscdd::NSCDD_ABI
