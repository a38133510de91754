// Cost of a sweep, of both parts of the test of convergence, and of the fast form, for the four kinds of scene; of a
// sweep also in the plain form, with W stored, and where contacts resist rolling.
//
//   build/bin/nscdd_bench --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
//   NSCDD_BENCH_3D=spheres.h5 NSCDD_BENCH_2D=disks.h5 build/bin/nscdd_bench     on packings of your own
//   build/bin/nscdd_bench --benchmark_filter=detection                          some alone
//
// Without packings of your own: close-packed lattices of nearly equal grains, all neighbours of which touch.
#include "bench_scene.hpp"
#include "nscdd/plain/sweep.hpp"

using namespace nscdd;
using namespace nscdd::bench;

namespace {

// A contact problem in mid-solution and its fast form, of all repetitions: they go on where the last one stopped. After
// forty steps, when most contacts carry: open ones cost the fast sweep little, and the scalar one less than others.
template <class M>
struct Loaded {
    ContactProblem<M> problem;
    Sweeper<M> sweeper;
    Loaded() {
        std::vector<Grain<M>> grains;
        const SimulationSettings<M> settings = scene<M>(grains);
        InProcess comm(1);
        Simulation<M> simulation(comm, settings, grains);
        for (int step = 0; step < 40; ++step) simulation.step(by_nlgs<M>(fifty()));
        problem = simulation.parts()[0].problem;
        sweeper.load(problem);
        prepare_contacts(problem);  // for the scalar sweep
    }
    static Loaded& shared() {
        static Loaded loaded;
        return loaded;
    }
    double contacts() const { return static_cast<double>(problem.contact_count()); }
    double open() const {
        double count = 0;
        for (const auto* contacts : {&problem.contacts, &problem.wall_contacts})
            for (const auto& c : *contacts) count += c.r.isZero(0);
        return count / contacts();
    }
};

template <class M>
void fast(benchmark::State& state) {
    auto& p = Loaded<M>::shared();
    per_contact(state, p.contacts(), double(p.sweeper.bytes()), [&] { p.sweeper.sweep(p.problem); });
    p.sweeper.store(p.problem);
    state.counters["open"] = p.open();
}
template <class M>
void scalar(benchmark::State& state) {
    auto& p = Loaded<M>::shared();
    per_contact(state, p.contacts(), double(p.problem.bytes()), [&] { sweep(p.problem); });
}
template <class M>
void plain(benchmark::State& state) {
    auto& p = Loaded<M>::shared();
    per_contact(state, p.contacts(), double(p.problem.bytes()), [&] { plain::sweep(p.problem); });
}
template <class M>
void residual(benchmark::State& state) {
    auto& p = Loaded<M>::shared();
    per_contact(state, p.contacts(), double(p.sweeper.bytes()),
                [&] { benchmark::DoNotOptimize(p.sweeper.residual(p.problem)); });
}
// The second part of the test, of a scene whose components are known.
template <class M>
void distance(benchmark::State& state) {
    auto& p = Loaded<M>::shared();
    p.sweeper.store(p.problem);
    const ResidualParts residual = p.sweeper.residual(p.problem);
    detail::DistanceSums<M> sums;
    sums.begin(p.problem, p.sweeper.free_velocities(p.problem));
    per_contact(state, p.contacts(), double(p.problem.bytes()), [&] {
        benchmark::DoNotOptimize(detail::estimate_distance<M>(p.problem, sums, residual, nullptr).worst);
    });
}
template <class M>
void components(benchmark::State& state) {
    auto& p = Loaded<M>::shared();
    per_contact(state, p.contacts(), double(p.problem.bytes()),
                [&] { benchmark::DoNotOptimize(detail::Components<M>(p.problem).count()); });
}
template <class M>
void stored(benchmark::State& state) {
    static const DelassusProblem<M::dim> problem = assemble(Loaded<M>::shared().problem);
    static auto r = local_impulses(Loaded<M>::shared().problem);
    per_contact(state, Loaded<M>::shared().contacts(), double(problem.bytes()),
                [&] { detail::block_sweep(problem, r); });
}
// The fast form made from the problem, once a step, and back.
template <class M>
void loading(benchmark::State& state) {
    auto& p = Loaded<M>::shared();
    per_contact(state, p.contacts(), double(p.problem.bytes() + p.sweeper.bytes()), [&] { p.sweeper.load(p.problem); });
}
template <class M>
void storing(benchmark::State& state) {
    auto& p = Loaded<M>::shared();
    per_contact(state, p.contacts(), double(p.problem.bytes() + p.sweeper.bytes()),
                [&] { p.sweeper.store(p.problem); });
}

NSCDD_BENCH_ALL(fast, "sweep")
BENCHMARK_TEMPLATE(fast, Rolling3)->Name("sweep/3D/rolling");
BENCHMARK_TEMPLATE(fast, Rolling2)->Name("sweep/2D/rolling");
NSCDD_BENCH_ALL(scalar, "scalar_sweep")
NSCDD_BENCH_ALL(residual, "residual")
NSCDD_BENCH_ALL(distance, "distance")
NSCDD_BENCH_ALL(components, "components")
NSCDD_BENCH_ALL(loading, "loading")
NSCDD_BENCH_ALL(storing, "storing")
BENCHMARK_TEMPLATE(plain, Frictional3)->Name("plain_sweep/3D/Coulomb");
BENCHMARK_TEMPLATE(stored, Frictional3)->Name("stored_W_sweep/3D/Coulomb");
BENCHMARK_TEMPLATE(stored, Frictional2)->Name("stored_W_sweep/2D/Coulomb");

}  // namespace

BENCHMARK_MAIN();
