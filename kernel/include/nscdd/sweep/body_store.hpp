#pragma once

#include <cmath>

#include "nscdd/sweep/batch.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The rows of bodies that a Sweeper's batches read and write (BatchLayout).
template <class M>
class BodyStore {
  public:
    AlignedDoubles data;
    std::vector<double> share;  ///< 1/multiplicity of the body of each row

    /// Before the first row_of() of a problem.
    void begin(const ContactProblem<M>& problem) {
        row_of_.assign(problem.bodies.size(), -1);
        used_ = 0;
        inverse_rho_.assign(problem.bodies.size(), 1.0);
        fits_ = true;
        if constexpr (M::friction)
            for (std::size_t g = 0; g < problem.bodies.size(); ++g) {
                const Body<M>& body = problem.bodies[g];
                if (body.inv_mass > 0 && body.inv_inertia > 0)
                    inverse_rho_[g] = std::sqrt(body.inv_inertia / (Layout::kappa * body.inv_mass));
                else
                    fits_ &= body.inv_mass == body.inv_inertia;  // neither moves nor turns: any radius does
            }
    }
    /// Rows cannot hold a body that moves and does not turn, or the other way round.
    bool fits() const { return fits_; }

    /// Where the row of a body begins, given out when first asked for. Rows lie in the order in which a sweep first
    /// reads them: rows that no cache holds are then read in sequence, as contacts are (64,000 spheres: 5 to 8 instead
    /// of 15 ns a contact).
    std::size_t row_of(int body) {
        int& at = row_of_[static_cast<std::size_t>(body)];
        const bool fresh = at < 0;
        at = fresh ? used_ : at;
        used_ += fresh;
        return static_cast<std::size_t>(at) * width;
    }
    /// Fills the rows, after row_of() of all contacts: bodies without a contact come last.
    void load(const ContactProblem<M>& problem) {
        const std::size_t n = problem.bodies.size();
        data.assign((n + 2 * spare_pairs + n % 2) * width, 0.0);  // an even number fills whole packets
        share.assign(n + 2 * spare_pairs, 1.0);
        const auto set_mass = [this](std::size_t at, double inv_mass, double inverse_rho) {
            data[at + Layout::mass_at] = inv_mass;
            if constexpr (Layout::half_gap) data[at + Layout::radius_at] = inverse_rho;
        };
        for (std::size_t g = 0; g < n; ++g) {
            const std::size_t at = row_of(static_cast<int>(g));
            set_mass(at, problem.bodies[g].inv_mass, inverse_rho_[g]);
            set_velocity(g, problem.bodies[g].v);
            share[at / width] = 1.0 / problem.copies(g);
        }
        for (std::size_t spare = 0; spare < 2 * spare_pairs; ++spare) set_mass(no_body(0) + spare * width, 1, 1);
    }

    /// Rows of two dummy bodies for unused lanes. Eight pairs in rotation: a batch that loads a row just stored must
    /// wait for the store.
    static constexpr std::size_t spare_pairs = 8;
    std::size_t no_body(std::size_t batch) const { return (row_of_.size() + 2 * (batch % spare_pairs)) * width; }
    std::size_t no_other_body(std::size_t batch) const { return no_body(batch) + width; }

    double inverse_rho(std::size_t body) const { return inverse_rho_[body]; }

    /// The velocity of a body; its spin is divided by inverse_rho.
    double* row(std::size_t body) { return data.data() + static_cast<std::size_t>(row_of_[body]) * width; }
    typename M::Velocity velocity(std::size_t body) const { return velocity(body, data); }
    /// The same of other rows in this order.
    typename M::Velocity velocity(std::size_t body, const AlignedDoubles& rows) const {
        typename M::Velocity v;
        const double* from = rows.data() + static_cast<std::size_t>(row_of_[body]) * width;
        for (int d = 0; d < M::dof; ++d) v[d] = from[d] * (d < M::dim ? 1.0 : inverse_rho_[body]);
        return v;
    }
    void set_velocity(std::size_t body, const typename M::Velocity& v) {
        double* to = row(body);
        for (int d = 0; d < M::dof; ++d) to[d] = d < M::dim ? v[d] : v[d] / inverse_rho_[body];
    }

  private:
    using Layout = BatchLayout<M>;
    static constexpr std::size_t width = Layout::row;

    std::vector<int> row_of_;  ///< of each body, counted in rows
    int used_ = 0;             ///< rows dealt out
    bool fits_ = true;
    std::vector<double> inverse_rho_;
};

}}}  // namespace nscdd::NSCDD_ABI::detail
