/// @file
/// Proximal-point iteration around a semismooth Newton method, on Coulomb's law as it is. It is exact to round-off, and
/// quick where it starts near an answer.
///
/// Outer iteration k adds (r - r_k)/rho_c to the velocity of each contact, rho_c = rho / mean of diag W_cc. That makes
/// the problem regular however hyperstatic the packing is. Its answer is r_{k+1}, and a fixed point satisfies the law
/// itself [Rockafellar76], [Acary18]. With the matrices of LinearContacts, and x the change of the state, the iteration
/// reads:
/// ```
/// F(x) = x - B (r - r_k) = 0,   r = P(r_k - rho_c (u_k + L x)).
/// ```
/// As the unknown is the change since r_k, round-off of V is not multiplied by rho.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <Eigen/SparseCore>
#include <algorithm>
#include <limits>

#include "nscdd/reference/coulomb_projection.hpp"
#include "nscdd/reference/linear_contacts.hpp"
#include "nscdd/reference/newton_options.hpp"
#include "nscdd/reference/sparse_factors.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The iteration on any LinearContacts.
template <int size>
class ProximalNewton {
  public:
    /// Keeps references to problem and new_factors, and a copy of the options.
    ProximalNewton(const LinearContacts<size>& problem, const NewtonOptions& options, const NewFactors& new_factors)
        : problem_(problem), options_(options), new_factors_(new_factors) {}

    /// r: first guess, then the best answer met. done(r, report) judges r: it notes the residual in the report and says
    /// whether to stop. Never loops without bound: the options cap the steps.
    void operator()(Eigen::VectorXd& r, auto&& done, NewtonReport& report) {
        double least = std::numeric_limits<double>::infinity();
        start_ = r;
        rho_ = 1;
        for (;;) {
            const bool stop = done(start_, report);
            if (report.converged || report.residual < least) {
                least = report.residual;
                r = start_;
            }
            if (stop || report.outer >= options_.max_outer || report.iterations >= options_.max_iterations) break;
            ++report.outer;
            const int before = report.iterations;
            Point point;
            if (proximal_step(point, report)) {
                start_.swap(point.r);
                if (rho_ < largest_rho) rho_ *= report.iterations - before <= 10 ? 10 : 3;
            } else if (rho_ > least_rho) {
                rho_ /= 10;
            }
        }
        if (report.residual > least) done(r, report);
    }

  private:
    enum class Law { exact, convex };
    static constexpr double least_rho = 1e-6, largest_rho = 1e12;

    /// x = B y: for the convex law F is the gradient of a potential, whose slope along dy is dy . L F.
    struct Point {
        Eigen::VectorXd x, y, r, f;
        double norm = 0;  ///< |F|
        double prox = 0;  ///< |(r - r_k)/rho| as an energy norm: the error of r_{k+1} that only further k reduce
    };

    ProjectedImpulse<size> project(std::size_t c, const Eigen::VectorXd& u, Law law) const {
        const double penalty = rho_ / problem_.weight[c];
        typename LinearContacts<size>::Vec z = problem_.at(start_, c) - penalty * problem_.at(u, c);
        if (law == Law::exact) return project_coulomb<size>(z, problem_.normal[c], problem_.friction[c]);
        z -= penalty * slip_[c] * problem_.normal[c];
        return project_cone<size>(z, problem_.normal[c], problem_.friction[c]);
    }

    void evaluate(Point& p, Law law) const {
        const Eigen::VectorXd u = base_ + problem_.velocity * p.x;
        p.r.resize(start_.size());
        for (std::size_t c = 0; c < problem_.contacts(); ++c) problem_.at(p.r, c) = project(c, u, law).value;
        const Eigen::VectorXd change = p.r - start_;
        p.f = p.x - problem_.state * change;
        p.norm = p.f.norm();
        p.prox = std::sqrt(problem_.energy(change)) / rho_;
    }

    /// r_{k+1} from r_k. Where Newton fails on the exact law, it starts again from the answer of the convex one, which
    /// it finds from everywhere; only the slip velocity is frozen there, so that answer is near.
    bool proximal_step(Point& p, NewtonReport& report) {
        base_ = problem_.relative_velocity(start_);
        p.x.setZero(problem_.states());
        p.y.setZero(start_.size());
        const Point origin = p;
        if (size > 1 && newton(p, Law::exact, 15, report)) return true;
        slip_.resize(problem_.contacts());
        for (std::size_t c = 0; c < problem_.contacts(); ++c) {
            const typename LinearContacts<size>::Vec u = problem_.at(base_, c);
            slip_[c] = problem_.friction[c] * (u - u.dot(problem_.normal[c]) * problem_.normal[c]).norm();
        }
        p = origin;
        if (!newton(p, Law::convex, 60, report)) return false;
        return size == 1 || newton(p, Law::exact, 15, report);
    }

    bool newton(Point& p, Law law, int most, NewtonReport& report) {
        evaluate(p, law);
        for (int k = 0; k <= most && report.iterations < options_.max_iterations; ++k) {
            const double target = 0.01 * options_.tolerance * std::sqrt(problem_.energy(p.r));
            if (p.norm <= (std::max)(0.1 * p.prox, target)) return true;
            ++report.iterations;
            const Eigen::SparseMatrix<double> slope = impulse_slope(p, law);
            Eigen::SparseMatrix<double> jacobian(p.x.size(), p.x.size());
            jacobian.setIdentity();
            jacobian += problem_.state * slope;
            ++report.factorisations;
            const std::unique_ptr<SparseFactors> factors = new_factors_();
            factors->analyze(jacobian);
            if (!factors->factorize(jacobian)) return false;
            const Eigen::VectorXd dx = factors->solve(-p.f);
            const Eigen::VectorXd dy = p.r - start_ - slope * dx - p.y;
            Point next;
            const Line line{p, dx, dy, law};
            if ((law == Law::exact ? backtrack(line, next) : minimise(line, next)) == 0) return false;
            std::swap(p, next);
        }
        return false;
    }

    /// Both line searches return the step, 0 when there is none, and the point it leads to.
    struct Line {
        const Point& from;
        const Eigen::VectorXd &dx, &dy;
        Law law;
    };
    void move(const Line& line, double t, Point& next) const {
        next.x = line.from.x + t * line.dx;
        next.y = line.from.y + t * line.dy;
        evaluate(next, line.law);
    }

    /// The longest of the steps 1, 1/2, 1/4... that reduces |F|.
    double backtrack(const Line& line, Point& next) const {
        for (double t = 1; t > 1e-3; t /= 2) {
            move(line, t, next);
            if (next.norm <= (1 - 1e-4 * t) * line.from.norm) return t;
        }
        return 0;
    }

    /// The step to the minimum of the convex law's potential, where its slope along dy vanishes; it is piecewise
    /// linear. Unlike |F| the potential lets a step pass the kinks where contacts open, close or begin to slide.
    double minimise(const Line& line, Point& next) const {
        const auto slope = [&](const Point& p) { return line.dy.dot(problem_.velocity * p.f); };
        const double initial = slope(line.from);
        if (!(initial < 0)) return backtrack(line, next);  // round-off, or a W that is not symmetric
        double low = 0, high = 1, at_low = initial, t = 1;
        move(line, t, next);
        double at_high = slope(next);
        if (!std::isfinite(at_high)) return 0;
        if (at_high <= -0.1 * initial) return t;
        for (int k = 0; k < 40; ++k) {  // regula falsi, every third time a bisection
            t = k % 3 == 2 ? 0.5 * (low + high) : low - at_low * (high - low) / (at_high - at_low);
            move(line, t, next);
            const double here = slope(next);
            if (std::abs(here) <= -0.01 * initial) break;
            (here > 0 ? high : low) = t;
            (here > 0 ? at_high : at_low) = here;
        }
        return t;
    }

    /// -dr/dx = rho_c P' L, open contacts left out.
    Eigen::SparseMatrix<double> impulse_slope(const Point& p, Law law) const {
        const Eigen::VectorXd u = base_ + problem_.velocity * p.x;
        std::vector<Eigen::Triplet<double>> entries;
        for (std::size_t c = 0; c < problem_.contacts(); ++c) {
            const ProjectedImpulse<size> projected = project(c, u, law);
            if (projected.open) continue;
            const int row = static_cast<int>(c) * size;
            for (int i = 0; i < size; ++i)
                for (int j = 0; j < size; ++j)
                    entries.emplace_back(row + i, row + j, rho_ / problem_.weight[c] * projected.derivative(i, j));
        }
        Eigen::SparseMatrix<double> derivative(start_.size(), start_.size());
        derivative.setFromTriplets(entries.begin(), entries.end());
        return derivative * problem_.velocity;
    }

    const LinearContacts<size>& problem_;
    const NewtonOptions options_;
    const NewFactors& new_factors_;
    Eigen::VectorXd start_, base_;  ///< r_k, u_k
    std::vector<double> slip_;      ///< mu |u_t| of u_k
    double rho_ = 1;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
