// What the benchmarks share: scenes in mid-solution, and what is counted of an operation.
#pragma once

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <string>

#include "files/packing.hpp"
#include "nscdd/core/rolling.hpp"
#include "nscdd/reference.hpp"

namespace nscdd::bench {

// Bytes per second of a[k] = b[k] + s c[k] on arrays that no cache holds, 24 bytes an element, best of five, one
// thread: McCalpin's STREAM triad.
inline double stream_bandwidth() {
    static const double measured = [] {
        constexpr std::size_t n = 8 << 20;
        std::vector<double> a(n, 1.0), b(n, 2.0), c(n, 3.0);
        double best = 0;
        for (int repeat = 0; repeat < 5; ++repeat) {
            const auto began = std::chrono::steady_clock::now();
            for (std::size_t k = 0; k < n; ++k) a[k] = b[k] + 0.5 * c[k];
            benchmark::DoNotOptimize(a.data());
            benchmark::ClobberMemory();
            const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
            best = std::max(best, 24.0 * n / took.count());
        }
        return best;
    }();
    return measured;
}

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

// Scene of lattices, or of the packings named by NSCDD_BENCH_3D and NSCDD_BENCH_2D, at rest under gravity.
template <class M>
SimulationSettings<M> scene(std::vector<Grain<M>>& grains) {
    typename M::Vec box;
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
    typename M::Law::Pairing pairing;
    if constexpr (M::friction) pairing.friction = 0.3;
    if constexpr (M::rolling) pairing.rolling = 0.02, pairing.twisting = 0.01;  // of radii of 0.5
    settings.materials.set(0, 0, pairing);
    for (int d = 0; d < M::dim; ++d)
        for (const bool upper : {false, true}) {
            Wall<M>& wall = settings.walls.emplace_back();
            wall.normal = (upper ? -1 : 1) * M::Vec::Unit(d);
            wall.offset = upper ? -box[d] : 0;
        }
    return settings;
}

// Fifty iterations, of Alg. 1 if there are several subdomains.
inline SolveOptions fifty() {
    SolveOptions options;
    options.check_every = options.max_iterations = 50;
    return options;
}

// Runs the operation and counts: seconds a unit, such as a contact, bytes a unit, and the share of the time in which
// STREAM would move these bytes. A share above one: they stay in a cache.
inline void per(const std::string& unit, benchmark::State& state, double units, double bytes, auto&& operation) {
    const double bandwidth = stream_bandwidth();
    const auto began = std::chrono::steady_clock::now();
    for (auto _ : state) operation();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    using benchmark::Counter;
    state.counters[unit + "s"] = units;
    state.counters["bytes/" + unit] = bytes / units;
    state.counters["of STREAM"] = bytes / bandwidth / (took.count() / static_cast<double>(state.iterations()));
    state.counters["s/" + unit] = Counter(units, Counter::kIsIterationInvariantRate | Counter::kInvert);
}
inline void per_contact(benchmark::State& state, double contacts, double bytes, auto&& operation) {
    per("contact", state, contacts, bytes, operation);
}

using Frictional3 = Model<3, Coulomb>;
using Rolling3 = Model<3, Rolling>;
using Rolling2 = Model<2, Rolling>;
using Frictionless3 = Model<3, Frictionless>;
using Frictional2 = Model<2, Coulomb>;
using Frictionless2 = Model<2, Frictionless>;

#define NSCDD_BENCH_ALL(function, name)                                         \
    BENCHMARK_TEMPLATE(function, Frictional3)->Name(name "/3D/Coulomb");        \
    BENCHMARK_TEMPLATE(function, Frictionless3)->Name(name "/3D/frictionless"); \
    BENCHMARK_TEMPLATE(function, Frictional2)->Name(name "/2D/Coulomb");        \
    BENCHMARK_TEMPLATE(function, Frictionless2)->Name(name "/2D/frictionless");

}  // namespace nscdd::bench
