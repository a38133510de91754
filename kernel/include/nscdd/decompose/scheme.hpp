// What makes the copies of shared grains agree between two sweeps: Ccs or Dcs. Behind an interface, so that Alg. 1 is
// compiled once for all of them: a call costs nothing beside what it sends.
#pragma once

#include <vector>

#include "nscdd/decompose/subdomain.hpp"

namespace nscdd::inline NSCDD_ABI {

template <class M>
class CommunicationScheme {
  public:
    using Model = M;
    virtual ~CommunicationScheme() = default;

    // Once per step, after split_masses().
    virtual void setup(const std::vector<Subdomain<M>>& parts, Communicator& comm) = 0;
    // Velocities of all active copies, which differ, to velocities on which they agree.
    virtual void glue(std::vector<Subdomain<M>>& parts, Communicator& comm) = 0;
};

}  // namespace nscdd
