// NSCDD on 2 to 16 subdomains against the sequential reference, and eta and the velocity error against a calculation of
// the test's own.
#include "../catch.hpp"
#include "../small_scenes.hpp"

#include <Eigen/Dense>

using namespace nscdd;
using namespace scenes;
using Eigen::Vector3d;

namespace {

// sqrt of (V_a - V_b)^T M (V_a - V_b) over that of V_free.
template <class M>
double velocity_difference(const Outcome<M>& a, const Outcome<M>& b) {
    double sum = 0;
    for (std::size_t g = 0; g < a.grains.size(); ++g) {
        Grain<M> difference = a.grains[g].grain;
        difference.velocity -= b.grains[g].grain.velocity;
        sum += 2 * difference.kinetic_energy();
    }
    for (std::size_t w = 0; w < a.walls.size(); ++w)
        sum += a.walls[w].mass * std::pow(a.walls[w].speed - b.walls[w].speed, 2);
    return std::sqrt(sum) / b.last().free_norm;
}

Vector3d in_space(const auto& v) {
    Vector3d u = Vector3d::Zero();
    u.head(v.size()) = v;
    return u;
}

// Anything that takes an impulse, in space also when the model is plane.
struct Mover {
    Vector3d v = Vector3d::Zero(), spin = Vector3d::Zero(), impulse = v, turn = v;  // in all
    Eigen::Matrix3d inverse_mass = Eigen::Matrix3d::Zero();
    double mass = 0, inverse_inertia = 0;

    Vector3d at(const Vector3d& arm) const { return v + spin.cross(arm); }
    void push(const Vector3d& arm, const Vector3d& by) {
        v += inverse_mass * by;
        spin += inverse_inertia * arm.cross(by);
        impulse += by;
        turn += arm.cross(by);
    }
    // (V - V_free)^T M (V - V_free).
    double velocity_change() const {
        return impulse.dot(inverse_mass * impulse) + inverse_inertia * turn.squaredNorm();
    }
    // Share of W in a direction.
    double yield(const Vector3d& arm, const Vector3d& direction) const {
        return direction.dot(inverse_mass * direction) + inverse_inertia * arm.cross(direction).squaredNorm();
    }
};

struct Judged {
    double eta, velocity_error, energy_gain;
};

// Of one step from the state before it and the impulses after it: V = V_free + M^-1 H r with whole masses.
template <class M>
Judged judge(const Scene<M>& before, const std::vector<GatheredContact<M>>& impulses) {
    const auto& s = before.settings;
    const double drift = (1 - s.theta) * s.h;
    std::vector<Mover> grains, walls;
    std::vector<Vector3d> centres;
    for (const Grain<M>& g : before.grains) {
        Mover& m = grains.emplace_back();
        const typename M::Vec v = g.velocity.template head<M::dim>();
        centres.push_back(in_space(g.position) + drift * in_space(v));
        m.v = in_space(v) + s.h * in_space(s.gravity);
        m.mass = g.mass;
        m.inverse_mass = Eigen::Matrix3d::Identity() / g.mass;
        if constexpr (M::friction) m.inverse_inertia = 1 / g.inertia;
        if constexpr (M::friction && M::dim == 2) m.spin[2] = g.velocity[2];
        if constexpr (M::friction && M::dim == 3) m.spin = g.velocity.template tail<3>();
    }
    for (const Wall<M>& w : s.walls) {
        Mover& m = walls.emplace_back();
        const Vector3d n = in_space(w.normal);
        m.v = in_space(w.velocity);
        if (w.driven) {
            m.v += (w.speed + s.h * w.force / w.mass) * n;
            m.mass = w.mass;
            m.inverse_mass = n * n.transpose() / w.mass;
        }
    }

    struct Touch {
        Mover *a, *b;
        Vector3d normal, arm_a, arm_b, r;
        double gap;
    };
    std::vector<Touch> touches;
    for (const auto& c : impulses) {
        const auto i = static_cast<std::size_t>(c.i), j = static_cast<std::size_t>(c.j < 0 ? -1 - c.j : c.j);
        const double radius = before.grains[i].radius;
        Touch t{&grains[i], c.j < 0 ? &walls[j] : &grains[j], {}, {}, {}, in_space(c.impulse), 0};
        if (c.j < 0) {
            t.normal = in_space(s.walls[j].normal);
            t.gap = t.normal.dot(centres[i]) - s.walls[j].offset - drift * s.walls[j].normal_speed() - radius;
            t.arm_b.setZero();
        } else {
            t.normal = (centres[i] - centres[j]).normalized();
            t.gap = (centres[i] - centres[j]).norm() - radius - before.grains[j].radius;
            t.arm_b = (before.grains[j].radius + t.gap / 2) * t.normal;
        }
        t.arm_a = -(c.j < 0 ? radius : radius + t.gap / 2) * t.normal;
        t.a->push(t.arm_a, t.r);
        t.b->push(t.arm_b, -t.r);
        touches.push_back(t);
    }

    double change = 0, energy = 0, next_energy = 0, work = 0, made = 0, miss = 0, velocity_change = 0, quartic = 0;
    for (const Touch& t : touches) {
        const Vector3d v = t.a->at(t.arm_a) - t.b->at(t.arm_b), n = t.normal, side = n.unitOrthogonal();
        const Vector3d tangent = M::dim == 3 ? side : Vector3d(-n[1], n[0], 0);
        const double wn = t.a->yield(t.arm_a, n) + t.b->yield(t.arm_b, n);
        // a wall never gives way sideways, whatever it is made of
        const double wt = t.a->yield(t.arm_a, tangent) + t.b->yield(t.arm_b, tangent);
        const double rn = t.r.dot(n), next_rn = std::max(0.0, rn - (v.dot(n) + std::max(t.gap, 0.0) / s.h) / wn);
        const Vector3d rt = t.r - rn * n;
        Vector3d next_rt = rt - (v - v.dot(n) * n) / wt;
        const double limit = s.materials(0, 0).friction * next_rn;
        if (next_rt.norm() > limit) next_rt *= limit / next_rt.norm();
        change += wn * std::pow(next_rn - rn, 2) + wt * (next_rt - rt).squaredNorm();
        energy += wn * rn * rn + wt * rt.squaredNorm();
        next_energy += wn * next_rn * next_rn + wt * next_rt.squaredNorm();
        const Vector3d slip = v - v.dot(n) * n;
        const double normal = rn * (v.dot(n) + std::max(t.gap, 0.0) / s.h);
        work += std::abs(normal) + s.materials(0, 0).friction * rn * slip.norm() + rt.dot(slip);
        made += normal + rt.dot(slip);
        miss = std::max(miss, std::hypot(wn * (next_rn - rn), wt * (next_rt - rt).norm()));
    }
    for (const auto* movers : {&grains, &walls})
        for (const Mover& m : *movers) {
            velocity_change += m.velocity_change();
            if (m.mass > 0) quartic += m.velocity_change() * m.velocity_change() / m.mass;
        }
    return {std::sqrt(change / std::max(energy, next_energy)),
            std::max(work / velocity_change, miss / std::sqrt(quartic / velocity_change)),
            std::max(made, 0.0) / velocity_change};
}

}  // namespace

// Bounds. A linear iteration that needs N iterations to 1e-8 shrinks its error by about exp(-18/N) in each, so what is
// left is about N/18 times the last change, eta |r|_W. Here N <= 1250 (reference) and 3000 (NSCDD), and |r|_W is at
// most 2.4 |V_free|_M, so that two solutions differ by at most 6e-6 of |V_free|_M. Seen: 9e-8 in the velocities, 8e-7
// in stress and energy; at 1e-4 3e-3 in the velocities.
TEMPLATE_TEST_CASE("NSCDD agrees with the reference after one step from one state", "", EVERY_MODEL) {
    constexpr SolveOptions fine{.tolerance = 1e-8, .check_every = 1}, coarse{.tolerance = 1e-4, .check_every = 1};
    for (const auto& scene : dense_scenes<TestType>()) {
        const auto reference = run_nlgs(scene, 1, fine);
        CHECK(reference.converged());
        CHECK(reference.last().contacts > 60);
        CHECK(velocity_difference(run_nlgs(scene, 1, coarse), reference) <= 0.03);
        for (int ranks : {2, 3, 4, 8, 16}) {
            INFO(scene.name << ", " << ranks << " subdomains");
            const auto nscdd = run_nscdd<Dcs, ClosedForm>(scene, ranks, 1, fine);
            CHECK(nscdd.converged());
            CHECK(nscdd.last().solve.residual <= 1e-8);
            CHECK(nscdd.last().interface_grains > 0);
            CHECK(nscdd.last().free_norm == Approx(reference.last().free_norm).epsilon(1e-13));
            CHECK(nscdd.contacts.size() == reference.contacts.size());
            CHECK(velocity_difference(nscdd, reference) <= 6e-6);
            const auto &ours = nscdd.measures, &theirs = reference.measures;
            CHECK(ours.kinetic_energy == Approx(theirs.kinetic_energy).epsilon(1e-5));
            CHECK((ours.virial - theirs.virial).norm() <= 1e-5 * theirs.virial.norm());
            const auto rough = run_nscdd<Dcs, ClosedForm>(scene, ranks, 1, coarse);
            CHECK(rough.converged());
            CHECK(velocity_difference(rough, reference) <= 0.03);
        }
    }
}

TEMPLATE_TEST_CASE("the residual reported is that of the unsplit problem", "", EVERY_MODEL) {
    for (const auto& scene : dense_scenes<TestType>())
        for (int ranks : {1, 2, 3, 8, 16})
            for (double tolerance : {1e-2, 1e-4}) {
                INFO(scene.name << ", " << ranks << " subdomains");
                const auto outcome =
                    run_nscdd<Dcs, ClosedForm>(scene, ranks, 1, {.tolerance = tolerance, .check_every = 1});
                const SolveReport& reported = outcome.last().solve;
                const Judged judged = judge(scene, outcome.contacts);
                CHECK(reported.residual > 0);
                CHECK(judged.eta == Approx(reported.residual).epsilon(1e-6));
                CHECK(judged.velocity_error == Approx(reported.velocity_error).epsilon(1e-5));
                CHECK(judged.energy_gain <= reported.energy_gain * (1 + 1e-4) + 1e-9);  // of the worst component
            }
}

// A wall knocks a grain against the next one, which lies beyond the alert distance; the two touch in a subdomain
// where the first has no other contact, and so no part in the iteration.
TEST_CASE("a contact that only the solution closes is found in whatever subdomain it lies") {
    Scene<SmoothDisks> scene;
    scene.settings.h = 1e-2;
    scene.settings.walls.resize(1);
    drive(scene.settings.walls[0], 1000.0, 1.0);
    const auto add = [&](double x, double y, double radius) {
        scene.grains.push_back(make_grain<SmoothDisks>(int(scene.grains.size()), radius, 1.0, {x, y}));
    };
    add(0.5, 0, 0.5), add(1.53, 0, 0.5), add(0.3, 5, 0.1);  // the last puts the border at x = 0.915
    scene.settings.partition = nscdd::by_grid<SmoothDisks>({1, 1});
    const auto whole = run_nlgs(scene, 1, {.tolerance = 1e-10});
    CHECK(whole.last().contacts == 2);
    CHECK(whole.grains[1].grain.velocity[0] > 1);
    scene.settings.partition = nscdd::by_grid<SmoothDisks>({2, 1});
    const auto halves = run_nscdd<Dcs, ClosedForm>(scene, 2, 1, {.tolerance = 1e-10});
    CHECK(halves.last().contacts == 2);
    CHECK(halves.last().interface_grains == 1);
    for (std::size_t g = 0; g < 3; ++g)
        CHECK((halves.grains[g].grain.velocity - whole.grains[g].grain.velocity).norm() <= 1e-8);
}

// Pairs that fly along together: all that is left of a closing speed is round-off, of which no impulse grows.
TEMPLATE_TEST_CASE("contacts without load take no iterations", "", SmoothDisks, Spheres) {
    Scene<TestType> scene;
    scene.settings.h = 1e-3;
    std::mt19937 random(7);
    const auto direction = [&] {
        typename TestType::Vec v;
        for (int d = 0; d < TestType::dim; ++d) v[d] = static_cast<double>(random()) - 2147483647.5;
        return typename TestType::Vec(v.normalized());
    };
    for (int k = 0; k < 20; ++k) {
        typename TestType::Vec centre = 10.0 * k * TestType::Vec::UnitX(), velocity = direction();
        for (double radius : {0.5, 0.3}) {
            scene.grains.push_back(make_grain<TestType>(int(scene.grains.size()), radius, 1.0, centre));
            scene.grains.back().velocity.template head<TestType::dim>() = velocity;
            centre += 0.8 * direction();
            velocity *= 1 - 3e-16;
        }
    }
    for (int ranks : {1, 8}) {
        const auto outcome = run_nscdd<Dcs, ClosedForm>(scene, ranks, 1, {.check_every = 1});
        CHECK(outcome.last().contacts == 20);
        CHECK(outcome.last().solve.iterations <= 10);
    }
}
