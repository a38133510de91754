/// @file
/// Components on which sweeps get nowhere are solved by Newton's method or by damped sweeps. Their impulses grow along
/// a self-stress, or go round in a circle (METHOD.md, section 8.1).
#pragma once

#include <exception>
#include <map>

#include "nscdd/decompose/joined_components.hpp"
#include "nscdd/decompose/serialise.hpp"
#include "nscdd/reference/newton.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// A component as one problem of whole masses, put together from what its subdomains send to one rank.
template <class M>
class CollectedComponent {
  public:
    /// Appends what a subdomain has of a component, in V_free and without impulses.
    static void put(const Subdomain<M>& part, const DistanceSums<M>& sums, const Components<M>& labels, int label,
                    Buffer& out) {
        const ContactProblem<M>& problem = part.problem;
        Buffer bodies, contacts;
        std::vector<char> met(problem.bodies.size());  // fixed bodies have no label
        for (const Contact<M>& c : problem.contacts)
            if (labels.of(c) == label) met[static_cast<std::size_t>(c.i)] = met[static_cast<std::size_t>(c.j)] = 1;
        for (const Contact<M>& c : problem.wall_contacts)
            if (labels.of_wall_contact(c) == label) met[static_cast<std::size_t>(c.i)] = 1;
        for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
            if (labels.of_body(b) != label && !met[b]) continue;
            const Body<M>& body = problem.bodies[b];
            bodies.insert(bodies.end(), {double(part.rank), double(b), double(part.grains[b].id),
                                         body.inv_mass / problem.copies(b), problem.radii[b]});
            if constexpr (M::friction)
                bodies.push_back(body.inv_inertia / problem.copies(b));
            else
                bodies.push_back(0);
            Serialise<M>::put(problem.centres[b], bodies);
            Serialise<M>::put(sums.free().bodies[b], bodies);
        }
        const auto put_contact = [&](const Contact<M>& c, std::size_t number, bool wall) {
            const double id = part.grains[static_cast<std::size_t>(c.i)].id,
                         other = wall ? c.j : part.grains[static_cast<std::size_t>(c.j)].id;
            const std::size_t walls = problem.walls.size() - part.touches.size();  // of the scene
            const bool obstacle = wall && static_cast<std::size_t>(c.j) >= walls;
            contacts.insert(contacts.end(),
                            {double(part.rank), double(number), double(wall), id, obstacle ? -1.0 : other, c.bias});
            if constexpr (M::friction)
                contacts.insert(contacts.end(), {c.lever_i, c.lever_j, c.friction_coefficient});
            else
                contacts.insert(contacts.end(), {0, 0, 0});
            Serialise<M>::put(c.normal, contacts);
            Serialise<M>::put(
                obstacle ? problem.walls[static_cast<std::size_t>(c.j)].prescribed : typename M::Vec(M::Vec::Zero()),
                contacts);
        };
        for (std::size_t c = 0; c < problem.wall_contacts.size(); ++c)
            if (labels.of_wall_contact(problem.wall_contacts[c]) == label)
                put_contact(problem.wall_contacts[c], c, true);
        for (std::size_t c = 0; c < problem.contacts.size(); ++c)
            if (labels.of(problem.contacts[c]) == label) put_contact(problem.contacts[c], c, false);
        out.insert(out.end(), {double(bodies.size()), double(contacts.size())});
        out.insert(out.end(), bodies.begin(), bodies.end());
        out.insert(out.end(), contacts.begin(), contacts.end());
    }

    /// Takes in what put() has written from `in` on, and moves it behind that.
    void take(const double*& in) {
        const double *bodies = in + 2, *contacts = bodies + static_cast<std::size_t>(in[0]);
        in = contacts + static_cast<std::size_t>(in[1]);
        for (; bodies != contacts; bodies += body_size) take_body(bodies);
        for (; contacts != in; contacts += contact_size) take_contact(contacts);
    }

    /// Solves it, with the first `walls` walls as `of` has them; true if it has converged. Newton's method may fail
    /// where damped sweeps, with half of each correction, do not. Restitution with strong friction may leave no answer:
    /// rebounds are given up then.
    bool solve(const ContactProblem<M>& of, std::size_t walls, const FreeVelocities<M>& free,
               const NewtonOptions& options) {
        problem_.h = of.h;
        problem_.flow = of.flow;
        problem_.least_radius = of.least_radius;
        problem_.walls.assign(of.walls.begin(), of.walls.begin() + static_cast<std::ptrdiff_t>(walls));
        for (std::size_t w = 0; w < walls; ++w) {
            problem_.walls[w].inv_mass /= of.wall_copies(w);
            problem_.walls[w].speed = free.walls[w];
        }
        for (std::size_t c = 0; c < problem_.wall_contacts.size(); ++c) {
            if (problem_.wall_contacts[c].j >= 0) continue;
            problem_.wall_contacts[c].j = static_cast<int>(problem_.walls.size());
            problem_.walls.push_back({.prescribed = prescribed_[c]});
        }
        NewtonOptions from_rest = options;
        from_rest.warm_sweeps = 0;  // sweeps may run away
        const auto newton = [](const NewtonOptions& how) {
            return [&how](ContactProblem<M>& problem) { return newton_solve(problem, how).converged; };
        };
        const auto damped = [&options](ContactProblem<M>& problem) {
            const SolveOptions how{.tolerance = options.tolerance, .max_iterations = 5000, .relaxation = 0.5};
            return nlgs(problem, how).converged;
        };
        if (attempt(newton(from_rest)) || attempt(newton(options)) || attempt(damped)) return true;
        for (auto* contacts : {&problem_.wall_contacts, &problem_.contacts})
            for (Contact<M>& c : *contacts) {
                rebounds_given_up_ += c.bias < 0;
                c.bias = (std::max)(c.bias, 0.0);
            }
        return rebounds_given_up_ > 0 && attempt(newton(options));
    }
    std::size_t rebounds_given_up() const { return rebounds_given_up_; }  ///< contacts

    std::size_t contacts() const { return problem_.contact_count(); }

    /// Writes impulses, velocities of copies, and speeds of the driven walls that it touches into the messages to their
    /// subdomains.
    void answer(Communicator::Outbox& out, int ranks) const {
        for (std::size_t b = 0; b < copies_.size(); ++b)
            for (const auto& [rank, place] : copies_[b]) {
                out[rank].insert(out[rank].end(), {0, place});
                Serialise<M>::put(problem_.bodies[b].v, out[rank]);
            }
        const auto put = [&out](const std::vector<Place>& places, const auto& contacts, double kind) {
            for (std::size_t c = 0; c < contacts.size(); ++c) {
                Buffer& to = out[places[c].rank];
                to.insert(to.end(), {kind, places[c].place});
                to.push_back(contacts[c].bias);
                Serialise<M>::put(contacts[c].r, to);
            }
        };
        put(wall_places_, problem_.wall_contacts, 1);
        put(places_, problem_.contacts, 2);
        for (const Contact<M>& c : problem_.wall_contacts)
            if (const auto& wall = problem_.walls[static_cast<std::size_t>(c.j)]; wall.inv_mass > 0)
                for (int rank = 0; rank < ranks; ++rank)
                    out[rank].insert(out[rank].end(), {3, double(c.j), wall.speed});
    }
    /// Reads what answer() has written.
    static void read(const Buffer& in, ContactProblem<M>& problem) {
        for (const double* at = in.data(); at != in.data() + in.size();) {
            const auto kind = static_cast<int>(*at++), place = static_cast<int>(*at++);
            const auto p = static_cast<std::size_t>(place);
            const auto set = [&at](auto& vector) {
                for (double& x : vector) x = *at++;
            };
            if (kind == 0) set(problem.bodies[p].v);
            if (kind == 1 || kind == 2) {
                Contact<M>& c = kind == 1 ? problem.wall_contacts[p] : problem.contacts[p];
                c.bias = *at++;
                set(c.r);
            }
            if (kind == 3) problem.walls[p].speed = *at++;
        }
    }

  private:
    /// The problem stays as it is unless solve(problem) converges.
    bool attempt(auto&& solve) {
        ContactProblem<M> trial = problem_;
        try {
            if (!solve(trial)) return false;
        } catch (const std::exception&) {
            return false;  // other ranks go on, and so does the iteration
        }
        problem_ = std::move(trial);
        return true;
    }

    struct Place {
        int rank;
        double place;
    };
    static constexpr std::size_t body_size = 6 + M::dim + M::dof, contact_size = 9 + 2 * M::dim;

    void take_body(const double* in) {
        const auto [at, fresh] = body_of_.try_emplace(static_cast<int>(in[2]), static_cast<int>(copies_.size()));
        if (fresh) {
            copies_.emplace_back();
            Body<M>& body = problem_.bodies.emplace_back();
            body.inv_mass = in[3];
            if constexpr (M::friction) body.inv_inertia = in[5];
            problem_.radii.push_back(in[4]);
            problem_.centres.push_back(Eigen::Map<const typename M::Vec>(in + 6));
            body.v = Eigen::Map<const typename M::Velocity>(in + 6 + M::dim);
        }
        copies_[static_cast<std::size_t>(at->second)].push_back({static_cast<int>(in[0]), in[1]});
    }
    void take_contact(const double* in) {
        const bool wall = in[2] != 0;
        Contact<M>& c = (wall ? problem_.wall_contacts : problem_.contacts).emplace_back();
        (wall ? wall_places_ : places_).push_back({static_cast<int>(in[0]), in[1]});
        c.i = body_of_.at(static_cast<int>(in[3]));
        c.j = wall ? static_cast<int>(in[4]) : body_of_.at(static_cast<int>(in[4]));
        c.bias = in[5];
        if constexpr (M::friction) c.lever_i = in[6], c.lever_j = in[7], c.friction_coefficient = in[8];
        c.normal = Eigen::Map<const typename M::Vec>(in + 9);
        if (wall) prescribed_.emplace_back(Eigen::Map<const typename M::Vec>(in + 9 + M::dim));
    }

    std::size_t rebounds_given_up_ = 0;
    ContactProblem<M> problem_;
    std::vector<typename M::Vec> prescribed_;  ///< velocities of obstacles at contacts with walls [m/s]
    std::map<int, int> body_of_;               ///< place of a grain in the problem, by its id
    std::vector<std::vector<Place>> copies_;   ///< of each body
    std::vector<Place> places_, wall_places_;  ///< where each contact comes from
};

/// Solves components by Newton's method, each on one rank. They are far from an answer (where none is, all count), and
/// have at most options.max_newton_contacts contacts. Problems then have their impulses and velocities, and the bias of
/// rebounds that were given up. `sums` are added up; `residual` is that of the scene. Collective.
template <class M>
HandedOver hand_over(std::span<Subdomain<M>> parts, Communicator& comm, std::span<DistanceSums<M>> sums,
                     JoinedComponents<M>& joined, const ResidualParts& residual, const SolveOptions& options) {
    if (parts[0].cell.any_driven()) return {};  // one component's impulses would change the flow of all others
    const auto near = [&options](const DistanceEstimate& e) {
        const SolveOptions::Bounds& bounds = options.bounds;
        return e.worst <= bounds.max_distance && e.gap_error <= bounds.max_gap_error &&
               e.energy_gain <= bounds.max_energy_gain;
    };
    const bool all = near(joined.estimate(comm, sums, residual));
    std::vector<Communicator::Outbox> out(parts.size());
    // By component: on the rank that has all of it, or on one that its number names.
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t c = 0; c < sums[k].components.size(); ++c) {
            if ((!all && near(joined.estimate(k, c))) || joined.shape(k, c).contacts > options.max_newton_contacts)
                continue;
            const int number = joined.number(k, c);
            Buffer& to = out[k][number < 0 ? parts[k].rank : number % comm.size()];
            to.push_back(number < 0 ? -1.0 - double(c) : number);
            CollectedComponent<M>::put(parts[k], sums[k], sums[k].labels(parts[k].problem), int(c), to);
        }
    const std::vector<Buffer> in = comm.route(out);
    const NewtonOptions exact{.tolerance = 0.01 * options.tolerance, .max_iterations = 300};
    std::vector<Communicator::Outbox> answers(parts.size());
    std::vector<HandedOver> solved(parts.size());
    comm.each_rank([&](std::size_t k) {
        std::map<double, CollectedComponent<M>> collected;
        for (const double* at = in[k].data(); at != in[k].data() + in[k].size();) {
            auto& component = collected[*at++];
            component.take(at);
        }
        for (auto& [number, component] : collected)
            if (component.solve(parts[k].problem, parts[k].problem.walls.size() - parts[k].touches.size(),
                                sums[k].free(), exact)) {
                component.answer(answers[k], comm.size());
                solved[k].contacts += double(component.contacts());
                solved[k].rebounds_given_up += double(component.rebounds_given_up());
            }
    });
    const std::vector<Buffer> told = comm.route(answers);
    for (std::size_t k = 0; k < parts.size(); ++k) CollectedComponent<M>::read(told[k], parts[k].problem);
    return nscdd::reduce<HandedOver>(comm, [&solved](std::size_t k) { return solved[k]; });
}

}  // namespace detail

/// The solver that by_nlgs() and by_nscdd() hand over to. It is null for a law that Newton's method does not know.
template <class M>
detail::HandOver<M> newton_where_stalled() {
    if constexpr (detail::SolvedOnCone<typename M::Law>) return &detail::hand_over<M>;
    return nullptr;
}

}}  // namespace nscdd::NSCDD_ABI
