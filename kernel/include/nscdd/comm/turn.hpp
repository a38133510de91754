#pragma once

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Whose turn it is to call a communicator: one thread's at a time, and no task's of each_rank().
class Turn {
  public:
    /// Has the turn while it lives. The thread that has it may take it again, but for tasks of each_rank().
    class Hold {
      public:
        /// `tasks`: until the end of this only tasks of each_rank() run. Throws std::logic_error, naming `call`, for a
        /// thread or task whose turn it is not.
        Hold(Turn& turn, const char* call, bool tasks = false)
            : turn_(turn), first_(turn.take(call)), tasks_(turn.tasks_ = tasks) {}
        /// Gives back what it has taken.
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
    /// Whether the thread had no turn before.
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
