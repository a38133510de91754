// Three units of one program: main(), and twice the same steps, as functions narrow() and wide(), compiled for two
// instruction sets (foreign.cmake). UNIT: the name of the function.
#ifdef UNIT
#include <cmath>

#include <nscdd/nscdd.hpp>

// Ten disks on top of each other, on two subdomains: how far the impulse on the floor is from their weight, relative.
double UNIT() {
    using Model = nscdd::Model<2, nscdd::Frictionless, nscdd::KinematicWalls>;
    constexpr double gravity = 10;
    nscdd::SimulationSettings<Model> settings;
    settings.gravity = {0, -gravity};
    settings.cells = {1, 2};
    settings.walls.resize(1);
    settings.walls[0].normal = {0, 1};
    std::vector<nscdd::Grain<Model>> grains;
    double weight = 0;
    for (int k = 0; k < 10; ++k) {
        grains.push_back(nscdd::make_grain<Model>(k, 0.5, 1.0, {0, 0.5 + k}));
        weight += gravity * grains.back().mass;
    }
    nscdd::InProcess comm(2);
    nscdd::Simulation<Model> simulation(comm, settings, grains);
    nscdd::SolveOptions options{.tolerance = 1e-10};
    options = options.accelerated();
    const auto report = simulation.step(nscdd::by_nscdd<nscdd::Dcs<Model>>(options));
    double on_floor = 0;
    for (const auto& contact : nscdd::gather_contacts(simulation))
        if (contact.j < 0) on_floor += contact.impulse[1];
    return report.solve.converged ? std::abs(on_floor / (weight * settings.h) - 1) : 1;
}
#else
#include <cstdio>

double narrow();
double wide();

int main() {
    bool right = true;
    const auto check = [&right](const char* name, double error) {
        std::printf("%s: impulse on the floor wrong by %.1g\n", name, error);
        right = right && error < 1e-6;
    };
    check("narrow", narrow());
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512cd"))
        check("wide", wide());
    else
        std::puts("wide: skipped, this processor lacks AVX-512");
    check("narrow", narrow());
    return right ? 0 : 1;
}
#endif
