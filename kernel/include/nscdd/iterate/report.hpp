/// @file
/// Reports of an iteration.
#pragma once

#include <tuple>

#include "nscdd/core/abi.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// End of an iteration. It has converged where every bound of the options is kept. Without a least radius the
/// penetration is only reported, for the caller to judge. Without radii there is no gap error.
struct SolveReport {
    int iterations = 0;               ///< iterations made, each of SolveOptions::sweeps sweeps
    double residual = 0;              ///< eta
    double velocity_error = 0;        ///< ResidualParts::velocity_error()
    double energy_gain = 0;           ///< of the scene, or of a component where it is larger
    double velocity_change_norm = 0;  ///< |V - V_free|_M, the change by the contacts [J^1/2]
    double penetration = 0;           ///< the step would close a contact so deep [m]
    double gap_error = 0;             ///< DistanceEstimate::gap_error
    double distance = 0;              ///< DistanceEstimate::worst, of the worst component
    double scene_distance = 0;        ///< DistanceEstimate::scene, of all components together
    double newton_contacts = 0;       ///< contacts of components that Newton's method solved, as sweeps got nowhere
    double rebounds_given_up = 0;     ///< of them those without a rebound, as none was found with it
    bool converged = true;            ///< all tests are passed
};

namespace detail {

/// Contacts that an iteration has handed over to Newton's method.
struct HandedOver {
    double contacts = 0;           ///< contacts of components that it has solved
    double rebounds_given_up = 0;  ///< of them those without a rebound, as no answer was found with it
    auto summed() { return std::tie(contacts, rebounds_given_up); }  ///< members that reduce() adds up
    auto largest() { return std::tie(); }                            ///< reduce() takes the largest of no member
};

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
