// Cost of a sweep and of the residual: ns and bytes per contact, for the four kinds of scene.
//
//   build/bin/nscdd_bench --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
//   NSCDD_BENCH_3D=spheres.h5 NSCDD_BENCH_2D=disks.h5 build/bin/nscdd_bench     on packings of your own
//
// Without packings of your own: close-packed lattices of nearly equal grains, all neighbours of which touch.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <random>

#include "nscdd/nscdd.hpp"
#include "nscdd/solve/nlgs_plain.hpp"
#include "packing.hpp"

using namespace nscdd;

namespace {

template <class M>
std::vector<Grain<M>> lattice(typename M::Vec& box) {
    const int n = M::dim == 3 ? 17 : 70;
    std::mt19937 random(1);
    std::vector<Grain<M>> grains;
    for (int z = 0; z < (M::dim == 3 ? n : 1); ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) {
                typename M::Vec at;  // rows (and layers) shifted by half a spacing
                if constexpr (M::dim == 3)
                    at = {x + 0.5 * ((y + z) % 2), y * 0.8661 + 0.289 * (z % 2), z * 0.8166};
                else
                    at = {x + 0.5 * (y % 2), y * 0.8661};
                // gaps are within what detection takes for a contact, 2e-3 of a radius
                const double radius = 0.5 - 2e-5 * static_cast<double>(random() % 10);
                grains.push_back(
                    make_grain<M>(static_cast<int>(grains.size()), radius, 1.0, at + M::Vec::Constant(0.51)));
            }
    box.setZero();
    for (const auto& g : grains) box = box.cwiseMax(g.position + M::Vec::Constant(0.51));
    return grains;
}

// A contact problem in mid-solution: fifty sweeps into the first step under gravity.
template <class M>
ContactProblem<M> problem() {
    typename M::Vec box;
    std::vector<Grain<M>> grains;
    if (const char* file = std::getenv(M::dim == 3 ? "NSCDD_BENCH_3D" : "NSCDD_BENCH_2D")) {
        const Packing packing = read_packing(file);
        box = Eigen::Map<const typename M::Vec>(packing.box.data());
        for (std::size_t g = 0; g < packing.size(); ++g)
            grains.push_back(make_grain<M>(static_cast<int>(g), packing.radius[g], 1.0,
                                           Eigen::Map<const typename M::Vec>(packing.x.data() + g * M::dim)));
    } else {
        grains = lattice<M>(box);
    }
    SimulationSettings<M> settings;
    settings.gravity[M::dim - 1] = -1;
    settings.h = 0.01;
    settings.materials.set(0, 0, {M::friction ? 0.3 : 0.0, 0.0});
    for (int d = 0; d < M::dim; ++d)
        for (const bool upper : {false, true}) {
            Wall<M>& wall = settings.walls.emplace_back();
            wall.normal = (upper ? -1 : 1) * M::Vec::Unit(d);
            wall.offset = upper ? -box[d] : 0;
        }
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, grains);
    SolveOptions options;
    options.check_every = options.max_iterations = 50;
    simulation.step(by_nlgs<M>(options));
    return simulation.parts()[0].problem;
}

// The problem and its fast form, of all repetitions: they go on where the last one stopped.
template <class M>
struct Loaded {
    ContactProblem<M> problem = ::problem<M>();
    Sweeper<M> sweeper;
    Loaded() { sweeper.load(problem); }
};

template <class M, auto operation>
void per_contact(benchmark::State& state) {
    static Loaded<M> p;
    for (auto _ : state) operation(p);
    const auto contacts = static_cast<double>(p.problem.contact_count());
    using benchmark::Counter;
    state.counters["contacts"] = contacts;
    state.counters["bytes/contact"] = static_cast<double>(p.sweeper.bytes()) / contacts;
    state.counters["s/contact"] = Counter(contacts, Counter::kIsIterationInvariantRate | Counter::kInvert);
}

template <class M>
void fast(Loaded<M>& p) {
    p.sweeper.sweep(p.problem);
}
template <class M>
void scalar(Loaded<M>& p) {
    sweep(p.problem);
}
template <class M>
void plain(Loaded<M>& p) {
    plain_sweep(p.problem);
}
template <class M>
void residual(Loaded<M>& p) {
    benchmark::DoNotOptimize(p.sweeper.residual(p.problem));
}

using Frictional3 = Model<3, Coulomb, KinematicWalls>;
using Frictionless3 = Model<3, Frictionless, KinematicWalls>;
using Frictional2 = Model<2, Coulomb, KinematicWalls>;
using Frictionless2 = Model<2, Frictionless, KinematicWalls>;

#define NSCDD_BENCH_ALL(operation, name)                                                                     \
    BENCHMARK_TEMPLATE(per_contact, Frictional3, operation<Frictional3>)->Name(name "/3D/Coulomb");          \
    BENCHMARK_TEMPLATE(per_contact, Frictionless3, operation<Frictionless3>)->Name(name "/3D/frictionless"); \
    BENCHMARK_TEMPLATE(per_contact, Frictional2, operation<Frictional2>)->Name(name "/2D/Coulomb");          \
    BENCHMARK_TEMPLATE(per_contact, Frictionless2, operation<Frictionless2>)->Name(name "/2D/frictionless");

NSCDD_BENCH_ALL(fast, "sweep")
NSCDD_BENCH_ALL(scalar, "scalar_sweep")
NSCDD_BENCH_ALL(residual, "residual")
BENCHMARK_TEMPLATE(per_contact, Frictional3, plain<Frictional3>)->Name("plain_sweep/3D/Coulomb");

}  // namespace

BENCHMARK_MAIN();
