// Problems for solvers that tests hold against each other, and what makes an answer one.
#pragma once

#include "../small_scenes.hpp"
#include "random_scenes.hpp"

namespace nscdd::test {

// The problem of the scene's next step, without impulses: bodies have V_free.
template <class M>
ContactProblem<M> next_problem(const scenes::Scene<M>& scene) {
    InProcess comm(1);
    Simulation<M> simulation(comm, scene.settings, scene.grains);
    ContactProblem<M> problem;
    simulation.step([&](std::span<Subdomain<M>> parts, Communicator&, PhaseSeconds&) {
        problem = parts[0].problem;
        return nlgs(parts[0].problem, {});
    });
    return problem;
}

// Kinetic energy of the difference over that of the second.
template <class M>
double velocity_difference(const ContactProblem<M>& a, const ContactProblem<M>& b) {
    double difference = 0, total = 0;
    for (std::size_t k = 0; k < a.bodies.size(); ++k) {
        typename M::Velocity mass = M::Velocity::Constant(1 / a.bodies[k].inv_mass);
        if constexpr (M::friction) mass.template tail<M::spins>().setConstant(1 / a.bodies[k].inv_inertia);
        difference += (a.bodies[k].v - b.bodies[k].v).cwiseAbs2().dot(mass);
        total += b.bodies[k].v.cwiseAbs2().dot(mass);
    }
    return std::sqrt(difference / total);
}

struct Statuses {
    int sliding = 0, sticking = 0, open = 0;
};

// Asserts the law at every contact, within `margin` of the largest |u| and |r|; adds to the count of statuses.
template <int dim>
void check_law(const DelassusProblem<dim>& problem, const std::vector<typename DelassusProblem<dim>::Vec>& r,
               double margin, Statuses& count) {
    double largest_u = 0, largest_r = 0;
    for (std::size_t c = 0; c < r.size(); ++c) {
        largest_u = std::max({largest_u, problem.velocity(c, r).norm(), problem.q[c].norm()});
        largest_r = std::max(largest_r, r[c].norm());
    }
    REQUIRE(largest_r > 0);
    const double eps_u = margin * largest_u, eps_r = margin * largest_r;
    for (std::size_t c = 0; c < r.size(); ++c) {
        const auto u = problem.velocity(c, r);
        const auto ut = u.template tail<dim - 1>().eval(), rt = r[c].template tail<dim - 1>().eval();
        const double limit = problem.friction[c] * r[c][0];
        CHECK(u[0] >= -eps_u);
        CHECK(r[c][0] >= 0);
        CHECK(std::min(u[0] / largest_u, r[c][0] / largest_r) <= margin);
        CHECK(rt.norm() <= limit + eps_r);
        CHECK((ut.norm() * rt + limit * ut).norm() <= std::max(eps_u * largest_r, eps_r * largest_u));
        if (r[c][0] <= eps_r)
            ++count.open;
        else
            ++(ut.norm() > eps_u ? count.sliding : count.sticking);
    }
}

// W = H^T H of rank `rank`, blocks full and not diagonal, with an answer: q = H^T v plus velocities that open.
template <int dim>
DelassusProblem<dim> random_problem(Random& random, int contacts, int rank) {
    Eigen::MatrixXd h(rank, contacts * dim);
    for (double& entry : h.reshaped()) entry = uniform(random, -1, 1);
    Eigen::VectorXd v(rank);
    for (double& entry : v) entry = uniform(random, -1, 1);
    const Eigen::MatrixXd w = h.transpose() * h;
    const Eigen::VectorXd q = h.transpose() * v;
    DelassusProblem<dim> problem;
    for (int c = 0; c < contacts; ++c) {
        problem.diagonal.push_back(static_cast<int>(problem.blocks.size()) + c);
        for (int d = 0; d < contacts; ++d) {
            problem.columns.push_back(d);
            problem.blocks.push_back(w.block<dim, dim>(c * dim, d * dim));
        }
        problem.row_begin.push_back(static_cast<int>(problem.blocks.size()));
        typename DelassusProblem<dim>::Vec free = q.segment<dim>(c * dim);
        free[0] += uniform(random, 0, 0.5);
        problem.q.push_back(free);
        problem.friction.push_back(uniform(random, 0.1, 0.8));
    }
    return problem;
}

}  // namespace nscdd::test
