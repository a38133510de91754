// What makes the copies of shared grains agree between two sweeps: Ccs or Dcs. Behind an interface, so that Alg. 1 is
// compiled once for all of them: a call costs nothing beside what it sends.
#pragma once

#include <vector>

#include "nscdd/decompose/gluing.hpp"
#include "nscdd/decompose/subdomain.hpp"

namespace nscdd::inline NSCDD_ABI {

// Velocities of interface grains are read from the subdomains' sweepers and written back there (Sweeper::velocity).
template <class M>
class CommunicationScheme {
  public:
    using Model = M;
    virtual ~CommunicationScheme() = default;

    // Once per step, after split_masses() and when the sweepers are loaded. Collective.
    virtual void setup(const std::vector<Subdomain<M>>& parts, Communicator& comm) = 0;
    // The velocities of the k-th hosted rank's interface grains into its messages; returns how many. Not collective.
    virtual std::size_t pack(const Subdomain<M>& part, std::size_t k) = 0;
    // Sends them. Until finish() the interface grains are left alone, others may be swept.
    virtual void start() = 0;
    // From velocities of all active copies, which differ, to velocities on which they agree. Collective.
    virtual void finish(std::vector<Subdomain<M>>& parts, Communicator& comm) = 0;
};

// Work on what the k-th hosted rank's sweeper holds.
template <class M>
void charge(Communicator& comm, const Subdomain<M>& part, std::size_t k, Work kind, std::size_t count) {
    comm.charge(static_cast<int>(k), kind, static_cast<double>(count), static_cast<double>(part.sweeper.bytes()));
}

// All at once, where nothing is swept meanwhile. Collective.
template <class M>
void glue(CommunicationScheme<M>& scheme, std::vector<Subdomain<M>>& parts, Communicator& comm) {
    comm.each_rank([&](std::size_t k) { charge(comm, parts[k], k, Work::pack, scheme.pack(parts[k], k)); });
    scheme.start();
    scheme.finish(parts, comm);
}

namespace detail {

// Velocities of a subdomain's interface grains, dof doubles each: from its sweeper, and back.
template <class M>
void read_interface(const Subdomain<M>& part, double* to) {
    for (const int g : part.interface) {
        const typename M::Velocity v = part.sweeper.velocity(part.problem, g);
        to = std::copy(v.data(), v.data() + M::dof, to);
    }
}
template <class M>
void write_interface(Subdomain<M>& part, const double* from) {
    for (const int g : part.interface) {
        part.sweeper.set_velocity(part.problem, g, Eigen::Map<const typename M::Velocity>(from));
        from += M::dof;
    }
}

// Of the whole grain, for each of its degrees of freedom.
template <class M>
void add_inverse_masses(double inverse_mass, double inverse_inertia, Copies& copies) {
    for (int d = 0; d < M::dof; ++d) copies.inverse_mass.push_back(d < M::dim ? inverse_mass : inverse_inertia);
}

}  // namespace detail

}  // namespace nscdd
