// Centralised communication scheme: rank 0 gathers all copies, solves the interface problem, scatters (paper, 4.1).
#pragma once

#include <algorithm>
#include <tuple>

#include "nscdd/decompose/gluing.hpp"
#include "nscdd/decompose/scheme.hpp"

namespace nscdd::inline NSCDD_ABI {

template <class M, class Gluing = Factorised<>>
class Ccs final : public CommunicationScheme<M> {
  public:
    static constexpr const char* name = "ccs";
    static constexpr const char* interface_name = Gluing::name;

    // After split_masses(): tells rank 0 which copies there are.
    void setup(const std::vector<Subdomain<M>>& parts, Communicator& comm) override {
        std::vector<std::vector<Buffer>> out(parts.size(), std::vector<Buffer>(static_cast<std::size_t>(comm.size())));
        mine_.resize(parts.size());
        walls_ = 0;
        for (std::size_t k = 0; k < parts.size(); ++k) {
            for (int g : parts[k].interface) {
                const Grain<M>& grain = parts[k].grains[static_cast<std::size_t>(g)];
                out[k][0].insert(out[k][0].end(), {double(grain.id), double(parts[k].rank), 1 / grain.mass});
                out[k][0].push_back(M::friction ? 1 / grain.inertia : 0);
            }
            if (parts[k].problem.driven_walls()) walls_ = parts[k].problem.walls.size();
            mine_[k].resize(parts[k].interface.size() * dof + walls_);
        }
        const std::vector<Buffer> told = comm.route(out);
        all_.clear();
        if (comm.ranks()[0] == 0) set_up_root(parts[0], told[0], static_cast<std::size_t>(comm.size()));
    }

    void glue(std::vector<Subdomain<M>>& parts, Communicator& comm) override {
        for (std::size_t k = 0; k < parts.size(); ++k) {
            double* out = mine_[k].data();
            for (int g : parts[k].interface) {
                const auto& v = parts[k].problem.bodies[static_cast<std::size_t>(g)].v;
                out = std::copy(v.data(), v.data() + dof, out);
            }
            for (std::size_t w = 0; w < walls_; ++w) *out++ = parts[k].problem.walls[w].speed;
        }
        comm.gather(mine_, all_);
        if (!all_.empty()) solve();
        comm.scatter(all_, mine_);
        for (std::size_t k = 0; k < parts.size(); ++k) {
            const double* in = mine_[k].data();
            for (int g : parts[k].interface) {
                auto& v = parts[k].problem.bodies[static_cast<std::size_t>(g)].v;
                std::copy(in, in + dof, v.data());
                in += dof;
            }
            for (std::size_t w = 0; w < walls_; ++w) parts[k].problem.walls[w].speed = *in++;
        }
    }

  private:
    static constexpr std::size_t dof = M::dof;
    struct Place {
        std::size_t rank, offset;  // of a copy in all_
    };

    void set_up_root(const Subdomain<M>& part, const Buffer& told, std::size_t size) {
        std::vector<std::tuple<int, std::size_t, std::size_t>> entries;  // id, rank, record
        for (std::size_t p = 0; p < told.size(); p += 4)
            entries.emplace_back(static_cast<int>(told[p]), static_cast<std::size_t>(told[p + 1]), p);
        all_.assign(size, Buffer{});
        places_.clear();
        copies_.clear(M::dof);
        std::stable_sort(entries.begin(), entries.end());
        std::vector<std::size_t> taken(size, 0);  // each rank lists its grains by ascending id as well
        for (std::size_t e = 0; e < entries.size(); ++e) {
            const auto& [id, rank, record] = entries[e];
            places_.push_back({rank, taken[rank]++ * dof});
            if (e + 1 == entries.size() || std::get<0>(entries[e + 1]) != id) {
                copies_.begin.push_back(static_cast<int>(e) + 1);
                for (std::size_t d = 0; d < dof; ++d)
                    copies_.inverse_mass.push_back(told[record + (d < M::dim ? 2 : 3)]);
            }
        }
        velocities_.resize(entries.size() * dof);
        gluing_.setup(copies_);

        wall_places_.clear();
        wall_copies_.clear(1);
        wall_of_.clear();
        for (std::size_t w = 0; w < walls_; ++w) {
            const std::size_t before = wall_places_.size();
            for (std::size_t r = 0; r < size; ++r)
                if (part.wall_active[w * size + r]) wall_places_.push_back({r, taken[r] * dof + w});
            if (wall_places_.size() == before) continue;  // touches nothing: moves freely
            wall_copies_.begin.push_back(static_cast<int>(wall_places_.size()));
            wall_copies_.inverse_mass.push_back(part.problem.walls[w].inv_mass / part.problem.wall_multiplicity[w]);
            wall_of_.push_back(w);
        }
        wall_speeds_.resize(wall_places_.size());
        wall_gluing_.setup(wall_copies_);
        for (std::size_t r = 0; r < size; ++r) all_[r].resize(taken[r] * dof + walls_);
        taken_ = taken;
    }

    void solve() {
        for (std::size_t c = 0; c < places_.size(); ++c) {
            const auto from = all_[places_[c].rank].begin() + static_cast<std::ptrdiff_t>(places_[c].offset);
            std::copy_n(from, dof, velocities_.begin() + static_cast<std::ptrdiff_t>(c * dof));
        }
        gluing_(copies_, velocities_);
        for (std::size_t c = 0; c < places_.size(); ++c) {
            const auto from = velocities_.begin() + static_cast<std::ptrdiff_t>(c * dof);
            std::copy_n(from, dof, all_[places_[c].rank].begin() + static_cast<std::ptrdiff_t>(places_[c].offset));
        }
        for (std::size_t c = 0; c < wall_places_.size(); ++c)
            wall_speeds_[c] = all_[wall_places_[c].rank][wall_places_[c].offset];
        wall_gluing_(wall_copies_, wall_speeds_);
        for (std::size_t b = 0; b < wall_of_.size(); ++b)  // every rank is told, also those that do not touch it
            for (std::size_t r = 0; r < all_.size(); ++r)
                all_[r][taken_[r] * dof + wall_of_[b]] = wall_speeds_[static_cast<std::size_t>(wall_copies_.begin[b])];
    }

    std::vector<Buffer> mine_, all_;  // all_ is empty where rank 0 is not hosted
    std::size_t walls_ = 0;           // that have a speed to agree on: none where none is driven
    Copies copies_, wall_copies_;
    std::vector<Place> places_, wall_places_;
    std::vector<std::size_t> wall_of_, taken_;
    Buffer velocities_, wall_speeds_;
    Gluing gluing_, wall_gluing_;
};

}  // namespace nscdd
