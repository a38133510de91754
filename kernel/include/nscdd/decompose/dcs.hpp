// Decentralised communication scheme: each rank trades copies with those it shares grains with, and solves its
// elementary interface problem (10)-(11) itself (paper, 4.2).
//
// Every holder of a grain has all of its copies then, so the elementary answers already agree and the average (12)
// over them needs no second exchange. Driven walls, which may touch all subdomains, go through a small all-gather.
#pragma once

#include "nscdd/decompose/gluing.hpp"
#include "nscdd/decompose/scheme.hpp"

namespace nscdd::inline NSCDD_ABI {

template <class M, class Gluing = ClosedForm>
class Dcs final : public CommunicationScheme<M> {
  public:
    static constexpr const char* name = "dcs";
    static constexpr const char* interface_name = Gluing::name;

    void setup(const std::vector<Subdomain<M>>& parts, Communicator& comm) override {
        fronts_.resize(parts.size());
        links_.resize(parts.size());
        speeds_.resize(parts.size());
        for (std::size_t k = 0; k < parts.size(); ++k) set_up(parts[k], links_[k], fronts_[k]);
        set_up_walls(parts[0], static_cast<std::size_t>(comm.size()));
    }

    void glue(std::vector<Subdomain<M>>& parts, Communicator& comm) override {
        comm.each_rank([this, &parts](std::size_t k) { pack(parts[k], k); });
        comm.exchange(links_);
        comm.each_rank([this, &parts](std::size_t k) { unpack(parts[k], k); });
        glue_walls(parts, comm);
    }

  private:
    static constexpr std::size_t dof = M::dof;
    struct Traded {
        int grain;         // local
        std::size_t copy;  // the peer's copy in velocities
    };
    struct Front {  // Gamma_E*: all copies of the grains on one subdomain's boundary
        Copies copies;
        Buffer velocities;
        std::vector<std::size_t> own;             // this rank's copy of each interface grain
        std::vector<std::vector<Traded>> traded;  // per link, by ascending id on both sides
        Gluing gluing;
    };

    void pack(const Subdomain<M>& part, std::size_t k) {
        for (std::size_t l = 0; l < links_[k].size(); ++l) {
            double* out = links_[k][l].send.data();
            for (const Traded& t : fronts_[k].traded[l]) {
                const auto& v = part.problem.bodies[static_cast<std::size_t>(t.grain)].v;
                out = std::copy(v.data(), v.data() + dof, out);
            }
        }
    }

    void unpack(Subdomain<M>& part, std::size_t k) {
        Front& front = fronts_[k];
        for (std::size_t l = 0; l < links_[k].size(); ++l) {
            const double* in = links_[k][l].recv.data();
            for (const Traded& t : front.traded[l]) {
                std::copy(in, in + dof, front.velocities.data() + t.copy * dof);
                in += dof;
            }
        }
        for (std::size_t s = 0; s < part.interface.size(); ++s) {
            const auto& v = part.problem.bodies[static_cast<std::size_t>(part.interface[s])].v;
            std::copy(v.data(), v.data() + dof, front.velocities.data() + front.own[s] * dof);
        }
        front.gluing(front.copies, front.velocities);
        for (std::size_t s = 0; s < part.interface.size(); ++s) {
            auto& v = part.problem.bodies[static_cast<std::size_t>(part.interface[s])].v;
            const double* in = front.velocities.data() + front.own[s] * dof;
            std::copy(in, in + dof, v.data());
        }
    }

    static void set_up(const Subdomain<M>& part, Links& links, Front& front) {
        front.copies.clear(M::dof);
        front.own.clear();
        std::vector<std::vector<Traded>> by_rank(part.links.size());
        std::size_t copy = 0;
        for (int g : part.interface) {
            const auto grain = static_cast<std::size_t>(g);
            for (std::size_t s = part.first_sharer(grain); s < part.last_sharer(grain); ++s) {
                if (!part.active[s]) continue;
                if (part.sharers[s] == part.rank) {
                    front.own.push_back(copy++);
                    continue;
                }
                const auto link = std::find_if(part.links.begin(), part.links.end(),
                                               [&](const Link& l) { return l.peer == part.sharers[s]; });
                by_rank[static_cast<std::size_t>(link - part.links.begin())].push_back({g, copy++});
            }
            front.copies.begin.push_back(static_cast<int>(copy));
            for (std::size_t d = 0; d < dof; ++d)
                front.copies.inverse_mass.push_back(
                    1 / (d < M::dim ? part.grains[grain].mass : part.grains[grain].inertia));
        }
        front.velocities.resize(copy * dof);
        front.gluing.setup(front.copies);
        links.clear();
        front.traded.clear();
        for (std::size_t l = 0; l < by_rank.size(); ++l) {
            if (by_rank[l].empty()) continue;
            const std::size_t values = by_rank[l].size() * dof;
            links.push_back({part.links[l].peer, Buffer(values), Buffer(values)});
            front.traded.push_back(std::move(by_rank[l]));
        }
    }

    void set_up_walls(const Subdomain<M>& part, std::size_t size) {
        wall_copies_.clear(1);
        wall_places_.clear();
        wall_of_.clear();
        const std::size_t walls = part.problem.driven_walls() ? part.problem.walls.size() : 0;
        for (std::size_t w = 0; w < walls; ++w) {
            const std::size_t before = wall_places_.size();
            for (std::size_t r = 0; r < size; ++r)
                if (part.wall_active[w * size + r]) wall_places_.push_back(r * walls + w);
            if (wall_places_.size() == before) continue;  // touches nothing: moves freely
            wall_copies_.begin.push_back(static_cast<int>(wall_places_.size()));
            wall_copies_.inverse_mass.push_back(part.problem.walls[w].inv_mass / part.problem.wall_multiplicity[w]);
            wall_of_.push_back(w);
        }
        wall_speeds_.resize(wall_places_.size());
        wall_gluing_.setup(wall_copies_);
    }

    void glue_walls(std::vector<Subdomain<M>>& parts, Communicator& comm) {
        if (wall_of_.empty()) return;  // the same on every rank
        for (std::size_t k = 0; k < parts.size(); ++k) {
            speeds_[k].clear();
            for (const auto& wall : parts[k].problem.walls) speeds_[k].push_back(wall.speed);
        }
        const std::span<const double> all = comm.all_gather(speeds_);
        for (std::size_t c = 0; c < wall_places_.size(); ++c) wall_speeds_[c] = all[wall_places_[c]];
        wall_gluing_(wall_copies_, wall_speeds_);
        for (auto& part : parts)
            for (std::size_t b = 0; b < wall_of_.size(); ++b)
                part.problem.walls[wall_of_[b]].speed = wall_speeds_[static_cast<std::size_t>(wall_copies_.begin[b])];
    }

    std::vector<Links> links_;  // with copies that are active in this step only
    std::vector<Front> fronts_;
    std::vector<Buffer> speeds_;
    Copies wall_copies_;
    std::vector<std::size_t> wall_places_, wall_of_;
    Buffer wall_speeds_;
    Gluing wall_gluing_;
};

}  // namespace nscdd
