// Your own detection and time stepping: fill a ContactProblem, solve it, read velocities and impulses back.
//
// A pyramid of disks rests in a box. Checked: the floor carries its weight, nothing moves.
#include <cmath>
#include <cstdio>
#include <nscdd/nscdd.hpp>

using Model = nscdd::Model<2, nscdd::Coulomb>;

int main() {
    const double radius = 0.5, mass = 2, gravity = 9.81, h = 1e-3;  // [m], [kg], [m/s^2], [s]
    const int base = 12;                                            // disks in the lowest row

    std::vector<Model::Vec> centre;
    for (int row = 0; row < base; ++row)
        for (int k = 0; k + row < base; ++k)
            centre.push_back({(2 * k + row) * radius, radius + row * std::sqrt(3.0) * radius});

    nscdd::ContactProblem<Model> problem;
    problem.h = h;
    for (std::size_t g = 0; g < centre.size(); ++g) {  // velocities of the step without contacts
        nscdd::Body<Model>& body = problem.bodies.emplace_back();
        body.v = {0, -gravity * h, 0};  // two translations [m/s], one spin [rad/s]
        body.inv_mass = 1 / mass;
        body.inv_inertia = 2 / (mass * radius * radius);
    }
    problem.walls.resize(3);  // floor, left and right wall, at rest

    const auto touch = [&](int i, int j, const Model::Vec& normal, double gap, double lever_i, double lever_j) {
        nscdd::Contact<Model> contact;
        contact.i = i;
        contact.j = j;
        contact.normal = normal;                // from j to i
        contact.bias = std::max(gap, 0.0) / h;  // [m/s]: what is left of the gap may close
        contact.lever_i = lever_i;              // [m] from the centre to the contact: to the middle of a gap, or,
        contact.lever_j = lever_j;              // at a wall, to the surface
        contact.friction_coefficient = 0.5;
        return contact;
    };
    const double contact_gap = 1e-3;  // [m]: pairs with a larger gap are no contacts
    for (int i = 0; i < static_cast<int>(centre.size()); ++i) {
        const Model::Vec& at = centre[static_cast<std::size_t>(i)];
        const double gap_to_wall[] = {at[1] - radius, at[0], 2 * (base - 1) * radius - at[0]};
        const Model::Vec into_box[] = {{0, 1}, {1, 0}, {-1, 0}};
        for (int wall = 0; wall < 3; ++wall)
            if (gap_to_wall[wall] < contact_gap)
                problem.wall_contacts.push_back(touch(i, wall, into_box[wall], gap_to_wall[wall], radius, 0));
        for (int j = i + 1; j < static_cast<int>(centre.size()); ++j) {
            const Model::Vec branch = at - centre[static_cast<std::size_t>(j)];
            const double gap = branch.norm() - 2 * radius;
            const double lever = radius + gap / 2;
            if (gap < contact_gap) problem.contacts.push_back(touch(i, j, branch.normalized(), gap, lever, lever));
        }
    }

    const nscdd::SolveReport report = nscdd::nlgs(
        problem, nscdd::SolveOptions{.tolerance = 1e-8, .bounds = {.max_velocity_error = 1e-6}}.accelerated());

    double carried = 0, fastest = 0;
    for (const auto& contact : problem.wall_contacts) carried += contact.r[1];  // on i [N s], in world axes
    for (const auto& body : problem.bodies) fastest = std::max(fastest, body.linear().norm());
    const double weight = static_cast<double>(centre.size()) * mass * gravity * h;
    std::printf("%zu contacts, %d iterations, eta %.1e; the floor carries %.9f of the weight; fastest disk %.1e m/s\n",
                problem.contact_count(), report.iterations, report.residual, carried / weight, fastest);
    return report.converged && std::abs(carried / weight - 1) < 1e-6 && fastest < 1e-5 * gravity * h ? 0 : 1;
}
