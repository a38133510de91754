#include "files/costs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/error.hpp"
#include "files/replace_file.hpp"

namespace nscdd {

double Costs::seconds(Work kind, double count, double bytes) const {
    const std::vector<CostPoint>& points = units[static_cast<std::size_t>(kind)];
    if (points.empty())
        throw InputError(fmt::format("no cost of {}: calibrate on a scene that has it",
                                     detail::work_names[static_cast<std::size_t>(kind)]));
    const auto above = std::ranges::upper_bound(points, bytes, {}, &CostPoint::bytes);
    if (above == points.begin()) return 1e-9 * count * points.front().ns;
    const CostPoint& low = *(above - 1);
    if (above == points.end()) return 1e-9 * count * low.ns;
    const double share = std::log(bytes / low.bytes) / std::log(above->bytes / low.bytes);
    return 1e-9 * count * (low.ns + share * (above->ns - low.ns));
}

Costs read_costs(const std::string& path) {
    const auto refuse = [&path](const std::string& why) { throw InputError(fmt::format("{}: {}", path, why)); };
    const std::string text = read_file(path);
    const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
    Costs costs;
    try {
        if (json.at("schema") != "nscdd.costs/1") refuse("is no file of costs (schema nscdd.costs/1)");
        costs.model = json.at("model");
        for (std::size_t k = 0; k < detail::work_names.size(); ++k) {
            double last = 0;
            const nlohmann::json& ns = json.at("ns");
            if (may_lack(k) && !ns.contains(detail::work_names[k])) continue;
            for (const nlohmann::json& point : ns.at(detail::work_names[k])) {
                const CostPoint p{point.at("bytes"), point.at("ns")};
                if (!(p.bytes > last && std::isfinite(p.bytes) && p.ns >= 0 && std::isfinite(p.ns)))
                    refuse(fmt::format("ns.{}: bytes must ascend from above 0, and ns must not be negative",
                                       detail::work_names[k]));
                costs.units[k].push_back(p);
                last = p.bytes;
            }
            if (costs.units[k].empty() && !may_lack(k)) refuse(fmt::format("ns.{} is empty", detail::work_names[k]));
        }
    } catch (const nlohmann::json::exception& error) {
        refuse(json.is_discarded() ? "is no JSON" : error.what());
    }
    return costs;
}

void to_json(nlohmann::json& json, const Costs& costs) {
    json["model"] = costs.model;
    for (std::size_t k = 0; k < detail::work_names.size(); ++k) {
        if (costs.units[k].empty() && may_lack(k)) continue;
        json["ns"][detail::work_names[k]] = nlohmann::json::array();
        for (const CostPoint& p : costs.units[k])
            json["ns"][detail::work_names[k]].push_back({{"bytes", p.bytes}, {"ns", p.ns}});
    }
}

}  // namespace nscdd
