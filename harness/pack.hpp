// `nscdd pack`: a packing from nothing but numbers, by our own contact dynamics.
#pragma once

#include <string>

#include "report_json.hpp"

namespace nscdd {

struct PackArguments {
    std::string specification, output;
    bool quiet = false;
};

// Grains are thrown at random into a large box, then six (four) frictionless walls press until the sample is jammed,
// or has the solid fraction asked for. Returns the exit code; throws InputError and OutputError.
int pack(const PackArguments& arguments, const Provenance& provenance);

}  // namespace nscdd
