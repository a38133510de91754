// Which grain of the kernel is which atom of LAMMPS, and what goes from one to the other. An atom is on one rank, a
// grain on each that has candidates of it. With LAMMPS' bricks as subdomains nearly every atom has a copy of its grain
// beside it. For others messages are sent.
#pragma once

#include <lammps/atom.h>

#include <optional>
#include <unordered_map>
#include <vector>

#include "nscdd/compiled.hpp"

namespace nscdd {

class AtomLinks {
  public:
    using M = compiled::Spheres;

    // Atoms outside of the group are fixed grains. force_unit: mass times acceleration over LAMMPS' force.
    AtomLinks(const LAMMPS_NS::Atom& atom, int group_bit, double force_unit)
        : atom_(&atom), group_bit_(group_bit), force_unit_(force_unit) {}

    // Grains of the atoms of this rank, as they are now.
    std::vector<Grain<M>> grains() const;
    // Finds the grains again, after atoms or grains have other places. Collective. False where they are not the same.
    bool renew(const Simulation<M>& simulation);
    // Gives velocities and loads to the grains. Collective. False where an atom has changed otherwise.
    bool give(Simulation<M>& simulation) const;
    // Takes positions and velocities of the grains. Collective.
    void take(const Simulation<M>& simulation);

  private:
    struct Away {
        int place;  // of an atom or a grain
        int rank;   // of the grain or the atom
    };
    struct Alone {
        int place;                    // of an atom without a grain on this rank
        std::optional<Grain<M>> had;  // its grain, as the last take() has brought it
    };
    Grain<M> grain_of(int atom) const;
    void move(int atom, const Grain<M>& grain, const Cell<M>& cell) const;
    void ask(const Simulation<M>& simulation);

    const LAMMPS_NS::Atom* atom_;
    int group_bit_;
    double force_unit_;
    std::vector<int> here_;                      // by atom: place of its grain on this rank, or -1
    std::unordered_map<int, int> grain_places_;  // by id
    std::unordered_map<int, Alone> alone_;       // by id
    bool all_here_ = true;                       // on no rank an atom is alone
    std::vector<Away> holders_;                  // ranks with grains of atoms that are alone here
    std::vector<Away> told_;                     // ranks with atoms that are alone, for whose grain this rank speaks
};

}  // namespace nscdd
