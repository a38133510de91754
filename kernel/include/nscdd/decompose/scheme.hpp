// What makes the copies of shared grains agree between two sweeps: Ccs or Dcs. Behind an interface, so that Alg. 1 is
// compiled once for all of them: a call costs nothing beside what it sends.
#pragma once

#include <span>

#include "nscdd/decompose/gluing.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd::inline NSCDD_ABI {

// Velocities of interface grains are read from the rows of the subdomains' sweepers and written back there.
template <class M>
class CommunicationScheme {
  public:
    using Model = M;  // dimension and contact law of the scene
    virtual ~CommunicationScheme() = default;

    // Once per step, after split_masses() and when the sweepers are loaded. Collective.
    virtual void setup(std::span<Subdomain<M>> parts, Communicator& comm) = 0;
    // The velocities of the k-th hosted rank's interface grains into its messages; returns how many. Not collective.
    virtual std::size_t pack(Subdomain<M>& part, std::size_t k) = 0;
    // Sends them. Until finish() the interface grains are left alone, others may be swept.
    virtual void start() = 0;
    // From velocities of all active copies, which differ, to velocities on which they agree. Collective.
    virtual void finish(std::span<Subdomain<M>> parts, Communicator& comm) = 0;
};

// Work on what the k-th hosted rank's sweeper holds.
template <class M>
void charge(Communicator& comm, const Subdomain<M>& part, std::size_t k, Work kind, std::size_t count) {
    comm.charge(static_cast<int>(k), kind, static_cast<double>(count), static_cast<double>(part.sweeper.bytes()));
}

// The velocities of all hosted ranks' interface grains into their messages.
template <class M>
void pack(CommunicationScheme<M>& scheme, std::span<Subdomain<M>> parts, Communicator& comm) {
    comm.each_rank([&](std::size_t k) { charge(comm, parts[k], k, Work::pack, scheme.pack(parts[k], k)); });
}

// All at once, where nothing is swept meanwhile. Collective.
template <class M>
void glue(CommunicationScheme<M>& scheme, std::span<Subdomain<M>> parts, Communicator& comm) {
    pack(scheme, parts, comm);
    scheme.start();
    scheme.finish(parts, comm);
}

namespace detail {

// Of the whole grain, for each of its degrees of freedom.
template <class M>
void add_inverse_masses(double inverse_mass, double inverse_inertia, Copies& copies) {
    for (int d = 0; d < M::dof; ++d) copies.inverse_mass.push_back(d < M::dim ? inverse_mass : inverse_inertia);
}

}  // namespace detail

}  // namespace nscdd
