#pragma once

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// The turn to call a communicator. One thread has it at a time, and no task of each_rank() has it.
class Turn {
  public:
    /// An object that has the turn while it lives. Its thread may take the turn again, but tasks of each_rank() may
    /// not.
    class Hold {
      public:
        /// Takes the turn. With `tasks`, only tasks of each_rank() run until the end of this object. Throws
        /// std::logic_error, naming `call`, for a thread or task that may not have the turn.
        Hold(Turn& turn, const char* call, bool tasks = false)
            : turn_(turn), first_(turn.take(call)), tasks_(turn.tasks_ = tasks) {}
        /// Gives the turn back.
        ~Hold() {
            if (tasks_) turn_.tasks_ = false;
            if (first_) turn_.owner_.store({}, std::memory_order_release);
        }
        Hold(const Hold&) = delete;
        Hold& operator=(const Hold&) = delete;

      private:
        Turn& turn_;
        const bool first_, tasks_;
    };

  private:
    /// Takes the turn; returns whether the thread had none before.
    bool take(const char* call) {
        std::thread::id owner;
        const bool first = owner_.compare_exchange_strong(owner, std::this_thread::get_id(), std::memory_order_acquire);
        if ((!first && owner != std::this_thread::get_id()) || tasks_)
            throw std::logic_error(
                std::string(call) +
                ": a communicator is called by one thread at a time, and not by tasks of each_rank()");
        return first;
    }

    std::atomic<std::thread::id> owner_{std::thread::id()};
    bool tasks_ = false;  ///< read and written by the owner alone
};

}}  // namespace nscdd::NSCDD_ABI
