/// @file
/// Options of an iteration, when it stops and how it iterates. Each has all that a user reads about it.
#pragma once

#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>

#include "nscdd/iterate/anderson.hpp"
#include "nscdd/iterate/report.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Values that an option may have: low to high, both included. The program accepts finite numbers between them.
struct OptionRange {
    double low = 0;                                         ///< least value
    double high = std::numeric_limits<double>::infinity();  ///< largest value
    bool open = false;                                      ///< low and high themselves are excluded
    /// Whether the option may have this value.
    bool holds(double value) const { return open ? value > low && value < high : value >= low && value <= high; }
};

/// All that a user reads about an option. Keys of files, the command line, its help and the checks are made of it.
struct OptionInfo {
    const char* name;        ///< name of the member and key in files; on the command line with dashes
    const char* unit;        ///< unit; "" for a pure number
    const char* meaning;     ///< a sentence
    OptionRange range = {};  ///< of the value
    bool of_sweeps = false;  ///< only solvers that sweep use it
};

}  // namespace detail

/// Options of NLGS and NSCDD: when they stop, and how they iterate. The defaults are the paper's own method.
struct SolveOptions {
    /// Largest figures with which a step is done. Where a figure is larger the step goes on (METHOD.md, section 5.6).
    struct Bounds {
        double max_velocity_error = 0.1;  ///< on SolveReport::velocity_error
        double max_energy_gain = 1e-3;    ///< on SolveReport::energy_gain
        double max_penetration = 1e-3;    ///< on SolveReport::penetration over the least radius, where there is one
        double max_gap_error = 1e-3;      ///< on SolveReport::gap_error, where the problem has radii
        double max_distance = 0.3;        ///< on SolveReport::distance
    };

    double tolerance = 1e-4;     ///< on eta, ResidualParts::eta(); 0: all iterations are made, also where eta is 0
    Bounds bounds{};             ///< on the other figures, as eta does not see all errors
    int check_every = 0;         ///< iterations between two tests; 0: where they pay (interval(), detail::Foretold)
    int max_iterations = 20000;  ///< cap; a solve that ends here is reported as not converged
    /// Largest component [contacts] that Newton's method solves where sweeps get nowhere, by_nlgs() and by_nscdd(). 0:
    /// none.
    int max_newton_contacts = 0;
    int sweeps = 1;         ///< n_GS of Alg. 1: sweeps between two gluings
    int window = 0;         ///< of Anderson acceleration: earlier iterates to combine; 0: none
    double relaxation = 1;  ///< omega, a factor of 1/W at each contact

    /// Returns these options with the window that needs the fewest iterations (METHOD.md, section 8).
    SolveOptions accelerated() const {
        SolveOptions options = *this;
        options.window = 2;
        return options;
    }
    /// Iterations between two tests where nothing foretells which of them pays.
    int interval() const { return check_every > 0 ? check_every : 10; }
};

namespace detail {

/// A bound, and the figure that it limits.
struct BoundOption {
    OptionInfo info;                      ///< texts for a user
    double SolveOptions::Bounds::*limit;  ///< the bound
    double SolveReport::*figure;          ///< the figure
    const char* figure_name;              ///< name of the figure's member
    bool estimated;                       ///< report_distance() estimates it, once the others are kept
};

/// An option beside the bounds.
template <class Value>
struct SolveOption {
    OptionInfo info;              ///< texts for a user
    Value SolveOptions::*member;  ///< the option
};

/// All bounds.
inline constexpr std::array bound_options{
    BoundOption{
        {"max_velocity_error", "",
         "Bound on the velocity error: eta does not see wrong velocities where masses differ or columns are long"},
        &SolveOptions::Bounds::max_velocity_error,
        &SolveReport::velocity_error,
        "velocity_error",
        false},
    BoundOption{{"max_energy_gain", "",
                 "Bound on the share of energy that contacts may make in a step, of the scene and of each component"},
                &SolveOptions::Bounds::max_energy_gain,
                &SolveReport::energy_gain,
                "energy_gain",
                false},
    BoundOption{{"max_penetration", "least radius", "Bound on how deep a step may close a contact"},
                &SolveOptions::Bounds::max_penetration,
                &SolveReport::penetration,
                "penetration",
                false},
    BoundOption{{"max_gap_error", "contact's radius",
                 "Bound on the gap error: a step is proven exact for gaps that differ by at most this"},
                &SolveOptions::Bounds::max_gap_error,
                &SolveReport::gap_error,
                "gap_error",
                true},
    BoundOption{{"max_distance", "",
                 "Bound on the estimated distance of velocities from an answer, over what contacts change, of the "
                 "worst component"},
                &SolveOptions::Bounds::max_distance,
                &SolveReport::distance,
                "distance",
                true},
};

inline constexpr double largest_int = (std::numeric_limits<int>::max)();

/// All options but tolerance and bounds.
inline constexpr std::tuple other_options{
    SolveOption<int>{
        {"check_every",
         "iterations",
         "Interval of the tests of convergence; 1 for studies of counts; 0: 10 or, accelerated, as foretold",
         {0, largest_int}},
        &SolveOptions::check_every},
    SolveOption<int>{{"max_iterations",
                      "iterations",
                      "Cap of one solve; a step in which detection finds more contacts is solved again",
                      {1, detail::largest_int}},
                     &SolveOptions::max_iterations},
    SolveOption<int>{
        {"max_newton_contacts",
         "contacts",
         "Largest component that Newton's method solves where sweeps get nowhere; 0: none, as by the paper's method",
         {0, detail::largest_int},
         true},
        &SolveOptions::max_newton_contacts},
    SolveOption<int>{{"sweeps", "sweeps", "Number n_GS in each subdomain between two gluings", {1, largest_int}, true},
                     &SolveOptions::sweeps},
    SolveOption<int>{{"window",
                      "iterates",
                      "Earlier iterates that Anderson acceleration combines; 0: no acceleration",
                      {0, Anderson::largest_window},
                      true},
                     &SolveOptions::window},
    SolveOption<double>{{"relaxation", "", "Factor omega on the step of every contact", {0, 2, true}, true},
                        &SolveOptions::relaxation}};

/// Calls each(info, value) for every option of `options`, which may be const.
constexpr void visit_options(auto&& options, auto&& each) {
    each(OptionInfo{"tolerance", "", "Bound on eta, the distance from the contact law"}, options.tolerance);
    for (const BoundOption& bound : bound_options) each(bound.info, options.bounds.*bound.limit);
    std::apply([&](const auto&... option) { (each(option.info, options.*option.member), ...); }, other_options);
}

inline std::string described(const OptionRange& range) {
    const auto whole = [](double value) { return std::to_string(static_cast<long long>(value)); };
    if (range.high >= (std::numeric_limits<int>::max)()) return "of at least " + whole(range.low);
    return "between " + whole(range.low) + " and " + whole(range.high);
}

inline void check_option(const OptionInfo& info, double value) {
    if (info.range.holds(value)) return;
    throw std::invalid_argument(std::string(info.name) + " must be a number " + described(info.range));
}

/// Throws std::invalid_argument for options with which no solver ends, and names the first.
inline void check_options(const SolveOptions& options) {
    visit_options(options, [](const OptionInfo& info, auto value) { check_option(info, value); });
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
