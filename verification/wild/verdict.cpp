#include "verdict.hpp"

#include <limits>

namespace wild {

namespace {

// Energies by which those of components are divided: a component counts with a mean change of at least 1e-4 of the
// scene's, and no change need be exact to less than 1e-8 of the free velocities, nor to less than 1e-10 of those that
// the solve began with: that is their round-off.
Vector scales(const Captured& found, const Vector& change) {
    const Quadratic& problem = found.problem;
    Vector masses = Vector::Zero(problem.components);
    double quartic = 0, energy = 0;
    for (std::size_t b = 0; b + 1 < problem.begin.size(); ++b) {
        const Eigen::Index at = problem.begin[b], size = problem.begin[b + 1] - at;
        const int component = problem.component[static_cast<std::size_t>(at)];
        if (component < 0) continue;
        masses[component] += problem.mass[at];
        const double of_body = change.segment(at, size).cwiseAbs2().dot(problem.mass.segment(at, size));
        energy += of_body, quartic += of_body * of_body / problem.mass[at];
    }
    const Vector energies = problem.energies(change), free = problem.energies(problem.free);
    const double mean_square = energy > 0 ? quartic / energy : 0;
    const Vector floors = (1e-8 * mean_square * masses).cwiseMax(1e-16 * free);
    if (found.start.size() == 0) return energies.cwiseMax(floors);
    return energies.cwiseMax(floors).cwiseMax(1e-20 * problem.energies(found.start));
}

double ratio(double part, double whole) {
    return part > 0 ? (whole > 0 ? part / whole : std::numeric_limits<double>::infinity()) : 0;
}

}  // namespace

Verdict judge_energy(const Captured& found) {
    const Quadratic& problem = found.problem;
    Verdict verdict;
    verdict.components = problem.components;
    Vector made = Vector::Zero(problem.components);
    for (Eigen::Index c = 0; c < found.work.size(); ++c)
        made[problem.contact_component[static_cast<std::size_t>(c)]] += found.work[c];
    const Vector scale = scales(found, found.v - problem.free);
    verdict.made = ratio(made.sum(), scale.sum());
    for (int k = 0; k < problem.components; ++k)
        verdict.made_component = std::max(verdict.made_component, ratio(made[k], scale[k]));
    return verdict;
}

Verdict judge(const Captured& found, const Answer& answer) {
    const Quadratic& problem = found.problem;
    Verdict verdict = judge_energy(found);
    const Vector off = problem.energies(found.v - answer.v), scale = scales(found, answer.v - problem.free);
    verdict.distance = std::sqrt(ratio(off.sum(), scale.sum()));
    for (int k = 0; k < problem.components; ++k)
        if (const double far = std::sqrt(ratio(off[k], scale[k])); far >= verdict.component)
            verdict.component = far, verdict.worst = k;
    verdict.worst_size = double(std::ranges::count(problem.contact_component, verdict.worst));
    const double kinetic = problem.energies(found.v).sum() - problem.energies(answer.v).sum();
    verdict.kinetic = scale.sum() > 0 ? kinetic / scale.sum() : 0;
    return verdict;
}

}  // namespace wild
