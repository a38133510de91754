#include "model/solve_settings.hpp"

#include "files/toml_table.hpp"

namespace nscdd {
namespace {

// Components of more contacts take Newton's method longer than sweeps are given. The kernel's own default is none: it
// makes Algorithm 1 as the paper has it, unless it is asked for more.
constexpr int most_newton_contacts = 2000;

// Keys of earlier programs, and what they are called now.
constexpr std::array earlier_names{std::pair{"velocity_error", "max_velocity_error"},
                                   std::pair{"energy_made", "max_energy_gain"},
                                   std::pair{"penetration", "max_penetration"},
                                   std::pair{"gap_error", "max_gap_error"},
                                   std::pair{"distance", "max_distance"},
                                   std::pair{"newton_contacts", "max_newton_contacts"},
                                   std::pair{"rough_every", "broad_phase_every"}};

}  // namespace

const char* earlier_name(std::string_view name) {
    for (const auto& [earlier, now] : earlier_names)
        if (name == now) return earlier;
    return nullptr;
}

void SolveSettings::override_by(const SolveSettings& later) {
    if (later.method) method = later.method;
    for (const auto& [name, value] : later.given) given[name] = value;
}

SolveOptions default_options(Method method, bool sweeping) {
    SolveOptions options;
    if (!sweeping || method == Method::paper) return options;
    options.max_newton_contacts = most_newton_contacts;
    return options.accelerated();
}

SolveOptions SolveSettings::options(bool sweeping) const {
    const Method chosen = method.value_or(Method::accelerated);
    SolveOptions options = default_options(chosen, sweeping);
    detail::visit_options(options, [&](const detail::OptionInfo& info, auto& value) {
        const auto found = given.find(info.name);
        if (found != given.end() && (sweeping || !info.of_sweeps))
            value = static_cast<std::remove_reference_t<decltype(value)>>(found->second);
    });
    if (chosen == Method::paper) options.max_newton_contacts = 0;
    return options;
}

SolveSettings read_solve_settings(TomlTable& table) {
    SolveSettings settings;
    SolveOptions defaults;
    detail::visit_options(defaults, [&](const detail::OptionInfo& info, const auto& value) {
        const std::string_view key = table.key_of(info.name, earlier_name(info.name));
        if (!table.has(key)) return;
        const detail::OptionRange range = in_files(info.range, value);
        if constexpr (std::is_same_v<decltype(value), const int&>)
            settings.given[info.name] = table.integer(key, range);
        else
            settings.given[info.name] = table.number(key, range);
    });
    if (table.has("method"))
        settings.method = method_names[static_cast<std::size_t>(table.choice("method", {"auto", "paper"}))].second;
    return settings;
}

}  // namespace nscdd
