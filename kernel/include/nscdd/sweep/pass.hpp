/// @file
/// Parts of a sweep, between which subdomains exchange messages.
#pragma once

#include <cstddef>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Contacts that a pass takes. Those with walls come first, which takes 1 % fewer iterations than last.
enum class SweepPass {
    all,          ///< every contact
    first,        ///< contacts at the front of the problem's lists, see SweepFront
    rest,         ///< all others
    rest_walls,   ///< of the others, contacts with walls
    rest_grains,  ///< of the others, contacts between grains, perhaps piece by piece
};
/// One of several equal parts of the contacts of SweepPass::rest_grains.
struct SweepPiece {
    std::size_t number = 0;  ///< number of the part, from 0
    std::size_t of = 1;      ///< number of parts

    std::size_t begin(std::size_t count) const { return count * number / of; }      ///< first of `count` items
    std::size_t end(std::size_t count) const { return count * (number + 1) / of; }  ///< one past the last item
};
/// Numbers of contacts that SweepPass::first takes from the front of the problem's lists.
struct SweepFront {
    std::size_t contacts = 0;       ///< between grains
    std::size_t wall_contacts = 0;  ///< with walls
};

}}}  // namespace nscdd::NSCDD_ABI::detail
