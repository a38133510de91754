// What counted work costs: ns a unit by kind and by the size of the data, as `nscdd calibrate` measured it.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"

namespace nscdd {

struct CostPoint {
    double bytes, ns;
};

struct Costs {
    std::string model;  // of the scene that was measured, e.g. 3D Coulomb
    std::array<std::vector<CostPoint>, detail::work_names.size()>
        units;  // by Work; by ascending bytes, at least one but for kinds that may_lack()

    // Throws InputError where no cost of this kind is known. Between two points the cost of a unit is linear in the
    // logarithm of the bytes; beyond the first and last point it is theirs.
    double seconds(Work kind, double count, double bytes) const;
};

// Whether a file may be without costs of this kind: not all scenes have driven walls, and messages cost what the
// platform says.
constexpr bool may_lack(std::size_t kind) {
    return kind == static_cast<std::size_t>(Work::driven) || kind >= static_cast<std::size_t>(Work::message);
}

// Throws InputError.
Costs read_costs(const std::string& path);

void to_json(nlohmann::json& json, const Costs& costs);  // the keys model and ns

}  // namespace nscdd
