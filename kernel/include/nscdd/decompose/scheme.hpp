/// @file
/// Schemes that make the copies of shared grains agree between two sweeps: Ccs or Dcs. They are behind an interface, so
/// Alg. 1 is compiled once for all of them. A virtual call costs nothing beside its messages.
#pragma once

#include <concepts>
#include <span>
#include <type_traits>

#include "nscdd/decompose/gluing.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A scheme of communication. It reads velocities of interface grains from the rows of the subdomains' sweepers, and
/// writes them back there.
template <class M>
class CommunicationScheme {
  public:
    using Model = M;  ///< dimension and contact law of the scene
    virtual ~CommunicationScheme() = default;

    /// Called once per step, after split_masses() and when the sweepers are loaded. Collective.
    virtual void setup(std::span<Subdomain<M>> parts, Communicator& comm) = 0;
    /// Writes the velocities of the k-th hosted rank's interface grains into its messages; returns how many. Not
    /// collective.
    virtual std::size_t pack(Subdomain<M>& part, std::size_t k) = 0;
    /// Sends the messages. Until finish() contacts of interface grains must not be swept; others may be.
    virtual void start() = 0;
    /// Turns the velocities of all active copies, which differ, into velocities on which they agree. Collective.
    virtual void finish(std::span<Subdomain<M>> parts, Communicator& comm) = 0;
};

namespace detail {

/// A scheme for by_nscdd(): Ccs, Dcs, or a class of your own derived from `CommunicationScheme<M>`. One is made without
/// arguments for each solve.
template <class S>
concept GluingScheme = requires { typename S::Model; } &&
                       std::derived_from<S, CommunicationScheme<typename S::Model>> && std::default_initializable<S>;

/// The model of a scheme. Stops the compiler with a line for what S lacks to be one.
template <class S>
struct ModelOf {
    static constexpr bool derived = requires { requires std::derived_from<S, CommunicationScheme<typename S::Model>>; };
    static_assert(derived, "nscdd: a scheme of gluing is a class derived from CommunicationScheme<M>, as Dcs<M> is");
    static_assert(!derived || !std::is_abstract_v<S>,
                  "nscdd: a scheme of gluing needs `setup`, `pack`, `start` and `finish` of CommunicationScheme<M>");
    static_assert(!derived || std::is_abstract_v<S> || std::default_initializable<S>,
                  "nscdd: a scheme of gluing must be made without arguments");
    using type = typename S::Model;
};

/// Counts work on the data of the k-th hosted rank's sweeper.
template <class M>
void count_work(Communicator& comm, const Subdomain<M>& part, std::size_t k, Work kind, std::size_t units) {
    comm.meter().charge(k, kind, double(units), double(part.sweeper.bytes()));
}

/// Calls pack() for all hosted ranks.
template <class M>
void pack(CommunicationScheme<M>& scheme, std::span<Subdomain<M>> parts, Communicator& comm) {
    comm.each_rank([&](std::size_t k) { count_work(comm, parts[k], k, Work::pack, scheme.pack(parts[k], k)); });
}

/// Calls pack(), start() and finish(), where nothing is swept meanwhile. Collective.
template <class M>
void glue(CommunicationScheme<M>& scheme, std::span<Subdomain<M>> parts, Communicator& comm) {
    pack(scheme, parts, comm);
    scheme.start();
    scheme.finish(parts, comm);
}

/// Appends the inverse mass or inertia of the whole grain, for each of its degrees of freedom.
template <class M>
void add_inverse_masses(double inverse_mass, double inverse_inertia, Copies& copies) {
    for (int d = 0; d < M::dof; ++d) copies.inverse_mass.push_back(d < M::dim ? inverse_mass : inverse_inertia);
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
