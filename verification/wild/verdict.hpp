// How far a solver's velocities are from the answer.
#pragma once

#include "captured.hpp"

namespace wild {

struct Verdict {
    double distance = 0;        // |V - V*|_M over |V* - V_free|_M, of the scene
    double component = 0;       // the same of the worst component
    int components = 0;         // bodies joined by contacts; driven walls join, others do not
    int worst = -1;             // that component
    double worst_size = 0;      // its number of contacts
    double made = 0;            // sum of r.w over |V - V_free|_M^2, of the scene
    double made_component = 0;  // the same of the worst component
    double kinetic = 0;         // kinetic energy above that of the answer, over |V* - V_free|_M^2 / 2
};

// What the contacts make of energy; needs no answer.
Verdict judge_energy(const Captured& found);
Verdict judge(const Captured& found, const Answer& answer);

}  // namespace wild
