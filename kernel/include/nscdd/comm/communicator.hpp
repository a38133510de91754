// The communicator contract: all that Alg. 1 asks of a machine, in supersteps.
//
// A process hosts one or more ranks (all of them in-process, exactly one under MPI). Code written against the
// contract loops over the ranks it hosts, fills their buffers, and makes one collective call for all of them:
//
//   comm.each_rank([&](std::size_t k) { fill(links[k]); });
//   comm.exchange(links);
//
// Every message is a vector of doubles (indices below 2^53 travel exactly). Whatever is received is stored by
// source rank, never by order of arrival, so that sums taken over it are the same on every machine.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "nscdd/core/abi.hpp"

namespace nscdd::inline NSCDD_ABI {

using Buffer = std::vector<double>;

// A persistent two-way channel to `peer`. Both ends size `send` and `recv` before an exchange (peer's send equals
// our recv); nothing is allocated in the iteration.
struct Link {
    int peer;
    Buffer send, recv;
};
using Links = std::vector<Link>;  // of one rank, by ascending peer, at most one per peer

// Counted the same way by every communicator, summed over the ranks this process hosts. A message to oneself is
// no message. A gather or a scatter counts size-1 messages; an all-gather 2(size-1): up to rank 0 and down again.
// Bytes are those of the doubles passed in, not of any header.
struct Traffic {
    double messages = 0;
    double bytes = 0;
};

// Time this process spent inside the communicator [s]: `wait` until the slowest partner has arrived,
// `transfer` the rest. In-process ranks spend none.
struct CommSeconds {
    double wait = 0;
    double transfer = 0;
};

// Calls are coarse (one per superstep), so that a virtual call costs nothing and a solver is compiled once for all
// machines. Throws: each implementation says what.
class Communicator {
  public:
    virtual ~Communicator() = default;

    virtual int size() const = 0;
    virtual std::span<const int> ranks() const = 0;  // hosted here, ascending

    // task(k) once for each hosted rank ranks()[k], perhaps several at a time: it must not touch what is another's.
    virtual void each_rank(const std::function<void(std::size_t)>& task) {
        for (std::size_t k = 0; k < ranks().size(); ++k) task(k);
    }

    // links[k] belongs to ranks()[k]. Afterwards each recv holds what the peer put in its send.
    virtual void exchange(std::vector<Links>& links) = 0;
    // out[k][d] goes from ranks()[k] to rank d, any sizes. Returns in[k] = all that came, by ascending source.
    virtual std::vector<Buffer> route(const std::vector<std::vector<Buffer>>& out) = 0;
    // mine[k] of every rank to rank 0, where all[r] (size() buffers, sized before) receives rank r's.
    // On processes that do not host rank 0 `all` is left alone.
    virtual void gather(const std::vector<Buffer>& mine, std::vector<Buffer>& all) = 0;
    // all[r] at rank 0 to mine[k] (sized before) of every rank.
    virtual void scatter(const std::vector<Buffer>& all, std::vector<Buffer>& mine) = 0;
    // mine[k], all of one length n, to everyone: returns size()*n doubles by rank, valid until the next call.
    virtual std::span<const double> all_gather(const std::vector<Buffer>& mine) = 0;

    virtual double now() const = 0;                    // [s], the clock of this machine, real or simulated
    virtual void charge(int rank, double cost) = 0;    // hosted rank index did work worth `cost` contact updates
    virtual std::span<const double> work() const = 0;  // charged so far, per hosted rank
    virtual Traffic traffic() const = 0;
    virtual CommSeconds seconds() const = 0;
};

// Sums entry by entry over the ranks, in rank order: the only way numbers that decide anything are reduced.
inline void sum_in_rank_order(std::span<const double> all, std::span<double> sum) {
    for (double& s : sum) s = 0;
    for (std::size_t k = 0; k < all.size(); ++k) sum[k % sum.size()] += all[k];
}

}  // namespace nscdd
