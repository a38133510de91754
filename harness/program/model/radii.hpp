// Distributions of radii for packings: [radii] of a specification.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "files/toml_table.hpp"

namespace nscdd {

struct RadiiSpecification {
    enum class Kind { uniform, lognormal, two_sizes, list };
    Kind kind = Kind::uniform;
    bool by_mass = false;                  // shares and densities are of the mass of grains, else of their number
    double least = 0, largest = 0;         // of uniform and lognormal [m]
    double median = 0, deviation = 0;      // of lognormal [m], of ln(radius) [1]
    std::vector<double> radii, fractions;  // of two sizes and list [m], [1]

    bool sizes() const { return kind == Kind::two_sizes || kind == Kind::list; }
    // Share of the grains with a radius up to r, of uniform and lognormal; by number, or as by_mass says.
    double number_up_to(double r, int dim) const;
    // The radius that a share of the grains, in [0, 1), does not exceed, by number.
    double radius_at(double share, int dim) const;
    double share_up_to(double r, int dim) const;
};

// Throws InputError as TomlTable does. The whole table is read.
RadiiSpecification read_radii(TomlTable& table, int dim);

// `n` radii in an order that the seed names. Sizes have whole numbers of grains as near to their shares as can be.
// Others are the quantiles (k + 1/2) / n of the distribution: so it is met as well as n grains can. Throws InputError,
// which names `path`, where a size would have no grain.
std::vector<double> draw_radii(const RadiiSpecification& radii, int n, int dim, std::uint64_t seed,
                               const std::string& path);

// Confirms the distribution of a packing whose radii were all shrunk by a factor, and says in one line what it has.
// Throws InputError, which names `path`, where it is another one.
std::string confirm_radii(const RadiiSpecification& wanted, const std::vector<double>& found, double factor, int dim,
                          const std::string& path);

}  // namespace nscdd
