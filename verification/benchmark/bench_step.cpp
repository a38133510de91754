// Cost of what a step does besides sweeps: detection, advance, and on 8 subdomains gluing with its messages.
#include "bench_scene.hpp"

using namespace nscdd;
using namespace nscdd::bench;

namespace {

template <class T>
double size_of(const std::vector<T>& v) {
    return static_cast<double>(v.size() * sizeof(T));
}

// Subdomains after a step, their copies glued.
template <class M, int subdomains>
struct Stepped {
    std::vector<Grain<M>> grains;
    SimulationSettings<M> settings = scene<M>(grains);
    InProcess comm{subdomains};
    std::vector<Subdomain<M>> parts;
    double contacts = 0;
    typename M::Vec low = grains.front().position, high = low;

    Stepped() {
        Simulation<M> simulation(comm, settings, grains);
        simulation.step(by_nscdd<Dcs<M>>(fifty()));
        parts = simulation.parts();
        for (const auto& part : parts) contacts += static_cast<double>(part.problem.contact_count());
        for (const auto& g : grains) low = low.cwiseMin(g.position), high = high.cwiseMax(g.position);
    }
    static Stepped& shared() {
        static Stepped stepped;
        return stepped;
    }
    // What detection reads and writes of each subdomain.
    double candidate_bytes() const {
        double bytes = 0;
        for (const auto& part : parts) bytes += size_of(part.grains) + size_of(part.pairs) + size_of(part.wall_pairs);
        return bytes;
    }
};

template <class M>
void broad_phase(benchmark::State& state) {
    auto& s = Stepped<M, 1>::shared();
    const Partition<M> grid = detail::Grid<M>(detail::choose_cells<M>(1, s.high - s.low), s.low, s.high);
    double largest = 0;
    for (const auto& g : s.grains) largest = std::max(largest, g.radius);
    per_contact(state, s.contacts, s.candidate_bytes(),
                [&] { detail::repartition<M>(s.parts, s.comm, grid, s.settings.walls, 0.05 * largest, largest); });
}
template <class M>
void narrow_phase(benchmark::State& state) {
    auto& s = Stepped<M, 1>::shared();
    const ContactProblem<M>& problem = s.parts[0].problem;
    per("candidate", state, double(s.parts[0].pairs.size() + s.parts[0].wall_pairs.size()),
        s.candidate_bytes() + size_of(problem.contacts) + size_of(problem.wall_contacts), [&] {
            detail::detect_contacts<M>(s.parts[0], s.settings.walls, s.settings.materials, s.settings.h,
                                       {.least = 2e-3});
        });
}
// The advance of a step whose solver does nothing, of grains at rest: its time is taken within the step.
template <class M>
void advance(benchmark::State& state) {
    std::vector<Grain<M>> grains;
    SimulationSettings<M> settings = scene<M>(grains);
    settings.gravity.setZero();
    InProcess comm(1);
    Simulation<M> simulation(comm, settings, grains);
    for (auto _ : state) {
        const double before = simulation.seconds().advance.own;
        simulation.step([](auto&&...) { return SolveReport{}; });
        state.SetIterationTime(simulation.seconds().advance.own - before);
    }
    using benchmark::Counter;
    const auto count = static_cast<double>(grains.size());
    state.counters["grains"] = count;
    state.counters["s/grain"] = Counter(count, Counter::kIsIterationInvariantRate | Counter::kInvert);
}

// One gluing: velocities packed, exchanged in-process, averaged, unpacked.
template <class M, class Scheme>
void gluing(benchmark::State& state) {
    auto& s = Stepped<M, 8>::shared();
    Scheme scheme;
    for (auto& part : s.parts) part.sweeper.load(part.problem);
    scheme.setup(s.parts, s.comm);
    const double before = s.comm.traffic().bytes;
    detail::glue<M>(scheme, s.parts, s.comm);
    const double bytes = s.comm.traffic().bytes - before;
    per_contact(state, s.contacts, bytes, [&] { detail::glue<M>(scheme, s.parts, s.comm); });
}
template <class M>
void dcs(benchmark::State& state) {
    gluing<M, Dcs<M>>(state);
}
template <class M>
void ccs(benchmark::State& state) {
    gluing<M, Ccs<M>>(state);
}
NSCDD_BENCH_ALL(broad_phase, "broad phase")
NSCDD_BENCH_ALL(narrow_phase, "narrow phase")
BENCHMARK_TEMPLATE(advance, Frictional3)->Name("advance/3D/Coulomb")->UseManualTime();
BENCHMARK_TEMPLATE(advance, Frictional2)->Name("advance/2D/Coulomb")->UseManualTime();
NSCDD_BENCH_ALL(dcs, "gluing/dcs")
NSCDD_BENCH_ALL(ccs, "gluing/ccs")

}  // namespace
