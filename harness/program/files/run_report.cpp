#include "files/run_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace nscdd {
namespace {

using nlohmann::json;

constexpr std::int64_t most = std::numeric_limits<int>::max();

// Typed reads of one object that complain with file and key.
class JsonObject {
  public:
    JsonObject(const std::string& file, std::string inside, const json& object)
        : file_(file), inside_(std::move(inside)), object_(object) {
        if (!object.is_object()) throw InputError(fmt::format("{}: {}must be an object", file_, inside_));
    }

    bool has(const char* key) const { return object_.contains(key); }
    // The key, or its name in files of earlier programs where only that is there.
    const char* either(const char* key, const char* earlier) const { return !has(key) && has(earlier) ? earlier : key; }

    std::string text(const char* key) const {
        const json& value = at(key);
        if (!value.is_string() || value.get_ref<const std::string&>().empty()) fail(key, "a string", value);
        return value.get<std::string>();
    }

    std::int64_t integer(const char* key, std::int64_t low, std::int64_t high) const {
        const json& value = at(key);
        const bool fits = value.is_number_integer() &&
                          (!value.is_number_unsigned() || value.get<std::uint64_t>() <= std::uint64_t(high));
        if (!fits || value.get<std::int64_t>() < low || value.get<std::int64_t>() > high)
            fail(key, fmt::format("an integer in [{}, {}]", low, high), value);
        return value.get<std::int64_t>();
    }

    bool truth(const char* key) const {
        const json& value = at(key);
        if (!value.is_boolean()) fail(key, "true or false", value);
        return value.get<bool>();
    }

    double number(const char* key) const { return number(key, at(key)); }

    double non_negative(const char* key) const {
        const double value = number(key);
        if (value < 0) fail(key, "a number >= 0", at(key));
        return value;
    }

    // An array of `size` numbers; -1: of any size. Numbers are >= 0, or null, which reads as NaN, where `null_allowed`.
    std::vector<double> numbers(const char* key, std::int64_t size, bool null_allowed = false) const {
        const json& array = at(key);
        if (!array.is_array() || (size >= 0 && array.size() != static_cast<std::size_t>(size)))
            fail(key, size >= 0 ? fmt::format("an array of {} numbers", size) : "an array of numbers", array);
        std::vector<double> values;
        for (const json& value : array) {
            values.push_back(null_allowed && value.is_null() ? NAN : number(key, value));
            if (values.back() < 0) fail(key, "of numbers >= 0", value);
        }
        return values;
    }

    std::vector<std::vector<double>> matrix(const char* key, std::int64_t size) const {
        const json& rows = at(key);
        const auto fits = [=](const json& array) {
            return array.is_array() && array.size() == static_cast<std::size_t>(size);
        };
        if (!fits(rows) || !std::all_of(rows.begin(), rows.end(), fits))
            fail(key, fmt::format("{} rows of {} numbers", size, size), rows);
        std::vector<std::vector<double>> values;
        for (const json& row : rows) {
            values.emplace_back();
            for (const json& value : row) values.back().push_back(number(key, value));
        }
        return values;
    }

    JsonObject object(const char* key) const { return JsonObject(file_, fmt::format("{}{}: ", inside_, key), at(key)); }

  private:
    const json& at(const char* key) const {
        const auto found = object_.find(key);
        if (found == object_.end()) throw InputError(fmt::format("{}: {}{} is missing", file_, inside_, key));
        return *found;
    }

    double number(const char* key, const json& value) const {
        if (!value.is_number() || !std::isfinite(value.get<double>())) fail(key, "a number", value);
        return value.get<double>();
    }

    [[noreturn]] void fail(const char* key, const std::string& wanted, const json& found) const {
        std::string shown = found.is_structured() ? std::string(found.is_array() ? "an array" : "an object")
                                                  : found.dump(-1, ' ', true, json::error_handler_t::replace);
        if (found.is_array()) shown += fmt::format(" of {}", found.size());
        if (shown.size() > 60) shown = shown.substr(0, 57) + "...";
        throw InputError(fmt::format("{}: {}{} must be {}, found {}", file_, inside_, key, wanted, shown));
    }

    const std::string& file_;
    std::string inside_;
    const json& object_;
};

}  // namespace

RunReport read_run_report(const std::string& file, const std::string& text) {
    json parsed;
    try {
        parsed = json::parse(text);
    } catch (const json::exception&) {
        throw InputError(file + ": damaged, or not the JSON of `nscdd run`");
    }
    if (!parsed.is_object() || !parsed.contains("schema") || parsed["schema"] != "nscdd.run/1")
        throw InputError(file + ": not the JSON of `nscdd run`, whose schema is nscdd.run/1");
    const JsonObject top(file, "", parsed);
    if (!top.has("state")) throw InputError(file + ": was run without --state, nothing to compare");
    RunReport run;
    run.file = file;
    run.scene = top.text("scene");
    run.scheme = top.text("scheme");
    run.transport = top.text("transport");
    run.state = top.text("state");
    run.state_checksum = top.text("state_checksum");
    if (top.has("problem")) run.problem = top.text("problem");
    run.friction = top.truth("friction");
    run.dimension = top.integer("dimension", 2, 3);
    run.grains = run.grains_left = top.integer("grains", 0, most);
    if (top.has("exchange")) {  // a run that goes on has begun with others than its scene
        const JsonObject exchange = top.object("exchange");
        run.grains_left = exchange.integer("grains_left", 0, most);
        run.grains = run.grains_left - exchange.object("inserted").integer("grains", 0, most) +
                     exchange.object("removed").integer("grains", 0, most);
    }
    run.steps = top.integer("steps", 1, most);
    run.start_step = top.integer("start_step", 0, State::most_steps);
    run.subdomains = top.integer("subdomains", 1, most);
    run.unconverged_steps = top.integer("unconverged_steps", 0, run.steps);
    run.h = top.non_negative("h");
    run.tolerance = top.non_negative("tolerance");
    run.residual = top.numbers("residual", run.steps, true);
    run.velocity_error = top.numbers("velocity_error", run.steps, true);
    run.max_velocity_error = top.non_negative(top.either("max_velocity_error", "velocity_error_allowed"));
    run.energy_gain = top.numbers(top.either("energy_gain", "energy_made"), run.steps, true);
    run.penetration = top.numbers("penetration", run.steps, true);
    run.contacts = top.numbers("contacts", run.steps);
    run.densities = top.numbers("densities", -1);
    run.wall_masses = top.numbers("wall_masses", -1);
    const JsonObject final = top.object("final");
    run.kinetic_energy = final.non_negative("kinetic_energy");
    run.free_velocity_norm = final.non_negative("free_velocity_norm");
    run.boxed = final.has("stress");
    run.stress = final.matrix(run.boxed ? "stress" : "virial", run.dimension);
    return run;
}

void require_state_of(const RunReport& run, const State& state, const std::string& state_file) {
    const auto must_be = [&](const char* what, auto found, auto expected) {
        if (found != expected)
            throw InputError(fmt::format("{}: {} {}, but {} in {}", state_file, what, found, expected, run.file));
    };
    must_be("dimensions:", std::int64_t{state.packing.dim}, run.dimension);
    must_be("grains:", static_cast<std::int64_t>(state.packing.size()), run.grains_left);
    must_be("walls:", state.walls.offset.size(), run.wall_masses.size());
    must_be("steps made:", state.step, run.last_step());
    must_be("scene:", state.scene, run.scene);
    const auto bad = std::find_if(state.material.begin(), state.material.end(), [&](int material) {
        return material < 0 || material >= static_cast<std::int64_t>(run.densities.size());
    });
    if (bad != state.material.end())
        throw InputError(fmt::format("{}: grain {} has material {}, but {} has {}", state_file,
                                     bad - state.material.begin(), *bad, run.file, run.densities.size()));
}

}  // namespace nscdd
