/// @file
/// An error that one rank finds is thrown on all. A rank that throws alone would leave the others waiting.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Throws std::invalid_argument on every process, with the complaint of the lowest rank that has one. complaints[k] is
/// that of ranks()[k], empty for none. Collective.
inline void throw_collectively(Communicator& comm, const std::vector<std::string>& complaints) {
    const Turn::Hold hold(comm.turn(), "throw_collectively");
    std::vector<Buffer> lengths;
    for (const auto& complaint : complaints) lengths.push_back({static_cast<double>(complaint.size())});
    const std::span<const double> all = comm.all_gather(lengths);
    std::size_t first = 0;
    while (first < all.size() && all[first] == 0) ++first;
    if (first == all.size()) return;
    std::vector<Communicator::Outbox> out(complaints.size());
    for (std::size_t k = 0; k < complaints.size(); ++k)
        if (comm.ranks()[k] == static_cast<int>(first))
            for (int to = 0; to < comm.size(); ++to) out[k][to].assign(complaints[k].begin(), complaints[k].end());
    const std::vector<Buffer> told = comm.route(out);
    std::string text;
    for (const double letter : told[0]) text += static_cast<char>(letter);
    throw std::invalid_argument(text);
}

/// Calls task(k) once for each hosted rank, and throws collectively the std::invalid_argument that one throws.
void throw_collectively(Communicator& comm, auto&& task)
    requires std::invocable<decltype(task), std::size_t>
{
    std::vector<std::string> complaints(comm.ranks().size());
    for (std::size_t k = 0; k < complaints.size(); ++k) try {
            task(k);
        } catch (const std::invalid_argument& error) {
            complaints[k] = error.what();
        }
    throw_collectively(comm, complaints);
}

}}}  // namespace nscdd::NSCDD_ABI::detail
