#pragma once

#include <algorithm>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "nscdd/decompose/scheme.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Centralised communication scheme. Rank 0 gathers all copies, solves the interface problem, and scatters (paper,
/// 4.1).
template <class M, class Gluing = Factorised<>>
class Ccs final : public CommunicationScheme<M> {
    static_assert(detail::complete_gluing<Gluing>());

  public:
    static constexpr const char* name = "ccs";                   ///< name, as in --scheme
    static constexpr const char* interface_name = Gluing::name;  ///< name, as in --interface

    /// Tells rank 0 which copies there are.
    void setup(std::span<Subdomain<M>> parts, Communicator& comm) override {
        std::vector<Communicator::Outbox> out(parts.size());
        std::vector<Communicator::Links> up(parts.size()), down(parts.size());
        linked_.assign(parts.size(), false);
        for (std::size_t k = 0; k < parts.size(); ++k) {
            for (int g : parts[k].interface) {
                const Grain<M>& grain = parts[k].grains[static_cast<std::size_t>(g)];
                out[k][0].insert(out[k][0].end(), {double(grain.id), double(parts[k].rank), 1 / grain.mass});
                out[k][0].push_back(M::friction ? 1 / grain.inertia : 0);
            }
            const std::size_t values = parts[k].interface.size() * dof;
            linked_[k] = values > 0;
            if (!linked_[k]) continue;
            up[k].push_back({0, values, 0});
            down[k].push_back({0, 0, values});
        }
        const std::vector<Buffer> told = comm.route(out);
        root_ = comm.ranks()[0] == 0;
        if (root_) link_root(told[0], up[0], down[0]);
        up_ = comm.open(up);
        down_ = comm.open(down);
        up_->count_as(Communicator::Operation::gather);
        down_->count_as(Communicator::Operation::scatter);
        if (root_) set_up_root(told[0], up[0]);
    }

    std::size_t pack(Subdomain<M>& part, std::size_t k) override {
        part.sweeper.put_rows(part.problem, part.interface);
        double* out = linked_[k] ? up_->send(k, 0).data() : nullptr;
        for (const int g : part.interface) out = std::copy_n(part.sweeper.row(g), dof, out);
        return part.interface.size();
    }

    void start() override { up_->start(); }

    void finish(std::span<Subdomain<M>> parts, Communicator& comm) override {
        up_->finish();
        if (root_) {
            gluing_(copies_);
            detail::count_work(comm, parts[0], 0, Gluing::work, copies_.from.size());
        }
        down_->start();
        down_->finish();
        comm.each_rank([this, &parts, &comm](std::size_t k) {
            Subdomain<M>& part = parts[k];
            const double* from = linked_[k] ? down_->recv(k, 0).data() : nullptr;
            for (const int g : part.interface) std::copy_n(std::exchange(from, from + dof), dof, part.sweeper.row(g));
            part.sweeper.read_rows(part.problem, part.interface);
            detail::count_work(comm, part, k, Work::pack, part.interface.size());  // the way back from a message
        });
    }

  private:
    static constexpr std::size_t dof = M::dof, record = 4;  ///< id, rank, inverse mass and inertia of a copy

    /// Rank 0 has a link with each rank that has a copy; its link with itself is the first.
    static void link_root(const Buffer& told, Communicator::Links& up, Communicator::Links& down) {
        for (std::size_t p = 0; p < told.size(); p += record) {
            const int rank = static_cast<int>(told[p + 1]);
            if (up.empty() || up.back().peer != rank) {  // messages come by ascending rank
                up.push_back({rank});
                down.push_back({rank});
            }
            if (rank == 0) continue;  // the link with itself has both ends already
            up.back().recv += dof;
            down.back().send += dof;
        }
        if (!up.empty() && up[0].peer == 0) up[0].recv = up[0].send, down[0].send = down[0].recv;
    }

    void set_up_root(const Buffer& told, const Communicator::Links& up) {
        std::vector<std::tuple<int, std::size_t, std::size_t>> entries;  // id, link, record
        for (std::size_t p = 0, link = 0; p < told.size(); p += record) {
            while (up[link].peer != static_cast<int>(told[p + 1])) ++link;
            entries.emplace_back(static_cast<int>(told[p]), link, p);
        }
        std::stable_sort(entries.begin(), entries.end());
        copies_.clear(M::dof);
        std::vector<std::size_t> taken(up.size(), 0);  // each rank lists its grains by ascending id as well
        for (std::size_t e = 0; e < entries.size(); ++e) {
            const auto& [id, link, at] = entries[e];
            copies_.from.push_back(up_->recv(0, link).data() + taken[link]);
            copies_.to.push_back(down_->send(0, link).data() + taken[link]);
            taken[link] += dof;
            if (e + 1 < entries.size() && std::get<0>(entries[e + 1]) == id) continue;
            copies_.begin.push_back(static_cast<int>(e) + 1);
            detail::add_inverse_masses<M>(told[at + 2], told[at + 3], copies_);
        }
        gluing_.setup(copies_);
    }

    std::vector<char> linked_;  ///< per hosted rank: 1 if it has a copy
    bool root_ = false;         ///< true where rank 0 is hosted
    std::unique_ptr<Communicator::Channel> up_, down_;
    Copies copies_;  ///< on rank 0
    Gluing gluing_;
};

}}  // namespace nscdd::NSCDD_ABI
