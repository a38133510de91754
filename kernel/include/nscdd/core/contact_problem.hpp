#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "nscdd/core/model.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

// Bases of public types have a namespace without functions. In the kernel's own, calls with such a type would find the
// functions there, beside those of a caller.
namespace detail::bases {

/// The part of a body that only friction needs.
template <bool friction>
struct BodySpin {
    double inv_inertia = 0;  ///< 1/inertia [1/(kg m^2)], split as inv_mass
};
/// Without friction a body has no spin.
template <>
struct BodySpin<false> {};

/// The part of a wall that only a couple needs.
template <class M, bool rolling = M::rolling>
struct WallSpin {
    typename M::Spin value = M::Spin::Zero();  ///< of an obstacle that turns [rad/s]
};
/// Without couples nothing is stored for them.
template <class M>
struct WallSpin<M, false> {};

/// The part of a contact that only friction needs.
template <bool friction>
struct ContactFriction {
    double inv_wt = 0;  ///< omega/W_t of the split masses [kg], set by prepare_contacts() for the scalar sweep
    /// R_i + g/2 [m]; at a wall R_i. The lever ends in the middle of the gap, so that pairs make no angular momentum.
    double lever_i = 0;
    double lever_j = 0;  ///< R_j + g/2 [m]; of a wall 0
};
/// Without friction levers do not count, and W_t is not needed.
template <>
struct ContactFriction<false> {};

/// The part of a contact that only a couple needs, set by prepare_contacts() for the scalar sweep.
template <bool rolling>
struct ContactCouple {
    double inv_ws = 0;    ///< omega/W_s of the split masses [kg m^2]
    double coupling = 0;  ///< l_i/I_i - l_j/I_j of the split masses [1/(kg m)]
};
/// Without couples nothing is stored for them.
template <>
struct ContactCouple<false> {};

}  // namespace detail::bases

/// A grain as the sweep sees it: velocity V and inverse mass. The inverse mass is that of this copy, multiplicity over
/// the whole mass. With friction it has inv_inertia besides [1/(kg m^2)], split as inv_mass.
template <class M>
struct Body : detail::bases::BodySpin<M::friction> {
    typename M::Velocity v = M::Velocity::Zero();  ///< translations [m/s], then spins [rad/s]
    double inv_mass = 0;                           ///< 1/mass [1/kg], split: multiplicity over the whole mass

    auto linear() { return v.template head<M::dim>(); }        ///< translations, `dim` numbers [m/s]
    auto linear() const { return v.template head<M::dim>(); }  ///< translations, `dim` numbers [m/s]
    auto spin() { return v.template tail<M::spins>(); }        ///< spins: 3 in 3D, 1 in 2D, 0 without friction [rad/s]
    auto spin() const { return v.template tail<M::spins>(); }  ///< spins: 3 in 3D, 1 in 2D, 0 without friction [rad/s]
};

/// A wall as the sweep sees it. Its velocity is prescribed + speed * normal.
template <class M>
struct WallBody {
    typename M::Vec prescribed = M::Vec::Zero();  ///< velocity that is given, not solved for [m/s]
    double speed = 0;     ///< along the wall's normal, on top of the prescribed velocity; 0 unless driven [m/s]
    double inv_mass = 0;  ///< 1/mass [1/kg], split; 0 for a wall that is not driven
    [[no_unique_address]] detail::bases::WallSpin<M> spin{};  ///< prescribed
};

/// One contact. With friction it has the levers lever_i and lever_j besides [m]: from a centre to the middle of the
/// gap, or to the surface at a wall. The law's coefficients are a base class, so a law without any takes no memory.
template <class M>
struct Contact : detail::bases::ContactFriction<M::friction>,
                 detail::bases::ContactCouple<M::rolling>,
                 M::Law::Coefficients {
    int i = 0;               ///< number of the grain in ContactProblem::bodies
    int j = 0;               ///< number of the other grain in bodies, or of the wall in walls
    typename M::Vec normal;  ///< unit, from j to i
    double bias = 0;         ///< v_n >= -bias: g+/h, or e v_n- under Newton's law of restitution [m/s]
    double inv_wn = 0;       ///< omega/W_n of the split masses [kg], as inv_wt
    typename M::Impulse r = M::Impulse::Zero();  ///< impulse on i [N s]; in: where a solver starts

    const typename M::Law::Coefficients& coefficients() const { return *this; }  ///< coefficients, to be read
    typename M::Law::Coefficients& coefficients() { return *this; }              ///< coefficients, to be set
};

/// The contact problem (4) of one step on one subdomain, matrix-free: velocities of bodies, contacts, impulses.
///
/// Solvers know nothing else. A code with its own detection fills one of these, calls nscdd::nlgs(), and reads
/// velocities and impulses back. It must fill bodies, walls, contacts and the step (validate.hpp). In 3D with friction
/// a body takes 64 bytes and a contact 104.
template <class M>
struct ContactProblem {
    /// The flow of a cell as contacts see it. A stress may drive sides of the cell: their speeds are unknowns of the
    /// step, as those of driven walls.
    struct Flow {
        typename M::Gradient gradient = M::Gradient::Zero();  ///< as prescribed [1/s]
        /// For each axis, the number in ContactProblem::walls of the side that a stress drives, whose speed is `length`
        /// times its rate; -1 if there is none.
        std::array<int, M::dim> side;
        double length = 0;  ///< Cell::length [m]

        /// Whether a stress drives any side.
        bool driven() const {
            return std::any_of(side.begin(), side.end(), [](int s) { return s >= 0; });
        }
    };

    std::vector<Body<M>> bodies;            ///< in: V_free + M^-1 H r [m/s, rad/s]; out: the same with the new r
    std::vector<WallBody<M>> walls;         ///< all walls of the scene, or sides of its cell that a stress drives
    std::vector<Contact<M>> contacts;       ///< between grains, in spatial order
    std::vector<Contact<M>> wall_contacts;  ///< j is a wall
    std::vector<int> multiplicity;          ///< of each body; the residual takes whole masses by it
    std::vector<int> wall_multiplicity;     ///< of each wall; an empty list stands for 1 everywhere
    double h = 0;                           ///< step [s]
    /// Flow of a cell that repeats: the velocity of i relative to j has the gradient times x_i - x_j besides. Only with
    /// friction, whose levers know how far grains are from each other.
    std::optional<Flow> flow;
    /// Centres of the bodies, for the tests of a solved step (METHOD.md, section 5). They and the radii may be empty.
    std::vector<typename M::Vec> centres;  ///< [m]; they say how far a component of the scene reaches
    std::vector<double> radii;             ///< [m]; scale of the gap error of a contact
    double least_radius = 0;  ///< of the whole scene [m], scale of the penetration test (SolveReport); 0: no such test

    /// True if a force pushes any wall, the same on every rank.
    bool driven_walls() const {
        return std::any_of(walls.begin(), walls.end(), [](const WallBody<M>& wall) { return wall.inv_mass > 0; });
    }

    /// Velocity gradient of the flow with the speeds of sides as they are [1/s]; only where there is a flow.
    typename M::Gradient flow_gradient() const {
        typename M::Gradient gradient = flow->gradient;
        for (int d = 0; d < M::dim; ++d)
            if (const int side = flow->side[static_cast<std::size_t>(d)]; side >= 0)
                gradient(d, d) = walls[static_cast<std::size_t>(side)].speed / flow->length;
        return gradient;
    }
    /// Calls visit(wall, d) for each wall that is a side of the cell along axis d.
    void each_side(auto&& visit) {
        for (int d = 0; flow && d < M::dim; ++d)
            if (const int side = flow->side[static_cast<std::size_t>(d)]; side >= 0)
                visit(walls[static_cast<std::size_t>(side)], d);
    }

    /// Number of contacts, between grains and with walls.
    std::size_t contact_count() const { return contacts.size() + wall_contacts.size(); }
    /// Multiplicity of a body; 1 where nothing is split.
    int copies(std::size_t body) const { return multiplicity.empty() ? 1 : multiplicity[body]; }
    /// Multiplicity of a wall; 1 where nothing is split.
    int wall_copies(std::size_t wall) const { return wall_multiplicity.empty() ? 1 : wall_multiplicity[wall]; }

    /// Memory that a sweep reads and writes [bytes].
    std::size_t bytes() const {
        return bodies.size() * sizeof(Body<M>) + walls.size() * sizeof(WallBody<M>) +
               contact_count() * sizeof(Contact<M>);
    }
};

}}  // namespace nscdd::NSCDD_ABI
