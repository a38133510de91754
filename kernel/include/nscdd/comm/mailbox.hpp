/// @file
/// A message between two processes, or threads, through memory that both see. It takes two copies, and no call of a
/// library.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <thread>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// One end of a way from one sender to one receiver, for messages of up to a fixed size. Two places are used in turn,
/// each a flag and behind it the doubles. The sender copies a message to a place and then counts its flag up; the
/// receiver waits for that count and copies the message out.
///
/// Nothing tells the sender that a place is free. It is when the sender, before it puts its message n, knows that the
/// receiver has taken message n - 2: two ends that put and take in turn, each to the other, know it.
class Mailbox {
  public:
    using Word = std::uint64_t;  ///< a flag, or the bits of a double
    static_assert(__atomic_always_lock_free(sizeof(Word), nullptr) && sizeof(Word) == sizeof(double));

    /// Words of memory that both ends need for messages of up to so many doubles.
    static constexpr std::size_t words(std::size_t doubles) { return 2 * place(doubles); }

    Mailbox() = default;  ///< leads nowhere, see operator bool
    /// `memory`: words(doubles) of them, at the same place for both ends, which give the same `before`: no flag has
    /// been above it. Aligned to 64 bytes, a message of up to seven doubles is in one cache line.
    Mailbox(Word* memory, std::size_t doubles, Word before)
        : places_{memory, memory + place(doubles)}, doubles_(doubles), count_(before) {}

    explicit operator bool() const { return places_[0] != nullptr; }  ///< false if it leads nowhere
    std::size_t doubles() const { return doubles_; }                  ///< the longest message

    /// The sender: the next message, of at most doubles().
    void put(std::span<const double> message) {
        Word* const at = places_[++count_ % 2];
        if (!message.empty()) std::memcpy(at + 1, message.data(), message.size_bytes());
        __atomic_store_n(at, count_, __ATOMIC_RELEASE);  // std::atomic_ref: libc++ has it from 19 on
    }
    /// The receiver: whether the next message is there.
    bool there() const { return __atomic_load_n(places_[(count_ + 1) % 2], __ATOMIC_ACQUIRE) == count_ + 1; }
    /// The receiver: waits for the next message, of which it knows the length. Other processes get the core after some
    /// microseconds, for there may be fewer cores than processes.
    void take(std::span<double> message) {
        for (int looks = 0; !there(); ++looks)
            if (looks > 2000) std::this_thread::yield();
        const Word* const at = places_[++count_ % 2];
        if (!message.empty()) std::memcpy(message.data(), at + 1, message.size_bytes());
    }

  private:
    /// Words of one place: whole cache lines, so that the ends of different mailboxes do not share one.
    static constexpr std::size_t place(std::size_t doubles) { return (doubles + 1 + 7) / 8 * 8; }

    std::array<Word*, 2> places_{};
    std::size_t doubles_ = 0;
    Word count_ = 0;  ///< of the last message put or taken
};

}}}  // namespace nscdd::NSCDD_ABI::detail
