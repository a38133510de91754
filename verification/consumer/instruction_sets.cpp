// Three units of one program: main(), and twice the same steps, as functions narrow() and wide(), compiled for two
// instruction sets (foreign.cmake). UNIT: the name of the function.
#ifdef UNIT
#include <algorithm>
#include <cmath>

#include <nscdd/nscdd.hpp>

namespace {

// Ten grains on top of each other: how far the impulse on the floor is from their weight, relative to it.
template <class M>
double error_of(const nscdd::AnyStepSolver<M>& solve, int ranks) {
    constexpr double gravity = 10;
    nscdd::SimulationSettings<M> settings;
    settings.h = 1e-3;
    settings.materials.set(0, 0, {.friction = 0.3});
    settings.gravity = -gravity * M::Vec::UnitY();
    settings.walls.resize(1);
    settings.walls[0].normal = M::Vec::UnitY();
    std::vector<nscdd::Grain<M>> grains;
    double weight = 0;
    for (int k = 0; k < 10; ++k) {
        grains.push_back(nscdd::make_grain<M>(k, 0.5, 1.0, (0.5 + k) * M::Vec::UnitY()));
        weight += gravity * grains.back().mass;
    }
    nscdd::InProcess comm(ranks);
    nscdd::Simulation<M> simulation(comm, settings, grains);
    const auto report = simulation.step(solve);
    double on_floor = 0;
    for (const auto& contact : nscdd::gather_contacts(simulation))
        if (contact.j < 0) on_floor += contact.impulse[1];
    return report.solve.converged ? std::abs(on_floor / (weight * settings.h) - 1) : 1;
}

template <class M>
double largest_error() {
    using namespace nscdd;
    const auto options = SolveOptions{.tolerance = 1e-10}.accelerated();
    // compiled only: what is factorised is in Eigen's dynamic matrices, which are for one instruction set a program
    [[maybe_unused]] const AnyStepSolver<M> factorised = by_nscdd<Ccs<M, Factorised<>>>(options);
    return std::max({error_of<M>(by_nlgs<M>(options), 1), error_of<M>(by_nscdd<Ccs<M, ClosedForm>>(options), 2),
                     error_of<M>(by_nscdd<Dcs<M, ClosedForm>>(options), 2)});
}

}  // namespace

double UNIT() {
    using namespace nscdd;
    return std::max(largest_error<Model<2, Coulomb>>(), largest_error<Model<3, Coulomb>>());
}
#else
#include <cstdio>

double narrow();
double wide();

int main() {
    const double errors[] = {narrow(), wide(), narrow(), wide()};
    std::printf("impulse on the floor wrong by %.1g, %.1g, %.1g, %.1g\n", errors[0], errors[1], errors[2], errors[3]);
    for (const double error : errors)
        if (!(error < 1e-6)) return 1;
    return 0;
}
#endif
