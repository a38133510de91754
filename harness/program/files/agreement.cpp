#include "files/agreement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nscdd/iterate/options.hpp"

namespace nscdd {
namespace {

constexpr SolveOptions defaults;

// sqrt(sum of dV^T M dV) over grains, spins and driven walls.
double velocity_distance(const Run& a, const Run& b) {
    const std::size_t dim = static_cast<std::size_t>(a.state.packing.dim),
                      spins = static_cast<std::size_t>(a.state.spins());
    double sum = 0;
    const auto square = [](const std::vector<double>& x, const std::vector<double>& y, std::size_t begin,
                           std::size_t count) {
        double total = 0;
        for (std::size_t k = begin; k < begin + count; ++k) total += (x[k] - y[k]) * (x[k] - y[k]);
        return total;
    };
    for (std::size_t g = 0; g < a.state.packing.size(); ++g) {
        const double r = a.state.packing.radius[g];
        const double volume = std::numbers::pi * r * r * (dim == 3 ? 4.0 / 3.0 * r : 1.0);
        const double mass = volume * a.report.densities[static_cast<std::size_t>(a.state.material[g])];
        sum += mass * square(a.state.velocity, b.state.velocity, g * dim, dim);
        sum += mass * r * r * (dim == 3 ? 0.4 : 0.5) * square(a.state.spin, b.state.spin, g * spins, spins);
    }
    for (std::size_t w = 0; w < a.report.wall_masses.size(); ++w)
        sum += a.report.wall_masses[w] * square(a.state.walls.velocity, b.state.walls.velocity, w * dim, dim);
    return std::sqrt(sum);
}

// One run may have brought a grain back into the cell, and the other not yet.
void to_nearest_image(const State::Cell& cell, std::vector<double>& way) {
    const std::size_t dim = way.size();
    for (std::size_t d = cell.periodic.size(); d-- > 0;) {
        if (cell.periodic[d] == 0) continue;
        const double sides = std::round(way[d] / cell.size[d]);
        way[d] -= sides * cell.size[d];
        for (std::size_t e = 0; e < d; ++e) way[e] -= sides * cell.tilt[e * dim + d];
    }
}

double farthest(const Run& a, const Run& b) {
    const std::size_t dim = static_cast<std::size_t>(a.state.packing.dim);
    double worst = 0;
    for (std::size_t g = 0; g < a.state.packing.size(); ++g) {
        std::vector<double> way;
        for (std::size_t k = g * dim; k < (g + 1) * dim; ++k)
            way.push_back(a.state.packing.x[k] - b.state.packing.x[k]);
        to_nearest_image(a.state.cell, way);
        double square = 0;
        for (const double x : way) square += std::pow(x, 2);
        worst = std::max(worst, square);
    }
    const auto& radius = a.state.packing.radius;
    if (radius.empty()) return 0;
    return std::sqrt(worst) / *std::min_element(radius.begin(), radius.end());
}

// difference / scale; 0 where both are 0, as where nothing moves or presses.
double relative(double difference, double scale) { return difference == 0 ? 0 : difference / scale; }

double stress_distance(const RunReport& a, const RunReport& b) {
    double difference = 0, norm = 0;
    for (std::size_t i = 0; i < a.stress.size(); ++i)
        for (std::size_t j = 0; j < a.stress.size(); ++j) {
            difference += std::pow(a.stress[i][j] - b.stress[i][j], 2);
            norm += std::pow(a.stress[i][j], 2);
        }
    return relative(std::sqrt(difference), std::sqrt(norm));
}

// Over the steps that both runs have made; one run may have gone on from a state.
double contacts_distance(const RunReport& a, const RunReport& b) {
    double difference = 0, total = 0;
    for (std::int64_t step = std::max(a.start_step, b.start_step); step < a.last_step(); ++step) {
        const double x = a.contacts[static_cast<std::size_t>(step - a.start_step)],
                     y = b.contacts[static_cast<std::size_t>(step - b.start_step)];
        difference += std::abs(x - y);
        total += x;
    }
    return relative(difference, total);
}

double largest(const std::vector<double>& values) {
    if (std::ranges::any_of(values, [](double value) { return std::isnan(value); })) return NAN;
    return values.empty() ? 0 : *std::ranges::max_element(values);
}

// Number of steps whose figures exceed these bounds (for energy gain and penetration the default ones), or
// `unconverged_steps` of the file where that is larger.
std::int64_t unconverged(const RunReport& run, double tolerance, double allowed_error) {
    std::int64_t count = 0;
    for (std::size_t k = 0; k < run.residual.size(); ++k)
        count += !(run.residual[k] <= tolerance && run.velocity_error[k] <= allowed_error &&
                   run.energy_gain[k] <= defaults.bounds.max_energy_gain &&
                   run.penetration[k] <= defaults.bounds.max_penetration * (1 + 1e-12));
    return std::max(count, run.unconverged_steps);
}

void require_same_scene(const Run& reference, const Run& candidate) {
    const RunReport &a = reference.report, &b = candidate.report;
    const auto same = [&](const std::string& what, const auto& theirs, const auto& ours) {
        if (theirs != ours)
            throw InputError(fmt::format("{}: {} is {}, but {} in {}", b.file, what, ours, theirs, a.file));
    };
    same("scene", a.scene, b.scene);
    same("dimension", a.dimension, b.dimension);
    same("grains", a.grains, b.grains);
    same("grains at the end", a.grains_left, b.grains_left);
    same("h", a.h, b.h);
    same("start_step + steps", a.last_step(), b.last_step());
    same("number of walls", a.wall_masses.size(), b.wall_masses.size());
    same("number of materials", a.densities.size(), b.densities.size());
    for (std::size_t k = 0; k < a.densities.size(); ++k)
        same(fmt::format("density of material {}", k), a.densities[k], b.densities[k]);
    for (std::size_t w = 0; w < a.wall_masses.size(); ++w)
        same(fmt::format("mass of wall {}", w), a.wall_masses[w], b.wall_masses[w]);
    for (std::size_t g = 0; g < reference.state.packing.size(); ++g) {
        same(fmt::format("radius of grain {}", g), reference.state.packing.radius[g],
             candidate.state.packing.radius[g]);
        same(fmt::format("material of grain {}", g), reference.state.material[g], candidate.state.material[g]);
    }
    if (a.boxed != b.boxed)
        throw InputError(fmt::format("{}: has {}, but {} has {}", b.file, b.boxed ? "stress" : "virial", a.file,
                                     a.boxed ? "stress" : "virial"));
}

}  // namespace

std::vector<AgreementRow> agreement(const Run& reference, const Run& candidate) {
    require_same_scene(reference, candidate);
    const RunReport &a = reference.report, &b = candidate.report;
    // One step from one state tells solvers apart. Its answers to a tolerance of 1e-4 are spread: on the reduced scenes
    // the reference differs from itself at half the tolerance by up to 0.06 in velocities, 0.005 in kinetic energy and
    // 0.03 in stress: no finer bound would tell of the other solver. After many steps, packings that are free to
    // rearrange have drifted apart within the tolerance, whoever solved them: the bounds of whole runs are 1.4 to 2.3
    // times the most by which 50 steps of the reference differ from those at 0.4 to 0.9 of its tolerance (velocities
    // 0.31, kinetic energy 0.043, stress 0.14, positions 0.016); of contacts, 0.15 % there, ten times, since a small
    // packing has few.
    const bool one_step = a.steps == 1 && b.steps == 1;
    // The reference's tolerances count, else a candidate could set coarse ones of its own. Bounds finer than the
    // defaults are not asked for.
    const double tolerance = std::max(a.tolerance, defaults.tolerance);
    const double allowed_error = std::max(a.max_velocity_error, defaults.bounds.max_velocity_error);
    const double energy_scale = 0.5 * a.free_velocity_norm * a.free_velocity_norm;
    return {{"largest residual eta, <= 1e-4 or the reference's tolerance", largest(b.residual), tolerance,
             AgreementRow::Tells::eta},
            {"steps without convergence", static_cast<double>(unconverged(b, tolerance, allowed_error)), 0,
             AgreementRow::Tells::convergence},
            {"velocities, |V - V_ref|_M / |V_free|_M",
             relative(velocity_distance(reference, candidate), a.free_velocity_norm), one_step ? 0.1 : 0.5},
            {"kinetic energy, difference / (|V_free|_M^2 / 2)",
             relative(std::abs(a.kinetic_energy - b.kinetic_energy), energy_scale), one_step ? 0.03 : 0.1},
            {"stress, |s - s_ref| / |s_ref|", stress_distance(a, b), one_step ? 0.03 : 0.2},
            {"positions, farthest / least radius", farthest(reference, candidate), one_step ? 1e-4 : 0.03},
            {"contacts, differences of the steps / their sum", contacts_distance(a, b), one_step ? 0.01 : 0.02}};
}

}  // namespace nscdd
