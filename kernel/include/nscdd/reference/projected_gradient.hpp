/// @file
/// Projected gradient methods on Coulomb's law as it is, for comparison with Gauss-Seidel: spectral (Barzilai-Borwein)
/// steps, or Nesterov's acceleration with restarts.
/// ```
/// nscdd::SolveReport report = nscdd::projected_gradient(problem, {.tolerance = 1e-6});
/// ```
/// With De Saxce's correction s = mu |u_t| n [DeSaxce98] the law is r = P_K(r - rho (u + s)), P_K the nearest point of
/// the cone. With s frozen, u + s is the gradient of a convex quadratic, and s follows.
///
/// Gradients, steps and distances are in the metric of D, the mean of the diagonal of each W_cc. One number a contact
/// keeps the cone round, and takes mass ratios out.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "nscdd/core/validate.hpp"
#include "nscdd/iterate/convergence_test.hpp"
#include "nscdd/reference/coulomb_projection.hpp"
#include "nscdd/reference/linear_contacts.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Methods of the steps (METHOD.md, section 11).
enum class Descent {
    spectral,  ///< SPG2 [Birgin00]: Barzilai-Borwein steps, not monotone
    nesterov,  ///< APGD [Mazhar15]: Nesterov's extrapolation, restarted where it climbs
};

namespace detail {

/// The contacts as the iteration sees them.
template <int size>
struct GradientContacts : bases::ConeContacts<size> {
    std::vector<typename bases::ConeContacts<size>::Vec> r, u;  ///< impulse [N s], velocity with the bias [m/s]
};

/// Where u comes from: bodies, matrix-free. move() adds t d to the impulses and sets u; one product with W.
template <class M>
class BodyGradient {
  public:
    static constexpr int size = impulse_size<M>;
    using Vec = typename M::Impulse;

    explicit BodyGradient(ContactProblem<M>& problem) : problem_(problem) {
        each_contact(problem, [&](const Contact<M>& c, auto kind) {
            contacts.add(problem, c, kind);
            contacts.r.push_back(c.r);
            contacts.u.push_back(biased_velocity(problem, c, kind));
        });
    }
    void move(const std::vector<Vec>& d, double t) {
        std::size_t k = 0, of = 0;
        each_contact(problem_, [&](Contact<M>& c, auto kind) {
            const Vec change = t * d[k];
            contacts.r[k++] = c.r += change;
            apply_impulse(problem_, c, change, kind);
        });
        each_contact(problem_,
                     [&](const Contact<M>& c, auto kind) { contacts.u[of++] = biased_velocity(problem_, c, kind); });
    }

    GradientContacts<size> contacts;

  private:
    ContactProblem<M>& problem_;
};

/// The same gradient from a stored W. Throws std::invalid_argument where its diagonal is not positive.
template <int dim>
class BlockGradient {
  public:
    static constexpr int size = dim;
    using Vec = typename DelassusProblem<dim>::Vec;

    BlockGradient(const DelassusProblem<dim>& problem, const std::vector<Vec>& r) : problem_(problem) {
        contacts.add(problem);
        contacts.r = contacts.u = r;
        move(r, 0);
    }
    void move(const std::vector<Vec>& d, double t) {
        for (std::size_t c = 0; c < d.size(); ++c) contacts.r[c] += t * d[c];
        for (std::size_t c = 0; c < d.size(); ++c) contacts.u[c] = problem_.velocity(c, contacts.r);
    }

    GradientContacts<dim> contacts;

  private:
    const DelassusProblem<dim>& problem_;
};

/// The iteration, for bodies or a stored W. One call of iterate() is one product with W, as a sweep is, but for steps
/// refused.
template <class Gradient>
class ProjectedGradient {
  public:
    using Vec = typename Gradient::Vec;
    static constexpr int size = Gradient::size;

    ProjectedGradient(Gradient& gradient, Descent descent)
        : of_(gradient),
          contacts_(gradient.contacts),
          descent_(descent),
          d_(contacts_.contacts()),
          u_(contacts_.contacts()) {
        short_.fill(largest_step);
    }

    void iterate() {
        if (descent_ == Descent::spectral)
            spectral();
        else
            nesterov();
    }

  private:
    static constexpr double least_step = 1e-8, largest_step = 1e8;

    /// mu |u_t|, what De Saxce adds to u_n.
    double correction(std::size_t c) const {
        if constexpr (size == 1) return 0;
        const Vec &u = contacts_.u[c], &n = contacts_.normal[c];
        return contacts_.friction[c] * (u - u.dot(n) * n).norm();
    }
    Vec project(std::size_t c, const Vec& z) const {
        return detail::project_cone<size>(z, contacts_.normal[c], contacts_.friction[c]).value;
    }

    struct Sums {
        double slope = 0;   ///< g . d
        double length = 0;  ///< d . D d
    };
    /// d = P_K(r - t D^-1 g) - r, and u kept aside.
    Sums direction(double t) {
        Sums sums;
        for (std::size_t c = 0; c < d_.size(); ++c) {
            const Vec g = contacts_.u[c] + correction(c) * contacts_.normal[c];
            d_[c] = project(c, contacts_.r[c] - t / contacts_.weight[c] * g) - contacts_.r[c];
            sums.slope += g.dot(d_[c]);
            sums.length += contacts_.weight[c] * d_[c].squaredNorm();
            u_[c] = contacts_.u[c];
        }
        return sums;
    }

    struct Curvature {
        double along = 0;  ///< d . W d
        double image = 0;  ///< W d . D^-1 W d
    };
    Curvature curvature() const {
        Curvature w;
        for (std::size_t c = 0; c < d_.size(); ++c) {
            const Vec change = contacts_.u[c] - u_[c];
            w.along += d_[c].dot(change);
            w.image += change.squaredNorm() / contacts_.weight[c];
        }
        return w;
    }

    void spectral() {
        const Sums sums = direction(step_);
        if (!(sums.length > 0)) return;
        of_.move(d_, 1);
        const Curvature w = curvature();
        // The change of the quadratic with s frozen, compared with the largest of the last values. If that is exceeded:
        // the exact minimum along d, which always is below.
        const double highest = *std::max_element(values_.begin(), values_.end());
        double t = 1;
        if (value_ + sums.slope + 0.5 * w.along > highest + 1e-4 * sums.slope && w.along > 0) {
            t = std::clamp(-sums.slope / w.along, 0.0, 1.0);
            of_.move(d_, t - 1);
        }
        value_ += t * (sums.slope + 0.5 * t * w.along);
        values_[++slot_ % values_.size()] = value_;
        if (w.along > 0) choose_step(sums.length / w.along, w.along / w.image);
    }

    /// Takes the long one of Barzilai and Borwein's two steps, or the least of the last short ones where they differ by
    /// more than a factor that adapts itself [Bonettini09]. Either step alone takes four times the iterations.
    void choose_step(double length, double shorter) {
        short_[slot_ % short_.size()] = shorter;
        if (shorter < switch_ * length) {
            step_ = *std::min_element(short_.begin(), short_.end());
            switch_ *= 0.9;
        } else {
            step_ = length;
            switch_ *= 1.1;
        }
        step_ = std::clamp(step_, least_step, largest_step);
    }

    /// From y, extrapolated past r by the last change, to P_K(y - t D^-1 (u + s)); t is cut until the quadratic lies
    /// below its model there, and grows again. s stays for some iterations: with an s that moves the extrapolation goes
    /// round in circles.
    void nesterov() {
        if (y_.empty()) {
            y_.resize(d_.size()), slip_.resize(d_.size());
            before_ = contacts_.r, u_before_ = contacts_.u;
        }
        if (age_++ % 30 == 0)
            for (std::size_t c = 0; c < d_.size(); ++c) slip_[c] = correction(c);
        const double next = 0.5 * momentum_ * (std::sqrt(momentum_ * momentum_ + 4) - momentum_);
        const double beta = momentum_ * (1 - momentum_) / (momentum_ * momentum_ + next);
        momentum_ = next;
        for (std::size_t c = 0; c < d_.size(); ++c) {
            Vec &r = contacts_.r[c], &u = contacts_.u[c];
            y_[c] = r + beta * (r - before_[c]);
            u_[c] = u + beta * (u - u_before_[c]);
            before_[c] = r, u_before_[c] = u;
        }
        double climb = 0;
        for (int k = 0; k < 50; ++k) {
            double length = 0, along = 0;
            climb = 0;
            for (std::size_t c = 0; c < d_.size(); ++c) {
                const Vec g = u_[c] + slip_[c] * contacts_.normal[c];
                const Vec p = project(c, y_[c] - step_ / contacts_.weight[c] * g);
                d_[c] = p - contacts_.r[c];
                length += contacts_.weight[c] * (p - y_[c]).squaredNorm();
                climb += g.dot(p - before_[c]);
            }
            of_.move(d_, 1);
            for (std::size_t c = 0; c < d_.size(); ++c) along += (contacts_.r[c] - y_[c]).dot(contacts_.u[c] - u_[c]);
            if (!(step_ * along > length)) break;
            step_ = 0.9 * length / along;
        }
        step_ *= 1.1;
        if (climb > 0) {
            momentum_ = 1;
            before_ = contacts_.r, u_before_ = contacts_.u;
        }
    }

    Gradient& of_;
    GradientContacts<size>& contacts_;
    Descent descent_;
    std::vector<Vec> d_, u_, y_, before_, u_before_;
    std::vector<double> slip_;
    double step_ = 1;

    double value_ = 0, switch_ = 0.5;  ///< spectral
    std::array<double, 10> values_{};
    std::array<double, 5> short_;
    std::size_t slot_ = 0;

    double momentum_ = 1;  ///< nesterov
    int age_ = 0;          ///< of s
};

}  // namespace detail

/// Solves the problem of bodies, in and out as for nlgs(). The options `sweeps`, `relaxation` and `window` are ignored.
/// Throws std::runtime_error when the residual is not finite, std::invalid_argument for a faulty problem and for
/// options without an end.
template <class M>
SolveReport projected_gradient(ContactProblem<M>& problem, const SolveOptions& options,
                               Descent descent = Descent::spectral) {
    detail::check_options(options);
    validate(problem);
    SolveReport report;
    if (problem.contact_count() == 0) return report;
    ConvergenceTest<M> over(problem, options);
    detail::BodyGradient<M> gradient(problem);
    detail::ProjectedGradient iteration(gradient, descent);
    do {
        const int count = detail::until_test(options, report, options.interval());
        for (int k = 0; k < count; ++k) {
            if (k + 1 == count) over.keep();
            iteration.iterate();
        }
        report.iterations += count;
    } while (!over(report));
    return report;
}

/// Solves the problem with a stored W until measure(r) <= tolerance. r is first guess and answer, one impulse of each
/// contact. Throws std::invalid_argument for a faulty problem, or a W without a positive diagonal, std::runtime_error
/// when the measure is not finite.
template <int dim>
SolveReport projected_gradient(const DelassusProblem<dim>& problem, std::vector<typename DelassusProblem<dim>::Vec>& r,
                               const SolveOptions& options, Descent descent, auto&& measure) {
    detail::check_options(options);
    validate(problem, r);
    if (problem.contact_count() == 0) return {};
    detail::BlockGradient<dim> gradient(problem, r);
    detail::ProjectedGradient iteration(gradient, descent);
    const SolveReport report = detail::iterate_until(
        options, [&] { iteration.iterate(); }, [&] { return measure(std::as_const(gradient.contacts.r)); });
    r = gradient.contacts.r;
    return report;
}

}}  // namespace nscdd::NSCDD_ABI
