// Any bytes as the JSON of a run; what is read is judged with states of the sizes that it says, and of others.
#include "files/verdict.hpp"
#include "fuzz.hpp"

using namespace nscdd;

namespace {

State made_up_state(const RunReport& run, std::size_t grains) {
    const auto dim = static_cast<std::size_t>(run.dimension), walls = run.wall_masses.size();
    State state;
    state.packing = {.dim = static_cast<int>(run.dimension),
                     .x = std::vector<double>(grains * dim, 1),
                     .radius = std::vector<double>(grains, 0.5),
                     .box = std::vector<double>(dim, 4)};
    state.velocity.assign(grains * dim, 0.5);
    state.spin.assign(grains * static_cast<std::size_t>(state.spins()), 0.25);
    state.material.assign(grains, 0);
    state.walls = {.offset = std::vector<double>(walls),
                   .normal = std::vector<double>(walls * dim),
                   .velocity = std::vector<double>(walls * dim, 2)};
    state.step = run.last_step();
    state.scene = run.scene;
    return state;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    fuzz::refuses_in_one_line([&] {
        const RunReport report = read_run_report("run.json", text);
        Run run{report, made_up_state(report, static_cast<std::size_t>(std::min<std::int64_t>(report.grains, 100)))};
        require_state_of(report, run.state, "state.h5");
        Run reference = run;
        reference.report.start_step = std::max<std::int64_t>(run.report.start_step, 1) - 1;
        reference.report.steps = run.report.last_step() - reference.report.start_step;
        reference.report.contacts.assign(static_cast<std::size_t>(reference.report.steps), 3);
        verdict(reference.report, run.report, agreement(reference, run));
    });
    return 0;
}
