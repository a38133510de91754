#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
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
    ///   order            the contacts, by index
    ///   most             contacts of a batch, at most `lanes`; the lanes left over are padded
    ///   together(a, b)   true if contacts a and b may be in one batch; it makes classes
    ///   touched(c)       the bodies that c changes, numbered below `bodies`; -1: none
    void deal(std::span<const int> order, int lanes, std::size_t bodies, std::size_t window, int most, auto&& together,
              auto&& touched) {
        taken_.assign(1 + bodies, -apart);
        classes_.clear();
        std::size_t next = 0, waiting = 0;
        for (int batch = 0; waiting > 0 || next < order.size(); ++batch) {
            for (; waiting < window && next < order.size(); ++next, ++waiting)
                class_of(order[next], together)
                    .waiting.push_back({static_cast<int>(next), order[next], touched(order[next])});
            const std::size_t begin = contact.size(), full = begin + static_cast<std::size_t>(most);
            Class* from = nullptr;  // of the batch
            for (const int distance : {apart, 1}) {
                if (!from) from = first_free(batch, distance);
                if (from) take(*from, batch, distance, full);
            }
            waiting -= contact.size() - begin;
            contact.resize(begin + static_cast<std::size_t>(lanes), -1);
        }
    }

  private:
    using Bodies = std::array<int, 2>;
    struct Waiting {
        int place;  ///< in the order
        int contact;
        Bodies bodies;
    };
    /// Contacts of the window that may be in one batch, from `head` on.
    struct Class {
        int example;
        std::vector<Waiting> waiting;
        std::size_t head = 0;
    };

    Class& class_of(int c, auto&& together) {
        for (std::size_t k = 0; k < classes_.size(); ++k)
            if (together(classes_[k].example, c)) return classes_[k];
        for (Class& spent : classes_)  // a law may have as many coefficients as there are contacts
            if (spent.head == spent.waiting.size()) return spent = {c, {}}, spent;
        return classes_.emplace_back(Class{c, {}});
    }
    int& taken(int body) { return taken_[static_cast<std::size_t>(body + 1)]; }
    bool free(const Bodies& bodies, int batch, int distance) {
        const bool first = batch - taken(bodies[0]) >= distance, second = batch - taken(bodies[1]) >= distance;
        return first & second;  // no branch
    }
    /// The class of the first contact that is free.
    Class* first_free(int batch, int distance) {
        Class* first = nullptr;
        int least = (std::numeric_limits<int>::max)();
        for (Class& one : classes_)
            for (std::size_t k = one.head; k < one.waiting.size() && one.waiting[k].place < least; ++k)
                if (free(one.waiting[k].bodies, batch, distance)) first = &one, least = one.waiting[k].place;
        return first;
    }
    /// Takes the free ones until the batch is full. What is passed over comes first next time. Without branches on
    /// what is free, which no processor can predict.
    void take(Class& from, int batch, int distance, std::size_t full) {
        const std::size_t count = contact.size(), waiting = from.waiting.size();
        contact.resize(full + 1);
        if (left_.size() < waiting - from.head) left_.resize(waiting - from.head);
        std::size_t scanned = from.head, end = count, left = 0;
        for (; scanned < waiting && end < full; ++scanned) {
            const Waiting one = from.waiting[scanned];
            const bool taken = free(one.bodies, batch, distance);
            contact[end] = one.contact;
            left_[left] = one;
            end += taken;
            left += !taken;
            for (const int body : one.bodies) this->taken(taken ? body : -1) = taken && body >= 0 ? batch : -apart;
        }
        contact.resize(end);
        from.head = scanned - left;
        const auto head = from.waiting.begin() + static_cast<std::ptrdiff_t>(from.head);
        std::copy_n(left_.begin(), left, head);
        if (from.head < 1024) return;
        from.waiting.erase(from.waiting.begin(), head);  // so that memory is that of a window
        from.head = 0;
    }

    std::vector<int> taken_;  ///< of no body, and of each body: the last batch that has changed it
    std::vector<Class> classes_;
    std::vector<Waiting> left_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
