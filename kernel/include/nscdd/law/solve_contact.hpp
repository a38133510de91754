/// @file
/// The exact answer of one contact in closed form: the normal impulse, then the tangential one.
#pragma once

#include <cmath>

#include "nscdd/core/contact_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The impulse r' [N s] that satisfies the law at this contact while all others keep theirs. For a diagonal Delassus
/// block normal and tangent decouple: r_n' comes first, then the disk |r_t| <= limit(r_n'). These two stages are not
/// the projection on the cone (METHOD.md, section 3).
///
/// - v and c.r are the relative velocity [m/s] and the impulse now, in world axes; normal components if frictionless.
/// - inv_wn and inv_wt are 1/W_n and 1/W_t of the block [kg].
template <class M>
typename M::Impulse solve_contact(const Contact<M>& c, const typename M::Impulse& v, double inv_wn, double inv_wt) {
    using Law = typename M::Law;
    if constexpr (M::friction) {
        const double vn = v.dot(c.normal);
        const double rn = c.r.dot(c.normal);
        const double normal = Law::normal(rn - (vn + c.bias) * inv_wn, c);
        const typename M::Vec trial = (c.r - rn * c.normal) - inv_wt * (v - vn * c.normal);
        const double limit = Law::limit(normal, c);
        const double trial2 = trial.squaredNorm();
        const double scale = trial2 > limit * limit ? limit / std::sqrt(trial2) : 1.0;
        return normal * c.normal + scale * trial;
    } else {
        (void)inv_wt;
        return typename M::Impulse{Law::normal(c.r[0] - (v[0] + c.bias) * inv_wn, c)};
    }
}

}}  // namespace nscdd::NSCDD_ABI
