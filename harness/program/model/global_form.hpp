// The contact problem of a step with its bodies, as FCLIB's global form has it.
#pragma once

#include "files/fclib.hpp"
#include "nscdd/reference/assemble.hpp"

namespace nscdd {

// M v = H r + f, u = H^T v + w. v: velocities of the grains that move, each translations, then spins, in the order of
// the simulation; then the speeds of driven walls along their normals. Throws what assemble() throws.
template <class M>
GlobalProblem global_form(ContactProblem<M> problem) {
    using Local = detail::LocalForm<M>;
    detail::refuse_driven_cell(problem);
    detail::refuse_twisting(problem);
    detail::replace_impulses(problem, [](const Contact<M>&) { return M::Impulse::Zero(); });

    std::vector<double> mass, velocity;
    std::vector<int> of_body, of_wall;  // where it begins in v; -1: as prescribed
    for (const Body<M>& body : problem.bodies) {
        of_body.push_back(body.inv_mass > 0 ? static_cast<int>(mass.size()) : -1);
        if (!(body.inv_mass > 0)) continue;
        for (const double inverse : detail::inverse_mass(body)) mass.push_back(1 / inverse);
        velocity.insert(velocity.end(), body.v.begin(), body.v.end());
    }
    for (const WallBody<M>& wall : problem.walls) {
        of_wall.push_back(wall.inv_mass > 0 ? static_cast<int>(mass.size()) : -1);
        if (wall.inv_mass > 0) mass.push_back(1 / wall.inv_mass), velocity.push_back(wall.speed);
    }

    std::vector<Eigen::Triplet<double>> h;
    std::vector<double> w, friction, rolling;
    detail::each_contact(problem, [&](const Contact<M>& c, auto kind) {
        const int column = static_cast<int>(w.size());
        const detail::ContactFrame<M> frame = detail::contact_frame<M>(c.normal);
        typename Local::Vec u = detail::prescribed_velocity(problem, c, frame, kind);
        const auto add = [&](int number, double sign) {
            const auto b = static_cast<std::size_t>(number);
            const auto map = detail::local_map(frame, c, sign);
            if (of_body[b] < 0)
                u += map * problem.bodies[b].v;
            else
                for (int i = 0; i < M::dof; ++i)
                    for (int k = 0; k < Local::size; ++k)
                        if (map(k, i) != 0) h.emplace_back(of_body[b] + i, column + k, map(k, i));
        };
        add(c.i, 1);
        if constexpr (std::is_same_v<decltype(kind), BetweenGrains>)
            add(c.j, -1);
        else if (const auto wall = static_cast<std::size_t>(c.j); of_wall[wall] >= 0)
            h.emplace_back(of_wall[wall], column, -1.0);
        w.insert(w.end(), u.begin(), u.end());
        friction.push_back(detail::friction_of(c));
        if constexpr (M::rolling) rolling.push_back(c.rolling_coefficient);
    });

    GlobalProblem global;
    global.dim = M::dim;
    const Eigen::VectorXd masses = to_vector(mass);
    global.m = Eigen::SparseMatrix<double>(masses.asDiagonal());
    global.f = masses.cwiseProduct(to_vector(velocity));
    global.w = to_vector(w);
    global.friction = to_vector(friction);
    global.rolling = to_vector(rolling);
    global.h.resize(masses.size(), global.w.size());
    global.h.setFromTriplets(h.begin(), h.end());
    return global;
}

}  // namespace nscdd
