// The contact problem (4) of one step on one subdomain, matrix-free: body velocities, contacts, impulses.
//
// Solvers know nothing else. A code with its own detection fills one of these, calls nscdd::nlgs(), and reads
// the velocities and impulses back; bodies, walls, contacts and the step are all that it must fill (validate.hpp).
// Sizes: 64 bytes a body and 104 a contact in 3D with friction.
#pragma once

#include <algorithm>
#include <vector>

#include "nscdd/core/model.hpp"

namespace nscdd::inline NSCDD_ABI {

template <bool friction>
struct BodySpin {
    double inv_inertia = 0;  // split, as inv_mass
};
template <>
struct BodySpin<false> {};

// A grain as the sweep sees it: V and the split M^-1 of this copy (multiplicity / whole mass).
template <class M>
struct Body : BodySpin<M::friction> {
    typename M::Velocity v = M::Velocity::Zero();
    double inv_mass = 0;

    auto linear() { return v.template head<M::dim>(); }
    auto linear() const { return v.template head<M::dim>(); }
    auto spin() { return v.template tail<M::spins>(); }
    auto spin() const { return v.template tail<M::spins>(); }
};

template <class M>
struct WallBody {
    typename M::Vec prescribed = M::Vec::Zero();
    double speed = 0;     // along the wall's normal, on top of the prescribed velocity; 0 for a wall that is not driven
    double inv_mass = 0;  // split; 0 for a wall that is not driven
};

template <bool friction>
struct ContactFriction {
    double inv_wt = 0;   // 1/W_t of the split masses
    double lever_i = 0;  // r + g/2: contact point in the middle of the gap, so pairs exchange no angular momentum
    double lever_j = 0;
};
template <>
struct ContactFriction<false> {};

template <class M>
struct Contact : ContactFriction<M::friction>, M::Law::Coefficients {
    int i = 0;
    int j = 0;               // the other grain, or the wall
    typename M::Vec normal;  // unit, from j to i
    double bias = 0;         // v_n >= -bias: g+/h, or e v_n- under Newton's law of restitution [m/s]
    double inv_wn = 0;       // 1/W_n of the split masses
    typename M::Impulse r = M::Impulse::Zero();  // on i

    const typename M::Law::Coefficients& coefficients() const { return *this; }
    typename M::Law::Coefficients& coefficients() { return *this; }
};

template <class M>
struct ContactProblem {
    std::vector<Body<M>> bodies;
    std::vector<WallBody<M>> walls;
    std::vector<Contact<M>> contacts;       // between grains, in spatial order
    std::vector<Contact<M>> wall_contacts;  // j is a wall
    std::vector<int> multiplicity;          // of each body; W of the residual takes whole masses
    std::vector<int> wall_multiplicity;     // either may be empty: then nothing is split, all are 1
    double h = 0;                           // step [s]
    double least_radius = 0;  // of the whole scene [m], scale of the penetration test; 0: no such test (SolveReport)

    // Whether any wall is pushed by a force. The same on every rank.
    bool driven_walls() const {
        return std::any_of(walls.begin(), walls.end(), [](const WallBody<M>& wall) { return wall.inv_mass > 0; });
    }

    std::size_t contact_count() const { return contacts.size() + wall_contacts.size(); }
    int copies(std::size_t body) const { return multiplicity.empty() ? 1 : multiplicity[body]; }
    int wall_copies(std::size_t wall) const { return wall_multiplicity.empty() ? 1 : wall_multiplicity[wall]; }

    // What a sweep reads and writes.
    std::size_t bytes() const {
        return bodies.size() * sizeof(Body<M>) + walls.size() * sizeof(WallBody<M>) +
               contact_count() * sizeof(Contact<M>);
    }
};

}  // namespace nscdd
