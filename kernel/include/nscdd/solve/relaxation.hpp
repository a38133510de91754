// How far a sweep goes towards each contact's own answer.
#pragma once

#include "nscdd/core/model.hpp"

namespace nscdd {

// A contact is solved with 1/W times omega. Without friction the energy falls in every sweep as long as 0 < omega < 2.
struct Relaxation {
    double factor = 1;  // omega
    // The split masses of an interface contact answer more than the whole ones, so that its step is too small by
    // W/W_split. It goes further: omega = 2 - (2 - factor) W/W_split, which stays below 2.
    bool interface = false;

    double of(double whole, double split) const { return interface ? 2 - (2 - factor) * whole / split : factor; }
    bool none() const { return factor == 1 && !interface; }
};

}  // namespace nscdd
