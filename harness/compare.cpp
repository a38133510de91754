#include "compare.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "error.hpp"
#include "state.hpp"

namespace nscdd {

namespace {

using nlohmann::json;

struct Run {
    json report;
    State state;
};

Run read_run(const std::string& path) {
    std::ifstream file(path);
    if (!file) throw InputError(path + ": cannot be opened");
    Run run;
    try {
        run.report = json::parse(file);
        if (run.report.at("schema") != "nscdd.run/1") throw InputError(path + ": not the JSON of `nscdd run`");
        if (!run.report.contains("state")) throw InputError(path + ": was run without --state, nothing to compare");
        const auto folder = std::filesystem::path(path).parent_path();
        run.state = read_state((folder / run.report["state"].get<std::string>()).string());
    } catch (const json::exception&) {
        throw InputError(path + ": damaged, or not the JSON of `nscdd run`");
    }
    return run;
}

// sqrt(sum of dV^T M dV) over grains, spins and driven walls.
double velocity_distance(const Run& a, const Run& b) {
    const std::size_t dim = static_cast<std::size_t>(a.state.packing.dim),
                      spins = static_cast<std::size_t>(a.state.spins());
    const auto densities = a.report.at("densities").get<std::vector<double>>();
    const auto wall_masses = a.report.at("wall_masses").get<std::vector<double>>();
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
        const double mass = volume * densities.at(static_cast<std::size_t>(a.state.material[g]));
        sum += mass * square(a.state.velocity, b.state.velocity, g * dim, dim);
        sum += mass * r * r * (dim == 3 ? 0.4 : 0.5) * square(a.state.spin, b.state.spin, g * spins, spins);
    }
    for (std::size_t w = 0; w < wall_masses.size(); ++w)
        sum += wall_masses[w] * square(a.state.walls.velocity, b.state.walls.velocity, w * dim, dim);
    return std::sqrt(sum);
}

double farthest(const Run& a, const Run& b) {
    const std::size_t dim = static_cast<std::size_t>(a.state.packing.dim);
    double worst = 0;
    for (std::size_t g = 0; g < a.state.packing.size(); ++g) {
        double square = 0;
        for (std::size_t k = g * dim; k < (g + 1) * dim; ++k)
            square += std::pow(a.state.packing.x[k] - b.state.packing.x[k], 2);
        worst = std::max(worst, square);
    }
    const auto& radius = a.state.packing.radius;
    return std::sqrt(worst) / *std::min_element(radius.begin(), radius.end());
}

double stress_distance(const json& a, const json& b) {
    const char* key = a.contains("stress") ? "stress" : "virial";
    double difference = 0, norm = 0;
    for (std::size_t i = 0; i < a.at(key).size(); ++i)
        for (std::size_t j = 0; j < a.at(key).size(); ++j) {
            const double x = a.at(key)[i][j], y = b.at(key).at(i).at(j);
            difference += (x - y) * (x - y);
            norm += x * x;
        }
    return difference > 0 ? std::sqrt(difference / norm) : 0;
}

}  // namespace

int compare(const std::string& reference_file, const std::string& candidate_file, const std::string& json_file,
            const Provenance& provenance) {
    const Run reference = read_run(reference_file), candidate = read_run(candidate_file);
    const json &a = reference.report, &b = candidate.report;
    for (const char* key : {"scene", "grains", "steps", "dimension"})
        if (a.at(key) != b.at(key))
            throw InputError(fmt::format("{}: {} is {}, but {} in {}", candidate_file, key, b.at(key).dump(),
                                         a.at(key).dump(), reference_file));

    // One step from one state tells solvers apart. After many, packings that are free to rearrange have drifted apart
    // within the tolerance, whoever solved them: the bounds of whole runs are 1.5 to 3 times what 50 steps of the
    // reference differ from those of the reference at half its tolerance (the main job makes that comparison too).
    const bool one_step = a.at("steps") == 1;
    const double free_norm = a.at("final").at("free_velocity_norm");
    const double energy_scale = 0.5 * free_norm * free_norm;
    const double energy =
        std::abs(a["final"]["kinetic_energy"].get<double>() - b["final"]["kinetic_energy"].get<double>());
    double eta = 0;
    for (const auto& value : b.at("residual")) eta = value.is_number() ? std::max(eta, value.get<double>()) : NAN;

    json rows = json::array();
    bool all = true;
    const auto row = [&](const std::string& quantity, double value, double bound) {
        const bool ok = value <= bound;
        all &= ok;
        rows.push_back({{"quantity", quantity}, {"value", value}, {"bound", bound}, {"ok", ok}});
        fmt::print("{:<62} {:>10.3g}  <= {:<8g} {}\n", quantity, value, bound, ok ? "ok" : "DISAGREES");
    };
    row("largest residual eta", eta, b.at("tolerance"));
    row("steps without convergence", b.at("unconverged_steps"), 0);
    const double ratio = free_norm > 0 ? 1 / free_norm : 0;
    row("velocities, |V - V_ref|_M / |V_free|_M", velocity_distance(reference, candidate) * ratio,
        one_step ? 0.03 : 0.5);
    row("kinetic energy, difference / (|V_free|_M^2 / 2)", energy > 0 ? energy / energy_scale : 0,
        one_step ? 0.03 : 0.05);
    row("stress, |s - s_ref| / |s_ref|", stress_distance(a["final"], b["final"]), one_step ? 0.01 : 0.2);
    row("positions, farthest / least radius", farthest(reference, candidate), one_step ? 1e-4 : 0.03);

    json result = provenance;
    result.update({{"schema", "nscdd.compare/1"},
                   {"reference", reference_file},
                   {"candidate", candidate_file},
                   {"scene", a["scene"]},
                   {"scheme", b["scheme"]},
                   {"subdomains", b["subdomains"]},
                   {"transport", b["transport"]},
                   {"steps", a["steps"]},
                   {"rows", rows},
                   {"ok", all}});
    if (!json_file.empty()) write_json(json_file, result);
    return all ? 0 : 2;
}

}  // namespace nscdd
