/// @file
/// Messages of many ranks to many others, in two hops.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "nscdd/comm/communicator.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Returns what comm.route(out) does; for ranks that have something for most others. Collective. The ranks form a
/// square, row by row: a message goes along the row of its source to the column of its target, and down that column. A
/// rank sends about 2 sqrt(size) messages instead of size. The last row may be short: columns that it lacks are met one
/// row above, so that messages still arrive by source rank.
inline std::vector<Buffer> route_by_square(Communicator& comm, const std::vector<Communicator::Outbox>& out) {
    const int size = comm.size(), width = static_cast<int>(std::ceil(std::sqrt(size)));
    std::vector<Communicator::Outbox> along(out.size()), down(out.size());
    for (std::size_t k = 0; k < out.size(); ++k)
        for (const auto& [target, message] : out[k]) {
            if (message.empty()) continue;
            const int corner = comm.ranks()[k] / width * width + target % width;
            Buffer& to = along[k][corner < size ? corner : corner - width];
            to.insert(to.end(), {double(target), double(message.size())});
            to.insert(to.end(), message.begin(), message.end());
        }
    const std::vector<Buffer> met = comm.route(along);
    for (std::size_t k = 0; k < out.size(); ++k)
        for (auto at = met[k].begin(); at != met[k].end();) {
            const auto begin = at + 2, end = begin + static_cast<std::ptrdiff_t>(at[1]);
            Buffer& to = down[k][static_cast<int>(at[0])];
            to.insert(to.end(), begin, end);
            at = end;
        }
    return comm.route(down);
}

}}}  // namespace nscdd::NSCDD_ABI::detail
