// Your own contact law: Coulomb with a shear strength, |r_t| <= min(mu r_n, s h), as of a thin film that yields.
//
// Checked against an exact answer, by NLGS, NSCDD on four subdomains, and both accelerated: a sphere pulled along the
// floor by F slides as soon as F > min(mu m g, s).
#include <cmath>
#include <cstdio>
#include <nscdd/nscdd.hpp>

struct YieldingCoulomb {
    static constexpr const char* name = "yielding Coulomb";
    static constexpr bool friction = true;
    struct Pairing {  // of two materials
        double friction = 0, restitution = 0;
        double strength = 0;  // s [N]
        const char* fault() const {
            return friction >= 0 && strength >= 0 ? nullptr : "friction or strength is not >= 0";
        }
    };
    struct Coefficients {  // of one contact
        double friction_coefficient = 0;
        double most = 0;  // s h [N s]
        bool operator==(const Coefficients&) const = default;
    };
    static Coefficients coefficients(const Pairing& pairing, double /*gap*/, double h) {
        return {pairing.friction, pairing.strength * h};
    }
    static const char* fault(const Coefficients& k) {
        return k.friction_coefficient >= 0 && k.most >= 0 ? nullptr : "friction or strength is not >= 0";
    }
    template <class Real>
    static Real normal(Real trial, const Coefficients&) {
        return nscdd::larger(Real(0), trial);
    }
    template <class Real>
    static Real limit(Real normal, const Coefficients& k) {
        return nscdd::smaller(Real(k.most), Real(k.friction_coefficient) * normal);
    }
    template <class Real>
    static Real excess(Real normal, const Coefficients&) {
        return normal;
    }
};

using Model = nscdd::Model<3, YieldingCoulomb>;
using Solver = nscdd::AnyStepSolver<Model>;
const double radius = 0.5, gravity = 10, time_step = 1e-3, mu = 0.4, strength = 100;  // [m], [m/s^2], [s], 1, [N]

// Largest error of the slip after one step of eight spheres of 5 to 40 kg, pulled where they touch the floor by 0.9 or
// 1.1 times what makes them slide. F at the contact is F at the centre and a torque; a sphere that slides has 3.5/m
// there. They touch the floor alone, each in one subdomain: here is nothing to glue.
double slide(const Solver& solve, int ranks) {
    nscdd::SimulationSettings<Model> settings;
    settings.h = time_step;
    settings.gravity = {0, 0, -gravity};
    settings.materials.set(0, 0, {.friction = mu, .strength = strength});
    settings.walls.emplace_back().normal = {0, 0, 1};
    std::vector<nscdd::Grain<Model>> grains;
    const auto most = [](const nscdd::Grain<Model>& grain) { return std::min(mu * grain.mass * gravity, strength); };
    for (int k = 0; k < 8; ++k) {
        const double mass = 5 * (k + 1), density = mass / (4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3));
        grains.push_back(nscdd::make_grain<Model>(k, radius, density, {2.0 * k, 0, radius}));
        const double pull = (k % 2 ? 1.1 : 0.9) * most(grains.back());
        grains.back().load << pull, 0, 0, 0, -radius * pull, 0;
    }
    nscdd::InProcess comm(ranks);
    nscdd::Simulation<Model> simulation(comm, settings, grains);
    if (!simulation.step(solve).solve.converged) return NAN;
    double error = 0;
    for (const auto& [grain, at_broad_phase, rank, copies] : nscdd::gather_grains(simulation)) {
        const double slip = grain.velocity[0] - radius * grain.velocity[4];
        const double expected = 3.5 / grain.mass * time_step * std::max(0.0, grain.load[0] - most(grain));
        error = std::max(error, std::abs(slip - expected));
    }
    return error;
}

int main() {
    int wrong = 0;
    const nscdd::SolveOptions plain{.tolerance = 1e-9, .bounds = {.max_velocity_error = 1e-7}};
    for (const auto& options : {plain, plain.accelerated()})
        for (const int ranks : {1, 4}) {
            const Solver solve =
                ranks == 1 ? nscdd::by_nlgs<Model>(options) : nscdd::by_nscdd<nscdd::Dcs<Model>>(options);
            const double error = slide(solve, ranks);
            std::printf("%d ranks, window %d: slides within %.1e m/s\n", ranks, options.window, error);
            wrong += !(error < 1e-9);
        }
    return wrong;
}
