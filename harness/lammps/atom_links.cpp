#include "atom_links.hpp"

#include <cmath>

namespace nscdd {
namespace {

using M = AtomLinks::M;
using Serialise = detail::Serialise<M>;

// Sums over all ranks.
template <std::size_t n>
std::array<double, n> sums(const Simulation<M>& simulation, const std::array<double, n>& mine) {
    const auto all = simulation.comm().reduce({Buffer(mine.begin(), mine.end())}, n);
    std::array<double, n> out;
    std::copy_n(all.begin(), n, out.begin());
    return out;
}

// The simulation is ours and not const. Between two steps it takes loads and velocities as they are in its lists.
std::vector<Grain<M>>& writable(Simulation<M>& simulation) {
    return const_cast<std::vector<Grain<M>>&>(simulation.parts()[0].grains);
}

bool same_motion(const Grain<M>& a, const Grain<M>& b) { return a.velocity == b.velocity && a.load == b.load; }

// Whether no more than velocity and load are others.
bool same_body(const Grain<M>& a, const Grain<M>& b, const Cell<M>& cell) {
    return a.radius == b.radius && a.mass == b.mass && a.material == b.material &&
           cell.apart(a.position, b.position).norm() <= 1e-9 * a.radius;  // but for the round-off of images
}

}  // namespace

Grain<M> AtomLinks::grain_of(int atom) const {
    const auto a = static_cast<std::size_t>(atom);
    Grain<M> grain;
    grain.id = atom_->tag[a];
    grain.material = atom_->type[a] - 1;
    grain.radius = atom_->radius[a];
    grain.mass = atom_->rmass[a];
    grain.inertia = grain.mass * (grain.radius * grain.radius) * 0.4;
    for (int d = 0; d < 3; ++d) {
        grain.position[d] = atom_->x[a][d];
        grain.velocity[d] = atom_->v[a][d];
        grain.velocity[3 + d] = atom_->omega[a][d];
        grain.load[d] = force_unit_ * atom_->f[a][d];
        grain.load[3 + d] = force_unit_ * atom_->torque[a][d];
    }
    if (!(atom_->mask[a] & group_bit_)) fix(grain);
    return grain;
}

std::vector<Grain<M>> AtomLinks::grains() const {
    std::vector<Grain<M>> all;
    for (int a = 0; a < atom_->nlocal; ++a) all.push_back(grain_of(a));
    return all;
}

bool AtomLinks::renew(const Simulation<M>& simulation) {
    const auto& grains = simulation.parts()[0].grains;
    grain_places_.clear();
    for (std::size_t g = 0; g < grains.size(); ++g) grain_places_[grains[g].id] = static_cast<int>(g);
    here_.clear();
    alone_.clear();
    for (int a = 0; a < atom_->nlocal; ++a) {
        const auto found = grain_places_.find(atom_->tag[a]);
        here_.push_back(found == grain_places_.end() ? -1 : found->second);
        if (here_.back() < 0) alone_[atom_->tag[a]] = {a, {}};
    }
    const auto [atoms, alone] = sums<2>(simulation, {double(atom_->nlocal), double(alone_.size())});
    all_here_ = alone == 0;
    holders_.clear();
    told_.clear();
    if (all_here_) return atoms == double(simulation.grain_count());
    ask(simulation);
    std::vector<char> held(here_.size());
    for (const Away& holder : holders_) held[static_cast<std::size_t>(holder.place)] = 1;
    double lost = 0;
    for (const auto& [id, atom] : alone_) lost += !held[static_cast<std::size_t>(atom.place)];
    return sums<1>(simulation, {lost})[0] == 0 && atoms == double(simulation.grain_count());
}

// Atoms that are alone and grains whose atom is elsewhere meet at the rank id % size, which tells each of the other.
void AtomLinks::ask(const Simulation<M>& simulation) {
    enum What { an_atom, a_grain, a_speaker };  // a speaker: the grain that stands for its copies
    Communicator& comm = simulation.comm();
    const Subdomain<M>& part = simulation.parts()[0];
    std::vector<char> met(part.grains.size());
    for (const int g : here_)
        if (g >= 0) met[static_cast<std::size_t>(g)] = 1;
    std::vector<Communicator::Outbox> asked(1), answers(1);
    const auto put = [](int id, int rank, What what, Buffer& to) {
        to.insert(to.end(), {double(id), double(rank), double(what)});
    };
    const auto read = [](const Buffer& from, auto&& each) {
        for (std::size_t p = 0; p < from.size(); p += 3)
            each(static_cast<int>(from[p]), static_cast<int>(from[p + 1]), static_cast<What>(int(from[p + 2])));
    };
    for (const auto& [id, atom] : alone_) put(id, part.rank, an_atom, asked[0][id % comm.size()]);
    for (std::size_t g = 0; g < met.size(); ++g)
        if (const int id = part.grains[g].id; !met[g])
            put(id, part.rank, part.primary(g) ? a_speaker : a_grain, asked[0][id % comm.size()]);
    const Buffer here = comm.route(asked)[0];
    std::unordered_map<int, int> atoms;
    read(here, [&](int id, int rank, What what) {
        if (what == an_atom) atoms[id] = rank;
    });
    read(here, [&](int id, int rank, What what) {
        const auto atom = atoms.find(id);
        if (what == an_atom || atom == atoms.end()) return;
        put(id, rank, a_grain, answers[0][atom->second]);
        if (what == a_speaker) put(id, atom->second, an_atom, answers[0][rank]);
    });
    read(comm.route(answers)[0], [&](int id, int rank, What what) {
        if (what == an_atom)
            told_.push_back({grain_places_.at(id), rank});
        else
            holders_.push_back({alone_.at(id).place, rank});
    });
}

bool AtomLinks::give(Simulation<M>& simulation) const {
    const Subdomain<M>& part = simulation.parts()[0];
    std::vector<Grain<M>>& grains = writable(simulation);
    std::vector<Communicator::Outbox> out(1);
    double others = 0;
    for (int a = 0; a < atom_->nlocal; ++a) {
        if (here_[static_cast<std::size_t>(a)] < 0) continue;
        const auto g = static_cast<std::size_t>(here_[static_cast<std::size_t>(a)]);
        const Grain<M> grain = grain_of(a);
        others += !same_body(grain, grains[g], part.cell);
        if (same_motion(grain, grains[g])) continue;
        grains[g].velocity = grain.velocity;
        grains[g].load = grain.load;
        for (std::size_t r = part.first_replica(g); r < part.last_replica(g); ++r)
            if (part.replicas[r] != part.rank) Serialise::put(grain, out[0][part.replicas[r]]);
    }
    for (const Away& holder : holders_) {
        const Grain<M> grain = grain_of(holder.place);
        const auto& had = alone_.at(grain.id).had;
        others += had && !same_body(grain, *had, part.cell);
        if (!had || !same_motion(grain, *had)) Serialise::put(grain, out[0][holder.rank]);
    }
    const auto [changed, messages] = sums<2>(simulation, {others, double(out[0].size())});
    if (changed > 0 || messages == 0) return changed == 0;
    others = 0;
    const Buffer in = simulation.comm().route(out)[0];
    for (std::size_t p = 0; p < in.size(); p += Serialise::grain_size) {
        const Grain<M> grain = Serialise::grain(&in[p]);
        Grain<M>& to = grains[static_cast<std::size_t>(grain_places_.at(grain.id))];
        others += !same_body(grain, to, part.cell);
        to.velocity = grain.velocity;
        to.load = grain.load;
    }
    return sums<1>(simulation, {others})[0] == 0;
}

void AtomLinks::move(int atom, const Grain<M>& grain, const Cell<M>& cell) const {
    if (grain.fixed()) return;
    const auto a = static_cast<std::size_t>(atom);
    for (int d = 0; d < 3; ++d) {
        double& x = atom_->x[a][d];
        const double here = grain.position[d];
        // the image that LAMMPS has of it, until LAMMPS itself takes another one
        x = cell.periodic[static_cast<std::size_t>(d)] ? here + std::round((x - here) / cell.size[d]) * cell.size[d]
                                                       : here;
        atom_->v[a][d] = grain.velocity[d];
        atom_->omega[a][d] = grain.velocity[3 + d];
    }
}

void AtomLinks::take(const Simulation<M>& simulation) {
    const Subdomain<M>& part = simulation.parts()[0];
    for (int a = 0; a < atom_->nlocal; ++a)
        if (const int g = here_[static_cast<std::size_t>(a)]; g >= 0)
            move(a, part.grains[static_cast<std::size_t>(g)], part.cell);
    if (all_here_) return;
    std::vector<Communicator::Outbox> out(1);
    for (const Away& to : told_) Serialise::put(part.grains[static_cast<std::size_t>(to.place)], out[0][to.rank]);
    const Buffer in = simulation.comm().route(out)[0];
    for (std::size_t p = 0; p < in.size(); p += Serialise::grain_size) {
        const Grain<M> grain = Serialise::grain(&in[p]);
        Alone& atom = alone_.at(grain.id);
        move(atom.place, grain, part.cell);
        atom.had = grain;
    }
}

}  // namespace nscdd
