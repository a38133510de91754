#include "model/stop.hpp"

#include <fmt/format.h>

namespace nscdd {

StopSettings read_stop(TomlTable& table) {
    StopSettings stop;
    const auto bound = [&table](const char* key, std::optional<double>& value) {
        if (table.has(key)) value = table.number(key, positive);
    };
    bound("time", stop.time);
    bound("strain", stop.strain);
    bound("kinetic_energy_over_work", stop.kinetic_energy_over_work);
    bound("largest_unbalanced_force", stop.largest_unbalanced_force);
    stop.nothing_left = table.flag("nothing_left");
    if (table.has("after") && !stop.of_rest())
        table.fail("after", "is of kinetic_energy_over_work and largest_unbalanced_force: give one");
    stop.after = table.number("after", non_negative, 0.0);
    table.finish();
    if (!stop.any()) table.fail("", "names no condition");
    return stop;
}

std::string Stopped::text() const {
    const std::string of = unit.empty() ? "" : " " + unit;
    std::string name = condition;
    for (char& c : name)
        if (c == '_') c = ' ';
    if (condition == "nothing_left") return name;
    return fmt::format("{} {:.4g}{}, asked for {:g}{}", name, value, of, bound, of);
}

}  // namespace nscdd
