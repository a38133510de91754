/// @file
/// How many cores a process may use.
#pragma once

#ifdef __linux__
#include <sched.h>
#endif

#include <thread>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Cores that the calling thread may use, of which a launcher may leave it one; those of the machine, or 0, where the
/// system does not say.
inline int allowed_cores() {
#ifdef __linux__
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0) return CPU_COUNT(&set);
#endif
    return static_cast<int>(std::thread::hardware_concurrency());
}

}}}  // namespace nscdd::NSCDD_ABI::detail
