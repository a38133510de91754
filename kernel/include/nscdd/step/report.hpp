/// @file
/// The report of a step.
#pragma once

#include <tuple>

#include "nscdd/iterate/report.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Report of one step, the same on every rank.
struct StepReport {
    /// The energy balance of a step. Works are impulses times the mean of the velocities before and after the step. So
    /// their sum is the change of kinetic energy but for round-off. With theta = 1/2 the work of a constant force is
    /// the potential energy lost.
    struct Energy {
        double before = 0;    ///< kinetic energy of grains and driven walls before the step [J]
        double kinetic = 0;   ///< kinetic energy of grains and driven walls after the step [J]
        double external = 0;  ///< work of gravity and of the grains' loads [J]
        /// Work of the walls: prescribed motion, forces on driven walls; and of a cell that flows [J].
        double walls = 0;
        double normal = 0;    ///< work of the contacts along their normals [J]
        double friction = 0;  ///< work of the contacts along their tangents, and of their couples [J]

        double contacts() const { return normal + friction; }  ///< not above zero where no energy is made [J]
        /// Members that reduce() adds up.
        auto summed() { return std::tie(before, kinetic, external, walls, normal, friction); }
        auto largest() { return std::tie(); }  ///< reduce() takes the largest value of no member
        /// What is left of the balance [J].
        double round_off() const { return kinetic - before - external - walls - contacts(); }
    };

    SolveReport solve;            ///< of the last attempt, with the iterations of all
    int attempts = 1;             ///< more than one when the answer changed which pairs are contacts
    double contacts = 0;          ///< number in the whole scene
    double interface_grains = 0;  ///< number in the whole scene of grains with contacts in several subdomains
    double free_norm = 0;         ///< sqrt(sum of V_free^T M V_free), driven walls included [J^1/2]
    Energy energy;                ///< balance of the kinetic energy
};

}}  // namespace nscdd::NSCDD_ABI
