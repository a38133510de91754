/// @file
/// Contact problems to high accuracy, on Coulomb's law as it is. An interior-point method goes on until the statuses of
/// the contacts are known, then a proximal Newton method to round-off. It is for reference answers. Where NLGS stalls
/// between 1e-5 and 1e-8 it goes on, at the price of a sparse factorisation a step.
/// ```
/// nscdd::NewtonReport report = nscdd::newton_solve(problem, {.tolerance = 1e-10});
/// ```
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <Eigen/SparseLU>
#include <functional>
#include <limits>
#include <utility>

#include "nscdd/iterate/convergence_test.hpp"
#include "nscdd/reference/interior_point.hpp"
#include "nscdd/reference/proximal_newton.hpp"
#include "nscdd/sweep/nlgs.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Factorisation by default. The program takes UMFPACK for large matrices.
using SparseLU = Eigen::SparseLU<Eigen::SparseMatrix<double>>;

/// Judges impulses: notes their residual in the report and says whether to stop.
using NewtonJudge = std::function<bool(const Eigen::VectorXd&, NewtonReport&)>;

/// r: first guess, then the best answer met. Compiled once per size of an impulse, whoever judges and factorises.
template <int size>
void newton_solve(const LinearContacts<size>& linear, const NewtonOptions& options, const NewFactors& new_factors,
                  Eigen::VectorXd& r, const NewtonJudge& done, NewtonReport& report) {
    constexpr double statuses_known = 1e-7;  // from there Newton's method takes a few steps
    if (done(r, report)) return;
    // Where walls leave the grains no room impulses grow without end, and eta, relative to them, falls. So an answer
    // whose velocities are hardly better than those of the first guess must not need far larger impulses.
    const double first = report.residual, energy = linear.energy(r);
    bool runaway = false;
    const NewtonJudge judge = [&](const Eigen::VectorXd& answer, NewtonReport& so_far) {
        const bool stop = done(answer, so_far);
        const double now = linear.energy(answer);
        if (energy == 0 || now <= 10 * energy || so_far.residual * std::sqrt(now) <= 0.1 * first * std::sqrt(energy))
            return stop;
        runaway = runaway || so_far.residual < first;
        so_far.converged = false;
        so_far.residual = (std::max)(so_far.residual, first);
        return false;
    };
    if (first > statuses_known) {
        double least = first;
        Eigen::VectorXd best = r;
        detail::InteriorPoint<size> approach(linear, new_factors);
        approach(
            r, first,
            [&](const Eigen::VectorXd& answer) {
                const bool stop = judge(answer, report);
                if (report.residual < least) {
                    least = report.residual;
                    best = answer;
                }
                return stop || report.residual <= statuses_known;
            },
            (std::min)(options.max_interior, options.max_iterations), report);
        report.interior = report.iterations;
        if (runaway && least == first) {  // there is no answer
            judge(r, report);
            return;
        }
        r.swap(best);
    }
    // From inside the cones the law holds to within the residual only: one step of Newton's method makes it exact.
    detail::ProximalNewton<size>(linear, options, new_factors)(
        r,
        [&](const Eigen::VectorXd& answer, NewtonReport& so_far) {
            return judge(answer, so_far) && (so_far.outer > 0 || so_far.interior == 0);
        },
        report);
}

}  // namespace detail

/// Solves the problem of bodies, in and out as for nlgs(). It ends when eta and the penetration are small enough. Where
/// a cap comes first it has not converged, and returns the best answer met. That happens where walls leave the grains
/// no room. Throws std::invalid_argument for a faulty problem or options, std::runtime_error when the residual is not
/// finite.
template <class Factorisation = detail::SparseLU, class M>
NewtonReport newton_solve(ContactProblem<M>& problem, const NewtonOptions& options = {}) {
    detail::check_options(options);
    validate(problem);
    NewtonReport report;
    if (problem.contact_count() == 0) return report;
    const SolveOptions stop{
        .tolerance = options.tolerance, .bounds = options.bounds, .max_iterations = (std::numeric_limits<int>::max)()};
    // Both take V_free from what is given: sweeps would leave round-off of their impulses, however large, in it.
    ConvergenceTest<M> test(problem, stop);
    const detail::LinearContactsOf<M> linear = linear_contacts(problem);
    SolveOptions sweeps = stop.accelerated();
    sweeps.max_iterations = options.warm_sweeps;
    if (options.warm_sweeps > 0) {
        ContactProblem<M> start = problem;
        Sweeper<M> sweeper;
        if (const SolveReport swept = detail::nlgs_of_valid(problem, sweeps, sweeper);
            !swept.converged && detail::too_deep(swept, stop, problem.least_radius)) {
            // Maybe walls leave no room, and accelerated impulses run away: they must not become the first guess.
            problem = std::move(start);
            sweeps.window = 0;
            detail::nlgs_of_valid(problem, sweeps, sweeper);
        }
    }
    Eigen::VectorXd r(linear.free.size());
    detail::each_contact(problem,
                         [&, k = std::size_t{0}](const Contact<M>& c, auto) mutable { linear.at(r, k++) = c.r; });
    detail::newton_solve<detail::impulse_size<M>>(
        linear, options, detail::FactorsBy<Factorisation>::create, r,
        [&](const Eigen::VectorXd& answer, SolveReport& so_far) {
            detail::each_contact(
                problem, [&, k = std::size_t{0}](Contact<M>& c, auto) mutable { c.r = linear.at(answer, k++); });
            test.set_velocities(problem);  // anew: steps through huge impulses would leave their round-off
            test.mark();                   // no line worth following leads from the last iterate to this one
            test(so_far);
            // solved, and contacts still close: there is no answer
            return so_far.converged || (so_far.residual <= (std::min)(1e-7, options.tolerance) &&
                                        detail::too_deep(so_far, stop, problem.least_radius));
        },
        report);
    if (!report.converged) test.conclude(report);
    return report;
}

/// Solves the problem with a stored W until measure(r) <= tolerance. r is first guess and best answer, one impulse of
/// each contact. Throws std::invalid_argument for a faulty problem, or a W without a positive diagonal,
/// std::runtime_error when the measure is not finite.
template <class Factorisation = detail::SparseLU, int dim>
NewtonReport newton_solve(const DelassusProblem<dim>& problem, std::vector<typename DelassusProblem<dim>::Vec>& r,
                          const NewtonOptions& options, auto&& measure) {
    detail::check_options(options);
    validate(problem, r);
    NewtonReport report;
    if (problem.contact_count() == 0) return report;
    const LinearContacts<dim> linear = linear_contacts(problem);
    Eigen::VectorXd all(linear.free.size());
    for (std::size_t c = 0; c < linear.contacts(); ++c) linear.at(all, c) = r[c];
    detail::newton_solve<dim>(
        linear, options, detail::FactorsBy<Factorisation>::create, all,
        [&](const Eigen::VectorXd& answer, SolveReport& so_far) {
            for (std::size_t c = 0; c < linear.contacts(); ++c) r[c] = linear.at(answer, c);
            so_far.residual = measure(std::as_const(r));
            if (!std::isfinite(so_far.residual)) throw std::runtime_error("the residual is not finite: check W and q");
            return so_far.converged = so_far.residual <= options.tolerance;
        },
        report);
    return report;
}

/// Solves to a tolerance of eta (METHOD.md, section 5.1). The mean of the diagonal of W_cc stands for W_cc.
template <class Factorisation = detail::SparseLU, int dim>
NewtonReport newton_solve(const DelassusProblem<dim>& problem, std::vector<typename DelassusProblem<dim>::Vec>& r,
                          const NewtonOptions& options = {}) {
    return newton_solve<Factorisation>(problem, r, options, [&](const auto& answer) {
        double change = 0, energy = 0, next_energy = 0, round_off = 0;
        for (std::size_t c = 0; c < problem.contact_count(); ++c) {
            const double weight = problem.blocks[static_cast<std::size_t>(problem.diagonal[c])].trace() / dim;
            using Vec = typename DelassusProblem<dim>::Vec;
            const Vec z = answer[c] - problem.velocity(c, answer) / weight;
            const Vec next = detail::project_coulomb<dim>(z, Vec::Unit(0), problem.friction[c]).value;
            change += weight * (next - answer[c]).squaredNorm();
            energy += weight * answer[c].squaredNorm();
            next_energy += weight * next.squaredNorm();
            round_off += problem.q[c].squaredNorm() / weight;
        }
        return detail::energy_residual(change, energy, next_energy, round_off);
    });
}

}}  // namespace nscdd::NSCDD_ABI
