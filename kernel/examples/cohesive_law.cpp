// Your own contact law: Coulomb with cohesion, r_n >= -c h and |r_t| <= mu (r_n + c h), while grains touch.
//
// Checked against two exact answers, by NLGS, NSCDD on four subdomains, and both accelerated: a chain of n spheres
// hangs from a ceiling as long as n m g <= c; a sphere pulled along the floor by F slides as soon as F > mu (m g + c).
#include <cmath>
#include <cstdio>
#include <nscdd/nscdd.hpp>

struct CohesiveCoulomb {
    static constexpr const char* name = "cohesive Coulomb";
    static constexpr bool friction = true;
    struct Pairing {  // of two materials
        double friction = 0, restitution = 0;
        double cohesion = 0;     // c [N]
        double contact_gap = 0;  // gap up to which grains that touch count as touching [m]
        const char* fault() const {
            return friction >= 0 && cohesion >= 0 ? nullptr : "friction or cohesion is not >= 0";
        }
    };
    struct Coefficients {  // of one contact
        double friction_coefficient = 0;
        double pull = 0;  // c h [N s]
        bool operator==(const Coefficients&) const = default;
    };
    static Coefficients coefficients(const Pairing& pairing, double gap, double h) {
        return {pairing.friction, gap <= pairing.contact_gap ? pairing.cohesion * h : 0};
    }
    static const char* fault(const Coefficients& k) {
        return k.friction_coefficient >= 0 && k.pull >= 0 ? nullptr : "friction or pull is not >= 0";
    }
    template <class Real>
    static Real normal(Real trial, const Coefficients& k) {
        return nscdd::larger(Real(-k.pull), trial);
    }
    template <class Real>
    static Real limit(Real normal, const Coefficients& k) {
        return Real(k.friction_coefficient) * (normal + Real(k.pull));
    }
    template <class Real>
    static Real excess(Real normal, const Coefficients& k) {
        return normal + Real(k.pull);
    }
};

using Model = nscdd::Model<3, CohesiveCoulomb>;
using Solver = nscdd::AnyStepSolver<Model>;
const double grain_radius = 0.5, gravity = 10, time_step = 1e-3, mu = 0.4,
             cohesion = 1000;  // [m], [m/s^2], [s], 1, [N]

nscdd::SimulationSettings<Model> settings_with(const Model::Vec& wall_normal, double wall_offset) {
    nscdd::SimulationSettings<Model> settings;
    settings.h = time_step;
    settings.gravity = {0, 0, -gravity};
    settings.materials.set(0, 0, {.friction = mu, .cohesion = cohesion, .contact_gap = 1e-6});
    settings.walls.emplace_back().normal = wall_normal;
    settings.walls[0].offset = wall_offset;
    return settings;
}
nscdd::Grain<Model> sphere(int id, double mass, const Model::Vec& at) {
    return nscdd::make_grain<Model>(id, grain_radius, mass / (4.0 / 3.0 * std::numbers::pi * std::pow(grain_radius, 3)),
                                    at);
}

// Speed of the lowest sphere of a chain of ten, of this weight in all [N], after ten steps. The chain is cut across:
// neighbours in it share a sphere.
double hang(const Solver& solve, int ranks, double weight) {
    std::vector<nscdd::Grain<Model>> grains;
    for (int k = 0; k < 10; ++k)
        grains.push_back(sphere(k, weight / gravity / 10, {0, 0, -grain_radius * (2 * k + 1)}));
    nscdd::InProcess comm(ranks);
    nscdd::Simulation<Model> simulation(comm, settings_with({0, 0, -1}, 0), grains);
    for (int step = 0; step < 10; ++step) {
        const nscdd::StepReport report = simulation.step(solve);
        if (!report.solve.converged || report.interface_grains < ranks - 1) return NAN;
    }
    return nscdd::gather_grains(simulation).back().grain.velocity[2];
}

// Largest error of the speeds after one step of eight spheres, pulled where they touch the floor by 0.8 to 1.15 times
// what makes them slide. F at the contact is F at the centre and a torque; a sphere that slides has 3.5/m there. They
// touch the floor alone, each in one subdomain: here is nothing to glue.
double slide(const Solver& solve, int ranks) {
    const double mass = 20, most = mu * (mass * gravity + cohesion);
    std::vector<nscdd::Grain<Model>> grains;
    for (int k = 0; k < 8; ++k) {
        const double pull = most * (0.8 + 0.05 * k + 1e-3);
        grains.push_back(sphere(k, mass, {2.0 * k, 0, grain_radius}));
        grains.back().load << pull, 0, 0, 0, -grain_radius * pull, 0;
    }
    nscdd::InProcess comm(ranks);
    nscdd::Simulation<Model> simulation(comm, settings_with({0, 0, 1}, 0), grains);
    if (!simulation.step(solve).solve.converged) return NAN;
    double error = 0;
    for (const auto& [grain, where, rank, copies] : nscdd::gather_grains(simulation)) {
        const double slip = grain.velocity[0] - grain_radius * grain.velocity[4];
        const double expected = 3.5 / mass * time_step * std::max(0.0, grain.load[0] - most);
        error = std::max(error, std::abs(slip - expected));
    }
    return error;
}

int main() {
    int wrong = 0;
    const nscdd::SolveOptions plain{
        .tolerance = 1e-9, .bounds = {.max_velocity_error = 1e-7}, .max_iterations = 200000};
    for (const auto& options : {plain, plain.accelerated()})
        for (const int ranks : {1, 4}) {
            const Solver solve =
                ranks == 1 ? nscdd::by_nlgs<Model>(options) : nscdd::by_nscdd<nscdd::Dcs<Model>>(options);
            const double holds = hang(solve, ranks, 0.999 * cohesion), falls = hang(solve, ranks, 1.001 * cohesion);
            const double error = slide(solve, ranks), free_fall = -10 * time_step * gravity * (1 - 1 / 1.001);
            std::printf(
                "%d ranks, window %d: hangs at %.1e m/s, falls at %.6f of the exact speed, slides within %.1e m/s\n",
                ranks, options.window, holds, falls / free_fall, error);
            wrong += !(std::abs(holds) < 1e-8 && std::abs(falls / free_fall - 1) < 1e-4 && error < 1e-9);
        }
    return wrong;
}
