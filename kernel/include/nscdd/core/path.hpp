#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "nscdd/core/model.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// The way that a wall or an obstacle has gone since time 0, as a function of time: from [s] to [m]. Any function will
/// do that is finite and 0 at 0; it is called on every process and must give all the same. Empty: there is none.
template <class M>
using Path = std::function<typename M::Vec(double)>;

}  // namespace detail

/// A path at a steady velocity [m/s].
template <class M>
detail::Path<M> steady(typename M::Vec velocity) {
    return [=](double time) -> typename M::Vec { return time * velocity; };
}

/// A harmonic path: `amplitude` (sin(2 pi frequency t + phase) - sin phase). amplitude [m], frequency [1/s], phase
/// [rad].
template <class M>
detail::Path<M> oscillation(typename M::Vec amplitude, double frequency, double phase = 0) {
    return [=](double time) -> typename M::Vec {
        return (std::sin(2 * std::numbers::pi * frequency * time + phase) - std::sin(phase)) * amplitude;
    };
}

/// A path straight from one place to the next: at times[k] [s] it is at places[k] [m], before the first and after the
/// last it rests. Places count from that of time 0. Throws std::invalid_argument unless times ascend and are as many as
/// places, one at least.
template <class M>
detail::Path<M> along_table(std::vector<double> times, std::vector<typename M::Vec> places) {
    if (times.empty() || times.size() != places.size() ||
        std::adjacent_find(times.begin(), times.end(), [](double a, double b) { return !(a < b); }) != times.end())
        throw std::invalid_argument("along_table: times must ascend, and each must have a place");
    struct Table {
        std::vector<double> times;
        std::vector<typename M::Vec> places;
        typename M::Vec at(double time) const {
            const auto after = std::upper_bound(times.begin(), times.end(), time);
            if (after == times.begin()) return places.front();
            if (after == times.end()) return places.back();
            const auto k = static_cast<std::size_t>(after - times.begin());
            return places[k - 1] + (time - times[k - 1]) / (times[k] - times[k - 1]) * (places[k] - places[k - 1]);
        }
    };
    const auto table = std::make_shared<const Table>(Table{std::move(times), std::move(places)});
    return [table, first = table->at(0)](double time) -> typename M::Vec { return table->at(time) - first; };
}

}}  // namespace nscdd::NSCDD_ABI
