// Parts of a sweep, between which subdomains exchange messages.
#pragma once

#include <cstddef>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

enum class SweepPass {  // which contacts it takes, those with walls first: 1 % fewer iterations than last
    all,                // every contact
    first,              // those at the front of the problem's lists, see SweepFront
    rest,               // all others
    rest_walls,         // of the others those with walls
    rest_grains,        // of the others those between grains, perhaps piece by piece
};
struct SweepPiece {                  // one of several equal parts of what SweepPass::rest_grains takes
    std::size_t number = 0, of = 1;  // its number, from 0, and how many parts there are
    std::size_t begin(std::size_t count) const { return count * number / of; }      // its first of `count` items
    std::size_t end(std::size_t count) const { return count * (number + 1) / of; }  // one past its last item
};
struct SweepFront {  // numbers of contacts that SweepPass::first takes from the front of the problem's lists
    std::size_t contacts = 0, wall_contacts = 0;  // between grains, with walls
};

}}  // namespace nscdd::NSCDD_ABI
