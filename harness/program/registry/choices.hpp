// Options that are one of several names.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "nscdd/partition/partition.hpp"
#include "nscdd/subdomain/halo.hpp"

namespace nscdd {

// How the interface problem is solved; (10) of the paper.
enum class Interface { closed_form, factorised };
inline constexpr std::array interface_names{std::pair{"closed-form", Interface::closed_form},
                                            std::pair{"factorised", Interface::factorised}};

inline constexpr std::array multiplicity_names{std::pair{"minimal", Multiplicity::minimal},
                                               std::pair{"predicted", Multiplicity::predicted}};

// How space is dealt to subdomains.
struct PartitionChoice {
    std::optional<std::string> kind;        // of offered_partitions()
    std::vector<int> grid;                  // cells per axis; empty: chosen
    std::optional<double> given_imbalance;  // of a partition that is kept (Partitioner)
    // The kernel's own default is the paper's, a grid; bisection needs fewer iterations on packings of any shape.
    double imbalance() const { return given_imbalance.value_or(detail::default_imbalance); }
    std::string chosen() const { return kind.value_or(grid.empty() ? "bisection" : "grid"); }
};

// How subdomains send each other messages.
enum class Transport { automatic, in_process, mpi };
inline constexpr std::array transport_names{std::pair{"auto", Transport::automatic},
                                            std::pair{"in-process", Transport::in_process},
                                            std::pair{"mpi", Transport::mpi}};

// How processes of one node do; WithinNode of the kernel is known only where MPI is.
enum class NodeTransport { memory, messages };
inline constexpr std::array node_transport_names{std::pair{"memory", NodeTransport::memory},
                                                 std::pair{"messages", NodeTransport::messages}};

// "--max-distance" of max_distance.
inline std::string dashed(std::string name) {
    std::ranges::replace(name, '_', '-');
    return "--" + name;
}

// "gap error" of gap_error.
inline std::string spoken(std::string name) {
    std::ranges::replace(name, '_', ' ');
    return name;
}

std::vector<std::string> names_in(const auto& names) {
    std::vector<std::string> all;
    for (const auto& [name, value] : names) all.emplace_back(name);
    return all;
}

template <class Enum>
std::string name_of(const auto& names, Enum value) {
    return std::ranges::find(names, value, [](const auto& entry) { return entry.second; })->first;
}
template <class Enum>
std::string name_of(const auto& names, const std::optional<Enum>& value) {
    return value ? name_of(names, *value) : "";
}

auto value_of(const auto& names, std::string_view name) {
    return std::ranges::find(names, name, [](const auto& entry) { return std::string_view(entry.first); })->second;
}

}  // namespace nscdd
