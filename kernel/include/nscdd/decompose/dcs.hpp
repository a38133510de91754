#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "nscdd/decompose/scheme.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Decentralised communication scheme. Each rank trades copies with those it shares grains with. It solves its
/// elementary interface problem (10)-(11) itself (paper, 4.2).
///
/// Every holder of a grain then has all of its copies. So the elementary answers already agree, and the average (12)
/// over them needs no second exchange.
template <class M, class Gluing = ClosedForm>
class Dcs final : public CommunicationScheme<M> {
    static_assert(detail::complete_gluing<Gluing>());

  public:
    static constexpr const char* name = "dcs";                   ///< name, as in --scheme
    static constexpr const char* interface_name = Gluing::name;  ///< name, as in --interface

    void setup(std::span<Subdomain<M>> parts, Communicator& comm) override {
        fronts_.resize(parts.size());
        std::vector<Communicator::Links> links(parts.size());
        for (std::size_t k = 0; k < parts.size(); ++k) find_traded(parts[k], fronts_[k], links[k]);
        channel_ = comm.open(links);
        comm.each_rank([&](std::size_t k) { place_copies(parts[k], k); });
    }

    std::size_t pack(Subdomain<M>& part, std::size_t k) override {
        part.sweeper.put_rows(part.problem, part.interface);
        std::size_t packed = 0;
        for (std::size_t l = 0; l < fronts_[k].traded.size(); ++l) {
            double* out = channel_->send(k, l).data();
            for (const double* row : fronts_[k].traded[l]) out = std::copy_n(row, dof, out);
            packed += fronts_[k].traded[l].size();
        }
        return packed;
    }

    void start() override { channel_->start(); }

    void finish(std::span<Subdomain<M>> parts, Communicator& comm) override {
        channel_->finish();
        comm.each_rank([this, &parts, &comm](std::size_t k) {
            fronts_[k].gluing(fronts_[k].copies);
            parts[k].sweeper.read_rows(parts[k].problem, parts[k].interface);
            detail::count_work(comm, parts[k], k, Gluing::work, fronts_[k].copies.from.size());
        });
    }

  private:
    static constexpr std::size_t dof = M::dof;
    /// Gamma_E*: all copies of the grains on a subdomain's boundary.
    struct Front {
        std::vector<std::vector<const double*>> traded;  ///< per link: rows of grains, by ascending id on both sides
        std::vector<std::size_t> link_of;                ///< per peer with whom grains are traded
        Copies copies;
        Gluing gluing;
    };

    /// Finds the links of a subdomain, and the rows of grains that each carries: those of copies active in this step
    /// only.
    static void find_traded(Subdomain<M>& part, Front& front, Communicator::Links& links) {
        std::vector<std::vector<const double*>> by_peer(part.neighbours.size());
        for (const int g : part.interface)
            visit_active(part, g, [&](std::size_t peer) {
                if (peer < part.neighbours.size()) by_peer[peer].push_back(part.sweeper.row(g));
            });
        links.clear();
        front.traded.clear();
        front.link_of.assign(part.neighbours.size(), 0);
        for (std::size_t p = 0; p < by_peer.size(); ++p) {
            if (by_peer[p].empty()) continue;
            const std::size_t values = by_peer[p].size() * dof;
            front.link_of[p] = links.size();
            links.push_back({part.neighbours[p], values, values});
            front.traded.push_back(std::move(by_peer[p]));
        }
    }

    /// Calls visit(peer) for each active copy of grain g, in the order of ranks; this rank's own is neighbours.size().
    static void visit_active(const Subdomain<M>& part, int g, auto&& visit) {
        const auto grain = static_cast<std::size_t>(g);
        for (std::size_t at = part.first_replica(grain); at < part.last_replica(grain); ++at) {
            if (!part.active[at]) continue;
            const auto found = std::lower_bound(part.neighbours.begin(), part.neighbours.end(), part.replicas[at]);
            visit(part.replicas[at] == part.rank ? part.neighbours.size()
                                                 : static_cast<std::size_t>(found - part.neighbours.begin()));
        }
    }

    /// Sets the place where the velocity of each copy is read. That is the own row, or the message of a peer, which has
    /// its copies in sequence.
    void place_copies(Subdomain<M>& part, std::size_t k) {
        Front& front = fronts_[k];
        std::vector<std::size_t> taken(part.neighbours.size(), 0);  // doubles of each peer's message
        front.copies.clear(M::dof);
        for (const int g : part.interface) {
            visit_active(part, g, [&](std::size_t peer) {
                double* const own = part.sweeper.row(g);
                const bool mine = peer == part.neighbours.size();
                front.copies.to.push_back(mine ? own : nullptr);
                if (mine) return front.copies.from.push_back(own);
                front.copies.from.push_back(channel_->recv(k, front.link_of[peer]).data() + taken[peer]);
                taken[peer] += dof;
            });
            front.copies.begin.push_back(static_cast<int>(front.copies.from.size()));
            const Grain<M>& grain = part.grains[static_cast<std::size_t>(g)];
            detail::add_inverse_masses<M>(1 / grain.mass, 1 / grain.inertia, front.copies);
        }
        front.gluing.setup(front.copies);
    }

    std::vector<Front> fronts_;
    std::unique_ptr<Communicator::Channel> channel_;
};

}}  // namespace nscdd::NSCDD_ABI
