// Uses the kernel both ways: the solver alone on a contact problem of one's own, and whole steps on two subdomains.
#include <cmath>
#include <cstdio>

#include <nscdd/nscdd.hpp>

int pairs_in_the_tree_of_six();  // second.cpp

namespace {

using Model = nscdd::Model<2, nscdd::Frictionless>;

constexpr double mass = 2.0, gravity = 9.81, h = 1e-3;

bool is(const char* what, double value, double expected) {
    std::printf("%s: %.12g, exact %.12g\n", what, value, expected);
    return std::abs(value - expected) <= 1e-8 * expected;
}

// Two disks on top of each other on a floor, each with the velocity -g h that it would have without contacts.
bool solver_alone() {
    nscdd::ContactProblem<Model> problem;
    problem.h = h;
    problem.bodies.resize(2);
    problem.walls.resize(1);
    for (auto& body : problem.bodies) {
        body.inv_mass = 1 / mass;
        body.v[1] = -gravity * h;
    }
    nscdd::Contact<Model> contact;
    contact.normal = {0, 1};  // from j to i
    contact.i = 1;
    contact.j = 0;
    problem.contacts.push_back(contact);
    contact.i = 0;
    problem.wall_contacts.push_back(contact);
    const nscdd::SolveReport report = nscdd::nlgs(problem, {.tolerance = 1e-12});
    const bool right = is("impulse between the disks", problem.contacts[0].r[0], mass * gravity * h) &&
                       is("impulse on the floor", problem.wall_contacts[0].r[0], 2 * mass * gravity * h);
    return report.converged && right;
}

// A column of four on two subdomains: the floor carries all of it.
bool two_subdomains() {
    nscdd::SimulationSettings<Model> settings;
    settings.h = h;
    settings.gravity = {0, -gravity};
    settings.partition = nscdd::by_grid<Model>({1, 2});
    settings.walls.resize(1);
    settings.walls[0].normal = {0, 1};
    std::vector<nscdd::Grain<Model>> grains;
    for (int k = 0; k < 4; ++k) {
        grains.push_back(nscdd::make_grain<Model>(k, 0.5, 1.0, {0, 0.5 + k}));
        grains.back().mass = mass;
    }
    nscdd::InProcess comm(2);
    nscdd::Simulation<Model> simulation(comm, settings, grains);
    const nscdd::StepReport report = simulation.step(nscdd::by_nscdd<nscdd::Dcs<Model>>({.tolerance = 1e-12}));
    double on_floor = 0;
    for (const auto& contact : nscdd::gather_contacts(simulation))
        if (contact.j < 0) on_floor += contact.impulse[1];
    return report.solve.converged && report.interface_grains == 1 &&
           is("impulse under the column", on_floor, 4 * mass * gravity * h);
}

}  // namespace

int main() { return solver_alone() && two_subdomains() && pairs_in_the_tree_of_six() == 4 ? 0 : 1; }
