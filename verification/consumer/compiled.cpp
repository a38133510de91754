// Ten balls on two subdomains, by the kernel that is compiled already.
#include <cstdio>

#include <nscdd/compiled.hpp>

using Model = nscdd::compiled::Spheres;

int main() {
    std::vector<nscdd::Grain<Model>> grains;
    for (int k = 0; k < 10; ++k) grains.push_back(nscdd::make_grain<Model>(k, 0.5, 2500.0, {0, 0, 0.5 + 1.1 * k}));
    nscdd::SimulationSettings<Model> settings;
    settings.h = 1e-3;
    settings.gravity = {0, 0, -9.81};
    settings.materials.set(0, 0, {.friction = 0.3, .restitution = 0});
    nscdd::Wall<Model> floor;
    floor.normal = {0, 0, 1};
    settings.walls.push_back(floor);
    nscdd::InProcess comm(2);
    nscdd::Simulation<Model> simulation(comm, settings, grains);
    const auto solve = nscdd::by_nscdd<nscdd::Dcs<Model>>(nscdd::SolveOptions{}.accelerated());
    nscdd::StepReport report;
    for (int step = 1; step <= 1000; ++step) report = simulation.step(solve);
    std::printf("%.0f contacts, energy %.0f J\n", report.contacts, nscdd::measure(simulation).kinetic_energy);
    return report.solve.converged && report.contacts == 10 ? 0 : 1;
}
