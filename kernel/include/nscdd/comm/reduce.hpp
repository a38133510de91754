/// @file
/// Sums and largest values over all ranks, by the names of a struct's members instead of places in a buffer.
/// ```
/// struct Survey {
///     double grains = 0, speed = 0;
///     auto summed() { return std::tie(grains); }
///     auto largest() { return std::tie(speed); }
/// };
/// const Survey all = nscdd::reduce<Survey>(comm, [&](std::size_t k) { return of_subdomain(k); });
/// ```
#pragma once

#include <concepts>
#include <tuple>

#include "nscdd/comm/communicator.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// A struct whose members are combined over ranks. They are doubles, or Eigen objects of fixed size.
template <class T>
concept Reducible = requires(T t) {
    std::tuple_size<decltype(t.summed())>::value;
    std::tuple_size<decltype(t.largest())>::value;
};

inline std::span<double> numbers_of(double& x) { return {&x, 1}; }
template <class Derived>
std::span<double> numbers_of(Eigen::PlainObjectBase<Derived>& x) {
    return {x.data(), static_cast<std::size_t>(x.size())};
}

/// Calls visit(numbers) for each member of a std::tie, as a span of doubles.
inline void each_member(auto&& members, auto&& visit) {
    std::apply([&](auto&... member) { (visit(numbers_of(member)), ...); }, members);
}

/// All numbers of a Reducible, the summed ones first.
template <Reducible T>
Buffer numbers(T value) {
    Buffer out;
    const auto put = [&out](std::span<double> x) {
        for (const double number : x) out.push_back(number);
    };
    each_member(value.summed(), put);
    each_member(value.largest(), put);
    return out;
}

}  // namespace detail

/// Combines the structs that task(k) returns for each hosted rank, over all ranks. The bits are the same on each rank.
/// Tasks run at the same time, as those of each_rank(). Collective.
template <detail::Reducible T>
T reduce(Communicator& comm, auto&& task) {
    const Turn::Hold hold(comm.turn(), "reduce");  // until the sums are read
    T total{};
    std::size_t added = 0;
    detail::each_member(total.summed(), [&added](std::span<double> x) { added += x.size(); });
    const std::span<const double> all =
        reduce(comm, added, [&task](std::size_t k) { return detail::numbers<T>(task(k)); });
    const double* from = all.data();
    const auto take = [&from](std::span<double> x) {
        for (double& number : x) number = *from++;
    };
    detail::each_member(total.summed(), take);
    detail::each_member(total.largest(), take);
    return total;
}

}}  // namespace nscdd::NSCDD_ABI
