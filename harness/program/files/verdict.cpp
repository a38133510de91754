#include "files/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace nscdd {
namespace {

// Of a step that is an answer beyond doubt. The velocity error is about the square of the distance (METHOD.md, section
// 5.2): this bound stands for 3 %, what `compare` asks of the velocities of one step.
constexpr double exact_eta = 1e-8, exact_velocity_error = 1e-3;

// Why a run is not exact; nothing where it is.
std::optional<std::string> inexact(const RunReport& run) {
    if (run.unconverged_steps > 0)
        return fmt::format("{} has steps without convergence, {}", run.file, run.unconverged_steps);
    for (std::size_t k = 0; k < run.residual.size(); ++k)
        if (!(run.residual[k] <= exact_eta && run.velocity_error[k] <= exact_velocity_error))
            return fmt::format("step {} of {} has eta {:.1e} and velocity error {:.1e}",
                               run.start_step + static_cast<std::int64_t>(k) + 1, run.file, run.residual[k],
                               run.velocity_error[k]);
    return {};
}

}  // namespace

Verdict verdict(const RunReport& reference, const RunReport& candidate, std::span<const AgreementRow> rows) {
    const auto fails = [rows](AgreementRow::Tells of) {
        return std::ranges::any_of(rows, [of](const AgreementRow& row) { return row.of == of && !row.ok(); });
    };
    using enum AgreementRow::Tells;
    const bool told = !reference.problem.empty() && !candidate.problem.empty();
    const bool one_start = reference.start_step == candidate.start_step;  // else the problems are those of other times
    const std::string difference = told && one_start && reference.problem != candidate.problem
                                       ? "grains, walls, coefficients, h or theta differ at the start of the two runs"
                                       : "";
    if (!fails(distance)) {
        if (fails(eta) || fails(convergence)) return {"not converged", candidate.file, 2};
        return {"agrees", difference.empty() ? "" : "within the bounds, but " + difference, 0};
    }
    if (!difference.empty()) return {"different problems", difference, 2};
    if (fails(eta))
        return {"wrong answer", fmt::format("eta of {} is beyond its bound, so it is none", candidate.file), 2};

    const auto untold = [](const std::string& why) {
        return Verdict{"cannot be told", "another answer or a wrong one: " + why, 2};
    };
    if (!told) return untold("one of the runs does not say which problem it solves");
    if (!one_start) return untold("the runs do not begin at one step");
    for (const RunReport* run : {&reference, &candidate})
        if (const auto why = inexact(*run))
            return untold(
                fmt::format("{}; make both runs with --tolerance {:g} --max-velocity-error {:g}{}", *why, exact_eta,
                            exact_velocity_error,
                            run->unconverged_steps > 0 ? ", a higher --max-iterations or fewer --steps" : ""));
    if (reference.friction)
        return {
            "another answer",
            fmt::format("each step of both is exact to {:g}, and with friction velocities are not unique", exact_eta),
            5};
    if (reference.steps > 1)
        return untold(
            "without friction a step has one answer, but small differences grow: compare one step from one state");
    return {"wrong answer", "without friction velocities are unique, so one of the runs is not what its file says", 2};
}

}  // namespace nscdd
