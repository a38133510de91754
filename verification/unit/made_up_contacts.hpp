// A contact problem of a model, without a scene: bodies of any mass and spin that touch each other and walls.
#pragma once

#include "random_scenes.hpp"

namespace nscdd::test {

// Six bodies, of which the last is fixed, a wall that moves as prescribed and one that a force drives, and 12 contacts
// along random normals, which need not fit the places of any grains. Velocities are consistent with the impulses.
template <class M>
ContactProblem<M> made_up_contacts(Random& random) {
    ContactProblem<M> problem;
    problem.h = 0.01;
    for (int b = 0; b < 6; ++b) {
        Body<M>& body = problem.bodies.emplace_back();
        body.v = random_vector<typename M::Velocity>(random);
        if (b < 5) body.inv_mass = uniform(random, 0.5, 2);
        if constexpr (M::friction)
            if (b < 5) body.inv_inertia = uniform(random, 0.5, 4);
    }
    for (const double inverse : {0.0, 0.7}) {
        WallBody<M>& wall = problem.walls.emplace_back();
        wall.prescribed = random_vector<typename M::Vec>(random);
        wall.inv_mass = inverse;
        wall.speed = inverse > 0 ? uniform(random, -1, 1) : 0;
    }
    for (int k = 0; k < 12; ++k) {
        const bool wall = k < 5;
        Contact<M>& c = (wall ? problem.wall_contacts : problem.contacts).emplace_back();
        c.i = k % 5, c.j = wall ? k % 2 : k % 5 + 1;
        c.normal = random_unit<M>(random), c.bias = uniform(random, 0, 1);
        c.r = random_vector<typename M::Impulse>(random);
        if constexpr (M::friction) {
            c.lever_i = uniform(random, 0.1, 1), c.lever_j = wall ? 0 : uniform(random, 0.1, 1);
            c.friction_coefficient = uniform(random, 0, 1);
        }
        if constexpr (M::rolling) c.rolling_coefficient = uniform(random, 0, 0.1);
        if constexpr (M::rolling && M::dim == 3)  // nothing resists twisting
            c.r.template tail<3>() -= detail::couple_of<M>(c.r).dot(c.normal) * c.normal;
    }
    return problem;
}

}  // namespace nscdd::test
