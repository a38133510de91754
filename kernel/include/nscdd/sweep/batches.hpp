#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Contacts dealt into batches that share no body, so that a batch is solved at once with the result of one after
/// the other.
struct Batches {
    /// Batches between two that share a body, where possible: the next batch need not wait for the last one's result.
    static constexpr int apart = 2;

    std::vector<int> contact;  ///< `lanes` indices a batch; -1 pads

    /// Appends batches. Greedy within a window that moves along the order given, so that this order hardly changes.
    ///   order                 the contacts, by index
    ///   most                  contacts of a batch, at most `lanes`; the lanes left over are padded
    ///   together(first, c)    true if c may be in a batch whose first contact is `first`
    ///   touched(c, visit)     calls visit(body) for each body, numbered below `bodies`, that c changes
    void deal(std::span<const int> order, int lanes, std::size_t bodies, int window, int most, auto&& together,
              auto&& touched) {
        taken_.assign(bodies, -apart);
        window_.clear();
        std::size_t head = 0;
        std::size_t next = 0;
        for (int batch = 0; head < window_.size() || next < order.size(); ++batch) {
            while (next < order.size() && static_cast<int>(window_.size() - head) < window)
                window_.push_back(order[next++]);
            const std::size_t begin = contact.size(), full = begin + static_cast<std::size_t>(most);
            for (const int distance : {apart, 1}) {
                std::size_t scanned = head;
                left_.clear();
                for (; scanned < window_.size() && contact.size() < full; ++scanned) {
                    const int c = window_[scanned];
                    bool free = contact.size() == begin || together(contact[begin], c);
                    touched(c, [&](int body) {
                        free = free && batch - taken_[static_cast<std::size_t>(body)] >= distance;
                    });
                    if (!free) {
                        left_.push_back(c);
                        continue;
                    }
                    touched(c, [&](int body) { taken_[static_cast<std::size_t>(body)] = batch; });
                    contact.push_back(c);
                }
                head = scanned - left_.size();  // what was passed over comes first next time
                std::copy(left_.begin(), left_.end(), window_.begin() + static_cast<std::ptrdiff_t>(head));
            }
            contact.resize(begin + static_cast<std::size_t>(lanes), -1);
        }
    }

  private:
    std::vector<int> taken_, window_, left_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
