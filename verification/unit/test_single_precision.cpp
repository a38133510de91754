// What single precision would cost, reports/findings/cost-of-a-sweep.md: impulses, normals and velocities rounded as
// if they were stored so, in sweeps that are those of nlgs() otherwise.
#include "solver_problems.hpp"

using namespace nscdd;

namespace {

enum class Rounded { nothing, impulses, impulses_alone, normals, velocities };

template <class Vector>
Vector single(const Vector& v) {
    return v.template cast<float>().template cast<double>();
}

template <class M>
void sweep_rounded(ContactProblem<M>& problem, std::vector<Contact<M>>& contacts, auto kind, Rounded what) {
    for (Contact<M>& c : contacts) {
        double inv_wt = 0;
        if constexpr (M::friction) inv_wt = c.inv_wt;
        const typename M::Impulse next = solve_contact<M>(c, relative_velocity(problem, c, kind), c.inv_wn, inv_wt);
        const bool rounds = what == Rounded::impulses || what == Rounded::impulses_alone;
        const typename M::Impulse stored = rounds ? single(next) : next;
        // the velocities take what is stored, or what was computed before
        apply_impulse(problem, c, typename M::Impulse((what == Rounded::impulses_alone ? next : stored) - c.r), kind);
        c.r = stored;
    }
    if (what == Rounded::velocities)
        for (auto& body : problem.bodies) body.v = single(body.v);
}

// Of the impulses alone: with the velocities that follow from them.
template <class M>
double true_eta(const ContactProblem<M>& problem, const ContactProblem<M>& start) {
    ContactProblem<M> judged = start;
    for (std::size_t c = 0; c < judged.contacts.size(); ++c) judged.contacts[c].r = problem.contacts[c].r;
    for (std::size_t c = 0; c < judged.wall_contacts.size(); ++c)
        judged.wall_contacts[c].r = problem.wall_contacts[c].r;
    detail::apply_impulses(judged);
    return residual_parts(judged).eta();
}

constexpr int check_every = 10;  // sweeps

template <class M>
struct Study {
    std::array<int, 3> sweeps{};  // to eta <= 1e-3, 1e-5, 1e-7; 0: never
    double floor = 1;             // least eta
};

template <class M>
Study<M> study(const ContactProblem<M>& start, Rounded what, ContactProblem<M>& problem) {
    problem = start;
    if (what == Rounded::normals)
        for (auto* contacts : {&problem.contacts, &problem.wall_contacts})
            for (Contact<M>& c : *contacts) c.normal = single(c.normal);
    ContactProblem<M> rounded = problem;
    prepare_contacts(problem);
    Study<M> found;
    constexpr std::array levels{1e-3, 1e-5, 1e-7};
    for (int k = 1; k <= 20000 && found.floor > 1e-10; ++k) {
        sweep_rounded(problem, problem.wall_contacts, WithWall{}, what);
        sweep_rounded(problem, problem.contacts, BetweenGrains{}, what);
        if (k % check_every != 0) continue;
        const double eta = true_eta(problem, rounded);
        for (std::size_t level = 0; level < levels.size(); ++level)
            if (found.sweeps[level] == 0 && eta <= levels[level]) found.sweeps[level] = k;
        found.floor = std::min(found.floor, eta);
    }
    return found;
}

// An eta that passes its level closely does so at another check with a compiler that rounds otherwise.
bool within_a_check(int sweeps, int others) { return sweeps > 0 && std::abs(sweeps - others) <= check_every; }

}  // namespace

TEMPLATE_TEST_CASE("single precision: what it costs and what it does not", "", scenes::Disks, scenes::Spheres) {
    using M = TestType;
    for (const auto& scene : scenes::dense_scenes<M>({false})) {
        const ContactProblem<M> start = test::next_problem(scene);
        ContactProblem<M> exact, other;
        const auto in_double = study(start, Rounded::nothing, exact);
        const auto with = [&](Rounded what) {
            const auto found = study(start, what, other);
            INFO(scene.name << ": " << found.sweeps[0] << ", " << found.sweeps[1] << " and " << found.sweeps[2]
                            << " sweeps, floor " << found.floor);
            CHECK(within_a_check(found.sweeps[0], in_double.sweeps[0]));
            CHECK(within_a_check(found.sweeps[1], in_double.sweeps[1]));
            return found;
        };
        CHECK(in_double.floor <= 1e-10);

        const auto impulses = with(Rounded::impulses);
        CHECK(within_a_check(impulses.sweeps[2], in_double.sweeps[2]));
        CHECK(impulses.floor > 1e-9);
        CHECK(impulses.floor < 1e-7);

        CHECK(with(Rounded::impulses_alone).floor > 1.5 * impulses.floor);

        CHECK(with(Rounded::normals).floor <= 1e-10);  // of the problem with these normals
        const double moved = test::velocity_difference(other, exact);
        CHECK((moved > 1e-11 && moved < 1e-7));

        CHECK(with(Rounded::velocities).floor > 3e-7);
    }
}
