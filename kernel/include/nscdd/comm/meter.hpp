/// @file
/// Work that is counted, by kind. Simulated machines take their time from it.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Kinds of work, each with the unit in which it is counted.
enum class Work {
    sweep,          ///< contacts swept
    accelerated,    ///< contacts swept from a combination of iterates
    driven,         ///< batches with driven walls: their cost beyond their contacts, as each waits for the one before
    residual,       ///< contacts tested
    pack,           ///< copies of grains put into messages
    glue,           ///< copies of grains made to agree, in closed form
    factorised,     ///< copies of grains made to agree, by a factorised operator
    message,        ///< messages that a process sends or receives in an iteration: the cost of MPI's calls for them
    shared_message  ///< messages through memory that processes share: the cost of copying them
};

namespace detail {

/// Names of the kinds of Work, in their order, as files have them.
constexpr std::array<const char*, 9> work_names{"sweep", "accelerated", "driven",  "residual",      "pack",
                                                "glue",  "factorised",  "message", "shared_message"};

}  // namespace detail

/// The work of the ranks that a process hosts. Ranks may be charged at the same time, each by one thread.
class Meter {
  public:
    /// A function that is called for work on a rank: `count` units of a kind, on data of `bytes`. The rank goes through
    /// these data repeatedly, so their size says which cache holds them; for messages it is the size of one. A
    /// simulated machine advances its clock by the time of this work.
    using Charged = std::function<void(Work kind, double count, double bytes)>;

    /// Makes a meter for so many ranks. `charged`, if given, is called at every charge.
    explicit Meter(std::size_t ranks = 0, Meter::Charged charged = {}) : swept_(ranks), charged_(std::move(charged)) {}

    /// Charges `count` units of work of the k-th hosted rank; for `bytes` see Charged. Throws std::out_of_range where
    /// there is no such rank.
    void charge(std::size_t k, Work kind, double count, double bytes) {
        swept_.at(k) += kind == Work::sweep || kind == Work::accelerated ? count : 0;
        if (charged_) charged_(kind, count, bytes);
    }
    /// Charges a message of so many bytes that the process sends or receives.
    void charge_message(double bytes, bool shared) const {
        if (charged_) charged_(shared ? Work::shared_message : Work::message, 1, bytes);
    }
    std::span<const double> swept() const { return swept_; }  ///< contacts swept so far, of each hosted rank

  private:
    std::vector<double> swept_;
    Meter::Charged charged_;
};

}}  // namespace nscdd::NSCDD_ABI
