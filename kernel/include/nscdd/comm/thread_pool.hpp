/// @file
/// Threads that share loops. InProcess and Mpi deal their ranks to them.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "nscdd/comm/allowed_cores.hpp"
#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The threads live as long as the pool and wait between loops. The caller is one of them.
class ThreadPool {
  public:
    /// Starts threads - 1 others; `threads`: at least 1. Throws std::system_error where they cannot be started.
    explicit ThreadPool(int threads)
        : looks_(threads <= allowed_cores() ? 3000 : 0), thrown_(static_cast<std::size_t>(threads)) {
        try {
            for (std::size_t t = 1; t < thrown_.size(); ++t) others_.emplace_back([this, t] { work(t); });
        } catch (const std::system_error& error) {
            const std::size_t started = others_.size() + 1;
            end();
            throw std::system_error(error.code(), "only " + std::to_string(started) + " of " + std::to_string(threads) +
                                                      " threads can be started");
        } catch (...) {
            end();
            throw;
        }
    }
    /// Ends the threads and waits for them.
    ~ThreadPool() { end(); }
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    /// task(k) once for k = 0 to count-1: each thread takes a fixed share of them, one after the other, so that
    /// their data stay in its cache. If tasks throw, throws what the first of them, by k, has thrown.
    void each(std::size_t count, const std::function<void(std::size_t)>& task) {
        count_ = count;
        task_ = &task;
        busy_.store(static_cast<unsigned>(others_.size()), std::memory_order_relaxed);
        begin();
        share(0);
        for (unsigned busy; (busy = busy_.load(std::memory_order_acquire)) != 0;) await(busy_, busy);
        std::exception_ptr first;
        for (std::exception_ptr& thrown : thrown_) {
            if (!first) first = thrown;
            thrown = nullptr;
        }
        if (first) std::rethrow_exception(first);
    }

  private:
    void end() {
        task_ = nullptr;
        begin();
        for (std::thread& other : others_) other.join();
    }
    /// Waits for another value: first by polling, since a loop follows the last one within microseconds and waking a
    /// thread takes as long as a loop (std::barrier made 5,000 spheres on two threads slower than on one), then asleep.
    /// After some microseconds each look first gives the core to others: the thread waited for may need it. Asleep at
    /// once where there are more threads than cores.
    void await(const std::atomic<unsigned>& value, unsigned old) const {
        for (int look = 0; look < looks_; ++look) {
            if (value.load(std::memory_order_acquire) != old) return;
            if (look > looks_before_yield) std::this_thread::yield();
        }
        value.wait(old, std::memory_order_acquire);
    }
    void begin() {
        loop_.fetch_add(1, std::memory_order_release);
        loop_.notify_all();
    }
    void work(std::size_t thread) {
        for (unsigned done = 0;; ++done) {
            await(loop_, done);
            if (task_ == nullptr) return;
            share(thread);
            if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
        }
    }
    void share(std::size_t thread) noexcept {
        const std::size_t threads = thrown_.size();
        try {
            for (std::size_t k = count_ * thread / threads; k < count_ * (thread + 1) / threads; ++k) (*task_)(k);
        } catch (...) {
            thrown_[thread] = std::current_exception();
        }
    }

    static constexpr int looks_before_yield = 1000;
    const int looks_;
    std::atomic<unsigned> loop_{0}, busy_{0};  ///< loops begun; threads that have not ended the current one
    std::size_t count_ = 0;
    const std::function<void(std::size_t)>* task_ = nullptr;
    std::vector<std::exception_ptr> thrown_;
    std::vector<std::thread> others_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
