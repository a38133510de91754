/// @file
/// The exact answer of one contact in closed form: the normal impulse, then the tangential one.
#pragma once

#include <cmath>

#include "nscdd/law/couples.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The impulse r' [N s] that satisfies the law at this contact while all others keep theirs. For a diagonal Delassus
/// block normal and tangent decouple: r_n' comes first, then the disk |r_t| <= limit(r_n'). These two stages are not
/// the projection on the cone (METHOD.md, section 3).
///
/// - v and c.r are the relative velocity [m/s] and the impulse now, in world axes; normal components if frictionless.
/// - inv_wn and inv_wt are 1/W_n and 1/W_t of the block [kg].
/// - spin is of a law with couples, and not looked at without. The couple comes last, for the spins that friction
///   leaves. Where a visit changes nothing, it is the answer (METHOD.md, section 3.2).
template <class M>
typename M::Impulse solve_contact(const Contact<M>& c, const typename M::Impulse& v, double inv_wn, double inv_wt,
                                  [[maybe_unused]] const detail::SpinBlock& spin = {}) {
    using Law = typename M::Law;
    if constexpr (M::friction) {
        const auto& force = detail::force_of<M>(c.r);
        const auto& velocity = detail::force_of<M>(v);
        const double vn = velocity.dot(c.normal);
        const double rn = force.dot(c.normal);
        const double normal = Law::normal(rn - (vn + c.bias) * inv_wn, c);
        const typename M::Vec trial = (force - rn * c.normal) - inv_wt * (velocity - vn * c.normal);
        const double limit = Law::limit(normal, c);
        const double trial2 = trial.squaredNorm();
        const double scale = trial2 > limit * limit ? limit / std::sqrt(trial2) : 1.0;
        if constexpr (M::rolling) {
            const typename M::Vec next = normal * c.normal + scale * trial;
            const typename M::Spin left =
                detail::couple_of<M>(v) - spin.coupling * detail::arm_cross<M>(c.normal, typename M::Vec(next - force));
            return detail::with_couple<M>(next, detail::solve_couple<M>(c, left, normal, spin));
        } else {
            return normal * c.normal + scale * trial;
        }
    } else {
        (void)inv_wt;
        return typename M::Impulse{Law::normal(c.r[0] - (v[0] + c.bias) * inv_wn, c)};
    }
}

}}  // namespace nscdd::NSCDD_ABI
