#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <vector>

#include "nscdd/reference/cone_scaling.hpp"
#include "nscdd/reference/linear_contacts.hpp"
#include "nscdd/reference/sparse_factors.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// An interior-point method on Coulomb's law as it is, in De Saxce's form [DeSaxce98], from an estimate, or none, until
/// the status of every contact is known,
///     x = B r,   w = u_free + L x + mu |w_t| n,   r in K,  w in K*,  r . w = 0       (LinearContacts for L, B)
/// It works on hyperstatic packings too: of all impulses that are answers it heads for the centre. The Jacobian is I +
/// B Q L with one block of Q for each contact. The velocity mu |w_t| n is differentiated like the rest, so Q is not
/// symmetric; [Acary11] freezes it, and iterates on it.
template <int size>
class InteriorPoint {
  public:
    /// Keeps references to both arguments.
    InteriorPoint(const LinearContacts<size>& problem, const NewFactors& new_factors)
        : problem_(problem), new_factors_(new_factors), contacts_(problem.contacts()) {}

    /// Starts from r, as near to it as the residual allows; residual 1: nothing is known. Calls judge(r) on the
    /// impulses of every iterate until it says stop, or no further step can be found. Counts in report.iterations and
    /// report.factorisations, at most max_iterations.
    template <class Report>
    void operator()(const Eigen::VectorXd& r, double residual, auto&& judge, int max_iterations, Report& report) {
        if (!start(r, residual)) return;
        const std::unique_ptr<SparseFactors> factors = new_factors_();
        bool analysed = false;
        while (!judge(std::as_const(r_)) && scale()) {
            double length = 0;
            for (int attempt = 0; attempt < 6 && length < 0.1; ++attempt) {
                if (attempt > 0) soften(length);
                if (report.iterations >= max_iterations) return;
                ++report.iterations;
                const Eigen::SparseMatrix<double> jacobian = linearise();
                if (!analysed) factors->analyze(jacobian);
                analysed = true;
                ++report.factorisations;
                if (!factors->factorize(jacobian)) return;
                length = find_direction(*factors);
                if (!std::isfinite(dx_.squaredNorm() + dr_.squaredNorm())) return;
            }
            if (length < 1e-3) return;  // no further step, as when there is no answer
            if (length > 0.5)
                for (Local& local : contacts_) local.compliance = local.compliance > 1e-8 ? local.compliance / 3 : 0;
            x_ += length * dx_;
            r_ += length * dr_;
            advance(length);
        }
    }

  private:
    using Vec = typename Cone<size>::Vec;
    using Block = typename Cone<size>::Block;

    /// A contact in coordinates where the cone of friction is the circular one of 45 degrees: r = T r^, w^ = T w.
    /// Without friction only the normal is left. Has all that changes with the iterate.
    struct Local {
        Cone<size> cone;
        Block to_world, to_cone;  ///< T, and T^-1 where there is one
        Vec r, w;                 ///< of the cone
        ConeScaling<size> scaling;
        Vec slip;               ///< mu w_t/|w_t|
        double compliance = 0;  ///< added to W_cc for the step alone, in shares of its diagonal
        Block response, kept;   ///< dr = kept T k - response (L dx - residual), see linearise()
    };

    /// False when there is nothing to solve for: no impulses, no velocities.
    bool start(const Eigen::VectorXd& r, double residual) {
        r_ = r;
        x_ = problem_.state * r;
        w_ = problem_.relative_velocity(r);
        double energy = problem_.energy(r);
        for (std::size_t c = 0; c < contacts_.size(); ++c)
            energy += std::pow(problem_.at(problem_.free, c).dot(problem_.normal[c]), 2) / problem_.weight[c];
        energy *= std::sqrt(std::clamp(residual, 1e-10, 1.0)) / double(contacts_.size());
        if (!(energy > 0 && std::isfinite(energy))) return false;
        for (std::size_t c = 0; c < contacts_.size(); ++c) {
            Local& local = contacts_[c];
            const Vec n = local.cone.n = problem_.normal[c];
            const double mu = problem_.friction[c];
            const Block nn = n * n.transpose();
            if (size == 1 || mu == 0) {
                local.to_world = local.to_cone = nn;
            } else {
                local.to_world = Block::Identity() + (1 / mu - 1) * nn;
                local.to_cone = Block::Identity() + (mu - 1) * nn;
            }
            const double weight = problem_.weight[c];
            const Vec w = problem_.at(w_, c);
            const Vec y = weight * (local.to_cone * problem_.at(r_, c)) -
                          local.to_world * (w + mu * local.cone.tangent(w).norm() * n);
            const auto [inside, outside] = local.cone.split(y, weight * energy);
            problem_.at(r_, c) = local.to_world * inside / weight;
            problem_.at(w_, c) = local.to_cone * outside;
        }
        return true;
    }

    /// Residuals and scalings at the iterate; false when round-off has taken a contact out of its cone.
    bool scale() {
        state_residual_ = x_ - problem_.state * r_;
        residual_ = w_ - problem_.free - problem_.velocity * x_;
        gap_ = inconsistency_ = 0;
        for (std::size_t c = 0; c < contacts_.size(); ++c) {
            Local& local = contacts_[c];
            const Vec w = problem_.at(w_, c), r = problem_.at(r_, c), t = local.cone.tangent(w);
            const double length = t.norm();
            local.slip = length > 0 ? Vec(problem_.friction[c] / length * t) : Vec(Vec::Zero());
            problem_.at(residual_, c) -= problem_.friction[c] * length * local.cone.n;
            local.w = local.to_world * w;
            local.r = local.to_cone * r;
            if (!local.scaling.compute(local.cone, local.w, local.r)) return false;
            gap_ += local.w.dot(local.r);
            inconsistency_ += problem_.at(residual_, c).norm() * r.norm();
        }
        return true;
    }

    /// dr^ = k - W^-2 dw^,  dw = (I + n slip^T)(L dx + compliance D dr - residual),
    /// so dr = kept T k - response (L dx - residual), k the constant given to solve().
    Eigen::SparseMatrix<double> linearise() {
        std::vector<Eigen::Triplet<double>> entries;
        entries.reserve(contacts_.size() * size * size);
        for (std::size_t c = 0; c < contacts_.size(); ++c) {
            Local& local = contacts_[c];
            const Block couple = Block::Identity() + local.cone.n * local.slip.transpose();
            const Block stiff =
                local.to_world * local.scaling.inverse * local.scaling.inverse * local.to_world * couple;
            const Block relaxed = Block::Identity() + local.compliance * problem_.weight[c] * stiff;
            local.kept = relaxed.inverse();
            local.response = local.kept * stiff;
            const int row = static_cast<int>(c) * size;
            for (int i = 0; i < size; ++i)
                for (int j = 0; j < size; ++j) entries.emplace_back(row + i, row + j, local.response(i, j));
        }
        response_.resize(r_.size(), r_.size());
        response_.setFromTriplets(entries.begin(), entries.end());
        Eigen::SparseMatrix<double> jacobian(x_.size(), x_.size());
        jacobian.setIdentity();
        jacobian += problem_.state * Eigen::SparseMatrix<double>(response_ * problem_.velocity);
        return jacobian;
    }

    /// Predictor and corrector [Mehrotra92]; returns the length of the step to take.
    double find_direction(const SparseFactors& factors) {
        solve(factors, [](const Local& local) -> Vec { return -local.r; });
        const double step = (std::min)(1.0, longest());
        double left = 0;
        for (std::size_t c = 0; c < contacts_.size(); ++c) {
            const Local& local = contacts_[c];
            left += (local.w + step * (local.to_world * problem_.at(dw_, c)))
                        .dot(local.r + step * (local.to_cone * problem_.at(dr_, c)));
        }
        const double sigma = std::clamp(std::pow(left / gap_, 3), 1e-4, 1.0);
        // the gap must not fall ahead of the inconsistency of the velocities
        const double target = (std::max)(sigma * gap_, 0.1 * inconsistency_) / double(contacts_.size());
        const Eigen::VectorXd dr = dr_, dw = dw_;
        std::size_t c = 0;
        solve(factors, [&](const Local& local) -> Vec {
            const ConeScaling<size>& s = local.scaling;
            const Vec second = local.cone.product(s.inverse * (local.to_world * problem_.at(dw, c)),
                                                  s.w * (local.to_cone * problem_.at(dr, c)));
            ++c;
            const Vec wanted = target * local.cone.n - local.cone.product(s.point, s.point) - second;
            return s.inverse * local.cone.quotient(s.point, wanted);
        });
        return (std::min)(1.0, 0.95 * longest());
    }

    void solve(const SparseFactors& factors, auto&& constant) {
        Eigen::VectorXd own(r_.size());
        for (std::size_t c = 0; c < contacts_.size(); ++c)
            problem_.at(own, c) = contacts_[c].kept * (contacts_[c].to_world * constant(contacts_[c]));
        const Eigen::VectorXd right = problem_.state * (own + response_ * residual_) - state_residual_;
        dx_ = factors.solve(right);
        dw_ = problem_.velocity * dx_ - residual_;
        dr_ = own - response_ * dw_;
        for (std::size_t c = 0; c < contacts_.size(); ++c) {
            const Local& local = contacts_[c];
            const Vec change = problem_.at(dw_, c) + local.compliance * problem_.weight[c] * problem_.at(dr_, c);
            problem_.at(dw_, c) = change + local.slip.dot(change) * local.cone.n;
        }
    }

    /// w += length dw, and with |w_t| as it then is: w would leave its cone by the curvature of |w_t| otherwise.
    void advance(double length) {
        w_ += length * dw_;
        for (std::size_t c = 0; c < contacts_.size(); ++c) {
            const Local& local = contacts_[c];
            const Vec w = problem_.at(w_, c);
            problem_.at(w_, c) +=
                (problem_.friction[c] * local.cone.tangent(w).norm() - local.slip.dot(w)) * local.cone.n;
        }
    }

    /// The step at which the contact would leave its cones, at most `most`. For w this is where w_n = mu |w_t|.
    double step_limit(std::size_t c, double most) const {
        const Local& local = contacts_[c];
        const Vec edge = local.cone.n - local.slip;
        const double slack = edge.dot(problem_.at(w_, c)), slope = edge.dot(problem_.at(dw_, c));
        const double t = slope < 0 ? (std::min)(most, -slack / slope) : most;
        return local.cone.step_limit(local.r, local.to_cone * problem_.at(dr_, c), t);
    }

    double longest() const {
        double t = 2;
        for (std::size_t c = 0; c < contacts_.size(); ++c) t = step_limit(c, t);
        return t;
    }

    /// Where friction locks, the path of the central answers may turn back, and the Jacobian is singular at the turn.
    /// The contacts that stand in the way are then made more compliant for this step and the next ones, which leads
    /// past it in pseudo-time; the answer is untouched, since at the end dr = 0.
    void soften(double length) {
        for (std::size_t c = 0; c < contacts_.size(); ++c)
            if (step_limit(c, 2.0) < 3 * length)
                contacts_[c].compliance = (std::max)(10 * contacts_[c].compliance, 1e-3);
    }

    const LinearContacts<size>& problem_;
    const NewFactors& new_factors_;
    std::vector<Local> contacts_;
    Eigen::VectorXd x_, r_, w_, dx_, dr_, dw_;
    Eigen::VectorXd state_residual_, residual_;  ///< x - B r, and of the velocities
    Eigen::SparseMatrix<double> response_;       ///< Q
    double gap_ = 0, inconsistency_ = 0;         ///< sum of r . w, and of |r| |residual|
};

}}}  // namespace nscdd::NSCDD_ABI::detail
