// Ten balls drop on a floor, on two subdomains: the program of README.md and of page 9 of the manual.
#include <nscdd/nscdd.hpp>

#include <cstdio>

using Model = nscdd::Model<3, nscdd::Coulomb>;  // spheres with friction

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
    nscdd::InProcess comm(2);  // two subdomains
    nscdd::Simulation<Model> simulation(comm, settings, grains);
    const auto solve = nscdd::by_nscdd<nscdd::Dcs<Model>>(nscdd::SolveOptions{}.accelerated());
    for (int step = 1; step <= 1000; ++step) {
        const nscdd::StepReport report = simulation.step(solve);
        if (!report.solve.converged) return 1;
        if (step % 250 == 0)
            std::printf("step %4d: %2.0f contacts, %3d iterations, energy %.0f J\n", step, report.contacts,
                        report.solve.iterations, nscdd::measure(simulation).kinetic_energy);
    }
}
