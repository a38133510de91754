#include "model/radii.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "model/material_mix.hpp"

namespace nscdd {

namespace {

const std::vector<std::string> kinds{"uniform", "lognormal", "two sizes", "list"};

// Share of numbers up to z of the normal distribution.
double normal_up_to(double z) { return 0.5 * std::erfc(-z * std::numbers::sqrt2 / 2); }

// Of fractions by mass, those by number.
std::vector<double> by_number(const RadiiSpecification& radii, int dim) {
    std::vector<double> fractions = radii.fractions;
    if (!radii.by_mass) return fractions;
    for (std::size_t k = 0; k < fractions.size(); ++k) fractions[k] /= std::pow(radii.radii[k], dim);
    const double sum = std::accumulate(fractions.begin(), fractions.end(), 0.0);
    for (double& fraction : fractions) fraction /= sum;
    return fractions;
}

}  // namespace

double RadiiSpecification::number_up_to(double r, int dim) const {
    r = std::clamp(r, least, largest);
    if (kind == Kind::lognormal) {
        // the numbers of a lognormal mass are lognormal too, about a smaller median [Hatch, Choate 1929]
        const double middle = std::log(median) - (by_mass ? dim * deviation * deviation : 0);
        const auto up_to = [&](double x) { return normal_up_to((std::log(x) - middle) / deviation); };
        return (up_to(r) - up_to(least)) / (up_to(largest) - up_to(least));
    }
    if (!by_mass) return (r - least) / (largest - least);
    const auto power = [dim](double x) { return std::pow(x, 1 - dim); };  // the integral of x^-dim, but for a factor
    return (power(least) - power(r)) / (power(least) - power(largest));
}

double RadiiSpecification::radius_at(double share, int dim) const {
    if (sizes()) {
        const std::vector<double> parts = by_number(*this, dim);
        std::size_t k = 0;
        while (k + 1 < parts.size() && share >= parts[k]) share -= parts[k++];
        return radii[k];
    }
    double low = least, high = largest;
    for (int halvings = 0; halvings < 60; ++halvings) {
        const double middle = 0.5 * (low + high);
        (number_up_to(middle, dim) < share ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

double RadiiSpecification::share_up_to(double r, int dim) const {
    if (!by_mass) return number_up_to(r, dim);
    RadiiSpecification of_mass = *this;  // a density that is given by mass is the density of the mass
    of_mass.by_mass = false;
    return of_mass.number_up_to(r, dim);
}

RadiiSpecification read_radii(TomlTable& table, int dim) {
    RadiiSpecification radii;
    radii.kind = static_cast<RadiiSpecification::Kind>(table.choice("distribution", kinds));
    radii.by_mass = table.has("by") && table.choice("by", {"number", "mass"}) == 1;
    const detail::OptionRange length{1e-50, 1e50};
    if (radii.sizes()) {
        const auto count = radii.kind == RadiiSpecification::Kind::two_sizes ? 2 : table.length("radii");
        const Eigen::VectorXd given = table.vector("radii", count);
        if (!(given.minCoeff() >= length.low && given.maxCoeff() <= length.high))
            table.fail("radii", fmt::format("must be {}", told(length)));
        radii.radii = {given.begin(), given.end()};
        radii.fractions = read_fractions(table, radii.radii.size());
        for (std::size_t k = 1; k < radii.radii.size(); ++k)
            if (!(radii.radii[k] > radii.radii[k - 1])) table.fail("radii", "must ascend");
        radii.least = radii.radii.front(), radii.largest = radii.radii.back();
    } else if (radii.kind == RadiiSpecification::Kind::uniform) {
        radii.least = table.number("least", length);
        radii.largest = table.number("largest", length);
    } else {
        radii.median = table.number("median", length);
        radii.deviation = table.number("deviation", {1e-3, 2});
        radii.least = table.number("least", length, radii.median * std::exp(-3 * radii.deviation));
        radii.largest = table.number("largest", length, radii.median * std::exp(3 * radii.deviation));
    }
    table.finish();
    if (!(radii.largest > radii.least) && !radii.sizes()) table.fail("largest", "must be above least");
    if (!radii.sizes() && !(radii.number_up_to(radii.largest, dim) == 1))  // 0/0 far out in a tail
        table.fail("", "no radius of this distribution lies between least and largest");
    return radii;
}

std::vector<double> draw_radii(const RadiiSpecification& radii, int n, int dim, std::uint64_t seed,
                               const std::string& path) {
    std::vector<double> drawn;
    if (radii.sizes()) {
        const std::vector<std::size_t> counts = shares_of(by_number(radii, dim), static_cast<std::size_t>(n));
        for (std::size_t k = 0; k < counts.size(); ++k) {
            if (counts[k] == 0)
                throw InputError(
                    fmt::format("{}: radii: of {} grains none would have radius {}", path, n, radii.radii[k]));
            drawn.insert(drawn.end(), counts[k], radii.radii[k]);
        }
    } else {
        for (int k = 0; k < n; ++k) drawn.push_back(radii.radius_at((k + 0.5) / n, dim));
    }
    std::mt19937_64 random(seed);
    for (std::size_t k = drawn.size(); k > 1; --k) std::swap(drawn[k - 1], drawn[random() % k]);  // the same everywhere
    return drawn;
}

std::string confirm_radii(const RadiiSpecification& wanted, const std::vector<double>& found, double factor, int dim,
                          const std::string& path) {
    std::vector<double> radii = found;
    for (double& radius : radii) radius /= factor;
    std::ranges::sort(radii);
    std::vector<double> up_to;  // share up to and with each
    double total = 0, most = 0;
    for (const double radius : radii) {
        const double weight = wanted.by_mass ? std::pow(radius, dim) : 1;
        up_to.push_back(total += weight);
        most = std::max(most, weight);
    }
    for (double& share : up_to) share /= total;
    most /= total;  // of one grain
    const char* const of = wanted.by_mass ? "the mass" : "the grains";
    const std::string name = kinds[static_cast<std::size_t>(wanted.kind)];
    double distance = 0, before = 0;
    std::string told;
    if (wanted.sizes()) {
        for (std::size_t k = 0; k < wanted.radii.size(); ++k) {
            const auto end = std::ranges::upper_bound(radii, wanted.radii[k] * (1 + 1e-9));
            const double share = end == radii.begin() ? 0 : up_to[static_cast<std::size_t>(end - radii.begin()) - 1];
            told += fmt::format("{}{:.2f} % {:g}", k == 0 ? "" : ", ", 100 * (share - before), wanted.radii[k]);
            distance = std::max(distance, std::abs(share - before - wanted.fractions[k]));
            before = share;
        }
    } else {
        for (std::size_t k = 0; k < radii.size(); ++k) {
            const double share = wanted.share_up_to(radii[k], dim);
            distance = std::max({distance, std::abs(share - before), std::abs(share - up_to[k])});
            before = up_to[k];
        }
        told = fmt::format("{:g} to {:g}", radii.front(), radii.back());
    }
    // whole grains, one at each end of a share
    const double allowed = (wanted.sizes() ? 2.01 : 1.01) * most;
    if (!(distance <= allowed))
        throw InputError(
            fmt::format("{}: the radii of the packing are not those asked for, {} of {}: off by {:.3g}, "
                        "more than {:.3g}: nothing is written",
                        path, name, of, distance, allowed));
    return fmt::format("radii {} of {}: {}; {} {:.2g}", name, of, told,
                       wanted.sizes() ? "largest error of a share" : "Kolmogorov distance", distance);
}

}  // namespace nscdd
