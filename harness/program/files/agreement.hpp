// How far two runs of one scene are from each other, quantity by quantity, with the bounds of agreement.
#pragma once

#include <vector>

#include "files/run_report.hpp"

namespace nscdd {

struct Run {
    RunReport report;
    State state;
};

struct AgreementRow {
    std::string quantity;
    double value = 0, bound = 0;
    enum class Tells { distance, eta, convergence } of = Tells::distance;  // the last two: of the candidate alone
    bool ok() const { return value <= bound; }
};

// Both runs end at the same step of the same scene; one may have gone on from a state (--from) on its way there. Throws
// InputError, naming the files, where the runs are not of the same scene, grains, walls, step size and last step.
std::vector<AgreementRow> agreement(const Run& reference, const Run& candidate);

}  // namespace nscdd
