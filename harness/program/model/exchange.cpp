#include "model/exchange.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/counter_random.hpp"

namespace nscdd {

namespace {

Schedule read_schedule(TomlTable& table) {
    Schedule when;
    when.from = table.number("from", non_negative, 0.0);
    if (table.has("until")) when.until = table.number("until", non_negative);
    if (!(when.until >= when.from)) table.fail("until", "must not be before from");
    if (table.has("rate")) when.rate = table.number("rate", positive);
    if (!table.has("times")) return when;
    if (when.rate) table.fail("times", "are given, and a rate too");
    const Eigen::VectorXd times = table.vector("times", table.length("times"));
    when.times.assign(times.begin(), times.end());
    for (std::size_t k = 0; k < when.times.size(); ++k)
        if (!(when.times[k] >= (k == 0 ? 0 : when.times[k - 1]))) table.fail("times", "must be >= 0 and ascend");
    return when;
}

std::string numbers(const Eigen::VectorXd& vector) { return fmt::format("{}", fmt::join(vector, " ")); }

std::string text_of(const Region& region) {
    return region.is_box() ? numbers(region.low) + " to " + numbers(region.high)
                           : numbers(region.normal) + " through " + numbers(region.through);
}

std::string text_of(const Schedule& when) {
    return fmt::format("{} {} {} {}", when.from, when.until, when.rate.value_or(0), fmt::join(when.times, " "));
}

}  // namespace

double Schedule::due(double time) const {
    return time < from ? 0 : std::floor(*rate * (std::min(time, until) - from) * (1 + 1e-12)) + 1;
}

double SceneRemoval::allowed(const StepTimes& step) const {
    constexpr double all = std::numeric_limits<double>::infinity();
    if (when.rate) return when.due(step.now) - when.due(step.before);
    if (when.times.empty()) return when.covers(step.now) ? all : 0;
    // each time is of the step that begins nearest: between it and the next one there is one number
    const double begin = 0.5 * (step.before + step.now), end = 0.5 * (step.now + step.next);
    const auto here = [&](double time) { return begin < time && time <= end && when.covers(time); };
    return std::ranges::any_of(when.times, here) ? all : 0;
}

double SceneInsertion::due(double time) const {
    constexpr double no_end = std::numeric_limits<double>::infinity();
    if (time < when.from) return 0;
    if (when.rate) return std::min(when.due(time), count ? double(*count) : no_end);
    if (when.times.empty()) return *count;
    return *count * double(std::ranges::upper_bound(when.times, std::min(time, when.until)) - when.times.begin());
}

double SceneInsertion::radius_of(std::uint64_t entry, std::uint64_t number, int dim) const {
    if (!radii) return radius;
    return radii->radius_at(random_number({static_cast<std::uint64_t>(seed), entry, number}), dim);
}

Eigen::VectorXd SceneInsertion::place_of(std::uint64_t entry, std::uint64_t number, std::uint64_t step,
                                         std::uint64_t trial, double grain_radius) const {
    Eigen::VectorXd x = box.low.array() + grain_radius;
    for (Eigen::Index d = 0; d < x.size(); ++d)
        x[d] += (box.high[d] - box.low[d] - 2 * grain_radius) *
                random_number({static_cast<std::uint64_t>(seed), entry, number, step, trial, std::uint64_t(d)});
    return x;
}

SceneRemoval read_removal(TomlTable& table, int dim) {
    SceneRemoval removal{read_region(table, dim), read_schedule(table)};
    table.finish();
    return removal;
}

SceneInsertion read_insertion(TomlTable& table, int dim) {
    SceneInsertion insertion;
    insertion.box = read_box(table, dim);
    insertion.velocity = table.vector("velocity", dim, Eigen::VectorXd::Zero(dim));
    insertion.when = read_schedule(table);
    insertion.seed = table.integer("seed", detail::OptionRange{0}, 1);
    if (table.has("count")) insertion.count = table.integer("count", detail::OptionRange{1});
    if (!insertion.count && !insertion.when.rate)
        table.fail("", insertion.when.times.empty() ? "needs a rate, or a count" : "needs the count of each time");
    if (table.has("radius") == table.has("radii")) table.fail("", "needs radius or radii");
    if (auto radii = table.table("radii"))
        insertion.radii = read_radii(*radii, dim);
    else
        insertion.radius = table.number("radius", positive);
    if (!((insertion.box.high - insertion.box.low).minCoeff() > 2 * insertion.largest_radius()))
        table.fail("high", "leaves no room for the largest grain");
    table.finish();
    return insertion;
}

bool SceneExchange::all_inserted(const std::vector<double>& inserted) const {
    for (std::size_t e = 0; e < insertions.size(); ++e)
        if (inserted[e] < insertions[e].total()) return false;
    return true;
}

std::string SceneExchange::text() const {
    std::string text;
    for (const SceneRemoval& removal : removals)
        text += fmt::format(" remove {} {}", text_of(removal.region), text_of(removal.when));
    for (const SceneInsertion& insertion : insertions) {
        text += fmt::format(" insert {} {} {} {} {} {} {}", text_of(insertion.box), text_of(insertion.when),
                            insertion.material, insertion.radius, numbers(insertion.velocity),
                            insertion.count.value_or(0), insertion.seed);
        if (const auto& radii = insertion.radii)
            text += fmt::format(" {} {} {} {} {} {} {} {}", int(radii->kind), radii->by_mass, radii->least,
                                radii->largest, radii->median, radii->deviation, fmt::join(radii->radii, " "),
                                fmt::join(radii->fractions, " "));
    }
    return text;
}

}  // namespace nscdd
