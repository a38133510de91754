/// @file
/// Coulomb's law for contacts that hold together: a contact may pull, with a bounded force, as long as its gap is
/// small.
/// ```
/// using Model = nscdd::Model<3, nscdd::Cohesive>;
/// settings.materials.set(0, 0, {.friction = 0.4, .cohesion = 2.0, .range = 1e-6});
/// ```
#pragma once

#include "nscdd/core/contact_law.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Coulomb's law with cohesion: r_n >= -c h and |r_t| <= mu (r_n + c h), where the gap is at most the range (METHOD.md,
/// section 3.1). Beyond the range it is Coulomb's. Two grains that part lose the energy c times the range, besides that
/// of sliding.
struct Cohesive {
    static constexpr const char* name = "cohesive Coulomb";  ///< in messages
    static constexpr bool friction = true;                   ///< impulses have `dim` components, grains have spins
    /// Coefficients of two materials.
    struct Pairing {
        double friction = 0;     ///< Coulomb's mu, >= 0
        double restitution = 0;  ///< Newton's e, 0 to 1; 0 where there is cohesion
        double cohesion = 0;     ///< c, the largest force that pulls, >= 0 [N]
        double range = 0;        ///< gap up to which it pulls; > 0 where there is cohesion [m]

        /// Returns null, or a text that says what is wrong. Without a range round-off of the gap would decide; and
        /// Newton's law of impact would pull together what has rebounded.
        const char* fault() const {
            const auto sound = [](double x) { return x >= 0 && x <= (std::numeric_limits<double>::max)(); };
            return !sound(friction)                      ? "friction must be >= 0 and finite"
                   : !sound(cohesion)                    ? "cohesion must be >= 0 and finite"
                   : !sound(range)                       ? "range must be >= 0 and finite"
                   : cohesion > 0 && !(range > 0)        ? "cohesion needs range, the gap up to which it pulls"
                   : cohesion > 0 && !(restitution == 0) ? "cohesion needs restitution 0"
                                                         : nullptr;
        }
    };
    /// Numbers of the law that one contact stores.
    struct Coefficients {
        double friction_coefficient = 0;                       ///< mu
        double pull = 0;                                       ///< c h within the range, else 0 [N s]
        bool operator==(const Coefficients&) const = default;  ///< whether both are the same
    };

    /// The gap up to which two grains are a contact, however slowly they move [m].
    static double range(const Pairing& pairing) { return pairing.cohesion > 0 ? pairing.range : 0; }
    /// Of a contact with this gap [m] in a step h [s].
    static Coefficients coefficients(const Pairing& pairing, double gap, double h) {
        return {pairing.friction, gap <= pairing.range ? pairing.cohesion * h : 0};
    }
    /// Returns null, or a text where a coefficient is negative or not finite.
    static const char* fault(const Coefficients& k) {
        const auto sound = [](double x) { return x >= 0 && x <= (std::numeric_limits<double>::max)(); };
        return sound(k.friction_coefficient) && sound(k.pull)
                   ? nullptr
                   : "the coefficient of friction or the pull is negative or not finite";
    }
    /// The normal impulse r_n = max(-c h, trial) [N s].
    template <class Real>
    static Real normal(Real trial, const Coefficients& k) {
        return larger(Real(-k.pull), trial);
    }
    /// The largest |r_t|, which is mu (r_n + c h) [N s].
    template <class Real>
    static Real limit(Real normal, const Coefficients& k) {
        return Real(k.friction_coefficient) * (normal + Real(k.pull));
    }
    /// By how much the contact pulls less than it can, or pushes [N s].
    template <class Real>
    static Real excess(Real normal, const Coefficients& k) {
        return normal + Real(k.pull);
    }
};

}}  // namespace nscdd::NSCDD_ABI
