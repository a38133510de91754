// What the rows of a comparison mean: velocities under friction are not unique, so runs that differ may both be right.
#pragma once

#include <span>
#include <string>

#include "files/agreement.hpp"

namespace nscdd {

struct Verdict {
    std::string name;  // of compare.schema.json
    std::string why;   // in a sentence; empty where the runs agree
    int exit_code = 0;
};

// Of two runs whose rows of agreement() these are. Trusts what they say of their own steps.
Verdict verdict(const RunReport& reference, const RunReport& candidate, std::span<const AgreementRow> rows);

}  // namespace nscdd
