// How the steps of a run are solved, as a scene and the command line say it.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "nscdd/iterate/options.hpp"

namespace nscdd {

class TomlTable;

// How sweeps go on: accelerated, with Newton's method where they get nowhere; or as Alg. 1 of the paper is written.
enum class Method { accelerated, paper };
inline constexpr std::array method_names{std::pair{"auto", Method::accelerated}, std::pair{"paper", Method::paper}};

// Only what was given; the rest follows from the method.
struct SolveSettings {
    std::optional<Method> method;                      // Method::accelerated unless given
    std::map<std::string, double, std::less<>> given;  // options of visit_options(), by name

    void override_by(const SolveSettings& later);
    // sweeping: the solver sweeps. Else options of sweeps stay as they are in the kernel.
    SolveOptions options(bool sweeping) const;
};

// What the option was called by earlier programs, whose files and commands are still read; null where it had no other.
const char* earlier_name(std::string_view name);

// [solver] of a scene. Reads the names of earlier programs too. Throws InputError.
SolveSettings read_solve_settings(TomlTable& table);

// The options as `method` has them where nothing is given.
SolveOptions default_options(Method method, bool sweeping = true);

}  // namespace nscdd
