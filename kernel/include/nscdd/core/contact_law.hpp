/// @file
/// The concept of a contact law, and the two laws on Coulomb's cone. Further ones are shipped in headers of their own:
/// core/cohesive.hpp and core/rolling.hpp.
/// ```
/// using Model = nscdd::Model<3, nscdd::Coulomb>;
/// ```
/// A law of your own is one class; kernel/examples/own_law.cpp is an example. NLGS, NSCDD, acceleration and the
/// fast sweep use it as they use Coulomb's. Newton's method, the gradient methods and problems in local form know the
/// laws on the cone alone (SolvedOnCone).
#pragma once

#include <concepts>
#include <limits>
#include <type_traits>

#include "nscdd/core/packet.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Coulomb's law: |r_t| <= mu r_n, and r_t opposes the slip velocity where the contact slides.
struct Coulomb {
    static constexpr const char* name = "Coulomb";  ///< in messages
    static constexpr bool friction = true;          ///< impulses have `dim` components, grains have spins
    /// Numbers of the law that one contact stores.
    struct Coefficients {
        double friction_coefficient = 0;                       ///< mu
        bool operator==(const Coefficients&) const = default;  ///< whether mu is the same
    };
    /// Coefficients of two materials.
    struct Pairing {
        double friction = 0;     ///< Coulomb's mu, >= 0
        double restitution = 0;  ///< Newton's e, 0 to 1

        /// Returns null, or a text that says why mu is wrong. Materials::set() checks e.
        const char* fault() const {
            return friction >= 0 && friction <= (std::numeric_limits<double>::max)()
                       ? nullptr
                       : "friction must be >= 0 and finite";
        }
    };

    /// Returns mu of the pair of materials. The gap [m] and the step h [s] do not matter.
    static Coefficients coefficients(const Pairing& pairing, double /*gap*/, double /*h*/) {
        return {pairing.friction};
    }
    /// Returns null, or a text where mu is negative or not finite.
    static const char* fault(const Coefficients& k) {
        return k.friction_coefficient >= 0 && k.friction_coefficient <= (std::numeric_limits<double>::max)()
                   ? nullptr
                   : "the coefficient of friction is negative or not finite";
    }
    /// The normal impulse r_n = max(0, trial) [N s].
    template <class Real>
    static Real normal(Real trial, const Coefficients&) {
        return larger(Real(0), trial);
    }
    /// The largest |r_t|, which is mu r_n [N s].
    template <class Real>
    static Real limit(Real normal, const Coefficients& k) {
        return Real(k.friction_coefficient) * normal;
    }
    /// The excess is r_n itself [N s], because the least impulse of a contact is 0.
    template <class Real>
    static Real excess(Real normal, const Coefficients&) {
        return normal;
    }
};

/// The law without friction: 0 <= v_n + bias perp r_n >= 0. There is no tangential impulse, hence no rotation.
struct Frictionless {
    static constexpr const char* name = "frictionless";  ///< in messages
    static constexpr bool friction = false;              ///< impulses have one component, grains have no spin
    /// A contact stores nothing for this law.
    struct Coefficients {
        bool operator==(const Coefficients&) const = default;  ///< always true
    };
    using Pairing = Coulomb::Pairing;  ///< only the restitution counts

    static Coefficients coefficients(const Pairing&, double /*gap*/, double /*h*/) { return {}; }  ///< empty
    static const char* fault(const Coefficients&) { return nullptr; }                              ///< always null
    /// The normal impulse r_n = max(0, trial) [N s].
    template <class Real>
    static Real normal(Real trial, const Coefficients&) {
        return larger(Real(0), trial);
    }
    /// The excess is r_n itself [N s], because the least impulse of a contact is 0.
    template <class Real>
    static Real excess(Real normal, const Coefficients&) {
        return normal;
    }
};

namespace detail {

template <class L>
concept LawSaysFriction = requires {
    requires std::same_as<decltype(L::friction), const bool>;
    typename std::bool_constant<L::friction>;  // known to the compiler
};
template <class L>
concept LawHasCoefficients =
    std::default_initializable<typename L::Coefficients> && std::equality_comparable<typename L::Coefficients>;
template <class L>
concept LawHasPairing = requires(const typename L::Pairing& pairing, double x) {
    requires std::default_initializable<typename L::Pairing>;
    { pairing.restitution } -> std::convertible_to<double>;
    { pairing.fault() } -> std::same_as<const char*>;
    { L::coefficients(pairing, x, x) } -> std::same_as<typename L::Coefficients>;
};
template <class L>
concept LawNamesFaults = requires(const typename L::Coefficients& k) {
    { L::fault(k) } -> std::same_as<const char*>;
};
template <class L, class Real>
concept LawSolvesNormal = requires(Real x, const typename L::Coefficients& k) {
    { L::normal(x, k) } -> std::same_as<Real>;
    { L::excess(x, k) } -> std::same_as<Real>;
};
template <class L, class Real>
concept LawLimitsFriction = LawSaysFriction<L> && (!L::friction || requires(Real x, const typename L::Coefficients& k) {
                                { L::limit(x, k) } -> std::same_as<Real>;
                            });
/// Whether contacts have couples.
template <class L>
constexpr bool law_rolls = requires { requires L::rolling; };
template <class L, class Real>
concept LawLimitsCouples = !law_rolls<L> || (L::friction && requires(Real x, const typename L::Coefficients& k) {
    { L::rolling_limit(x, k) } -> std::same_as<Real>;
    { L::twisting_limit(x, k) } -> std::same_as<Real>;
});

}  // namespace detail

/// A law in two stages, for contacts whose block of W is diagonal (METHOD.md, section 3). The normal impulse comes
/// first. The tangential one follows; it is cut back to a limit that the normal impulse sets.
///
/// All members are static. Real is double and Packet, so scalar and fast sweep have one formula. Impulses and limits
/// are in N s. Both types have Real(double), the operators + - * / between two of them, and larger(a, b) and smaller(a,
/// b), lane by lane. There is no comparison, hence no branch, and no unary minus.
/// ```
/// bool friction       constexpr: contacts have a tangential impulse, and grains a spin
/// Coefficients        of one contact, stored with it; equality tells which contacts may share a batch
/// Pairing             of two materials: `restitution`, and fault(), null or what no pair can have
/// coefficients(pairing, gap, h)
///                     of a contact with this gap [m] in a step h [s]; gap <= 0: they touch
/// fault(k)            null, or what is wrong with coefficients that a foreign code has filled in
/// normal(trial, k)    r_n, for the impulse r_n - (v_n + bias)/W_n that would stop the approach: not decreasing,
///                     changes by no more than the trial does, normal(0) = 0
/// limit(normal, k)    the largest |r_t|, >= 0; only with friction
/// excess(normal, k)   by how much r_n exceeds the least that the contact can have, >= 0: where it is positive
///                     the contact must not open, (v_n + bias) excess = 0 at an answer
/// ```
/// A law that acts at a distance has `range(pairing)` besides, the gap up to which a pair is a contact, however slowly
/// it moves [m]: a law that may pull needs it. A law with `rolling`, a constant that is true, gives contacts a couple,
/// and has rolling_limit(normal, k) and twisting_limit(normal, k), its largest parts across and along the normal [N m
/// s]. The kernel makes these of them: the solve of one contact and of a packet; eta, velocity error and energies
/// (law/residual.hpp); and the warm start. The warm start makes the last step's impulse admissible by normal() and
/// limit().
template <class L>
concept ContactLaw =
    detail::LawSaysFriction<L> && detail::LawHasCoefficients<L> && detail::LawHasPairing<L> &&
    detail::LawNamesFaults<L> && detail::LawSolvesNormal<L, double> && detail::LawSolvesNormal<L, Packet> &&
    detail::LawLimitsFriction<L, double> && detail::LawLimitsFriction<L, Packet> &&
    detail::LawLimitsCouples<L, double> && detail::LawLimitsCouples<L, Packet>;

namespace detail {

/// The gap up to which pairs are contacts, however slowly they move [m]; of a law that does not say 0.
template <class L>
double range_of(const typename L::Pairing& pairing) {
    if constexpr (requires {
                      { L::range(pairing) } -> std::same_as<double>;
                  })
        return L::range(pairing);
    else
        return 0;
}

/// A law whose impulses lie in Coulomb's cone about the normal.
template <class L>
concept SolvedOnCone = std::same_as<L, Frictionless> || std::same_as<L, Coulomb>;

/// Number of the first thing that a law lacks, 0 for none: what follows is made of it, and would be missed in vain.
template <class L>
consteval int first_lack() {
    return !LawSaysFriction<L>                                              ? 1
           : !LawHasCoefficients<L>                                         ? 2
           : !LawHasPairing<L>                                              ? 3
           : !LawNamesFaults<L>                                             ? 4
           : !LawSolvesNormal<L, double>                                    ? 5
           : !LawSolvesNormal<L, Packet>                                    ? 6
           : !LawLimitsFriction<L, double> || !LawLimitsFriction<L, Packet> ? 7
           : !LawLimitsCouples<L, double> || !LawLimitsCouples<L, Packet>   ? 8
                                                                            : 0;
}

/// Stops the compiler with a line for the first thing that a law lacks.
template <class L>
consteval bool complete_law() {
    constexpr int lack = first_lack<L>();
    static_assert(lack != 1, "contact law: needs `static constexpr bool friction`, a constant");
    static_assert(lack != 2,
                  "contact law: needs `struct Coefficients` with defaults and operator==, empty if there are none");
    static_assert(lack != 3,
                  "contact law: needs `Pairing` with `restitution` and `const char* fault() const`, and "
                  "`static Coefficients coefficients(const Pairing&, double gap, double h)`");
    static_assert(lack != 4, "contact law: needs `static const char* fault(const Coefficients&)`");
    static_assert(lack != 5,
                  "contact law: needs `normal(x, k)` and `excess(x, k)`, static, that take and return a double");
    static_assert(lack != 6,
                  "contact law: `normal(x, k)` and `excess(x, k)` must be templates that take and return a Packet too");
    static_assert(lack != 7, "contact law with friction: needs `limit(normal, k)`, static, for double and Packet");
    static_assert(
        lack != 8,
        "contact law with couples: needs friction, and `rolling_limit(normal, k)` and `twisting_limit(normal, "
        "k)`, static, for double and Packet");
    return true;
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
