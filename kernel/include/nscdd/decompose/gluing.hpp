/// @file
/// The interface problem (7): from the velocities of all copies to velocities on which they agree.
///
/// Both ways are the same map to round-off (METHOD.md, section 6.2). F_Gamma is never stored. It equals M_E (V_E before
/// - V_E after), so no F_Gamma can outlive the copies that it belonged to.
/// - V_E after), so no F_Gamma can outlive the copies that it belonged to.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <concepts>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/communicator.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Shared bodies by ascending id. Copies of body b are begin[b] <= c < begin[b+1], in rank order.
struct Copies {
    int dof = 1;                       ///< degrees of freedom of a body
    std::vector<int> begin{0};         ///< first copy of each body, then the number of copies; bodies + 1 entries
    std::vector<double> inverse_mass;  ///< of the whole body, bodies x dof [1/kg]; of spins 1/inertia [1/(kg m^2)]
    std::vector<const double*> from;   ///< place of the velocity of each copy, dof doubles
    std::vector<double*> to;           ///< place of the glued velocity; null: none; may equal `from`

    int bodies() const { return static_cast<int>(begin.size()) - 1; }  ///< number of shared bodies
    int count() const { return begin.back(); }                         ///< number of copies of all of them
    /// Removes all bodies; those added later have `degrees` degrees of freedom.
    void clear(int degrees) {
        dof = degrees;
        begin.assign(1, 0);
        inverse_mass.clear();
        from.clear();
        to.clear();
    }
};

/// A solver of the interface problem for the copies that it gets: ClosedForm, Factorised, or your own.
/// ```
/// setup(copies)     once per step
/// glue(copies)      reads the velocities at `from`, writes those on which the copies of a body agree at `to`; copies
///                   as at setup()
/// name, work        constexpr: a const char* for reports, and what a copy is counted as
/// ```
template <class G>
concept GluesCopies =
    std::default_initializable<G> && std::move_constructible<G> && requires(G& glue, const Copies& copies) {
        glue.setup(copies);
        glue(copies);
        { G::name } -> std::convertible_to<const char*>;
        { G::work } -> std::convertible_to<Work>;
    };

namespace detail {

/// Stops the compiler with a line where G does not glue copies.
template <class G>
consteval bool complete_gluing() {
    static_assert(
        GluesCopies<G>,
        "nscdd: what glues copies needs `void setup(const Copies&)`, `void operator()(const Copies&)`, "
        "`static constexpr const char* name` and `static constexpr Work work`, and is made without arguments");
    return true;
}

}  // namespace detail

/// Gluing for equal split masses. Every copy takes the mean, summed in rank order so that all ranks get the same bits.
class ClosedForm {
  public:
    static constexpr const char* name = "closed-form";  ///< name, as in --interface
    static constexpr Work work = Work::glue;            ///< kind of work of a copy

    /// Notes which copies want the mean. Called once per step.
    void setup(const Copies& copies) {
        to_.clear();
        to_begin_.assign(1, 0);
        for (std::size_t b = 0; b + 1 < copies.begin.size(); ++b) {
            for (int c = copies.begin[b]; c < copies.begin[b + 1]; ++c)
                if (double* const to = copies.to[static_cast<std::size_t>(c)]) to_.push_back(to);
            to_begin_.push_back(to_.size());
        }
    }

    /// Reads the velocities at `from`, writes the means at `to`. Copies are as at setup(). Throws std::invalid_argument
    /// unless their degrees of freedom are 2, 3 or 6.
    ///
    /// Each case knows its degrees of freedom at compile time, so a copy is a few loads and stores: a quarter of the
    /// time. It is a template, so its callers compile it.
    template <class = void>
    void operator()(const Copies& copies) {
        switch (copies.dof) {
            case 2:
                return glue<2>(copies);
            case 3:
                return glue<3>(copies);
            case 6:
                return glue<6>(copies);
            default:
                throw std::invalid_argument("copies of " + std::to_string(copies.dof) +
                                            " degrees of freedom, a body has 2, 3 or 6");
        }
    }

  private:
    template <std::size_t dof>
    void glue(const Copies& copies) {
        using Velocity = Eigen::Matrix<double, static_cast<int>(dof), 1>;
        const auto at = [](const double* from) { return Eigen::Map<const Velocity>(from); };
        for (std::size_t b = 0; b + 1 < copies.begin.size(); ++b) {
            const auto first = static_cast<std::size_t>(copies.begin[b]),
                       last = static_cast<std::size_t>(copies.begin[b + 1]);
            if (last - first == 2 &&
                to_begin_[b + 1] - to_begin_[b] == 1) {  // the most frequent case, without a division
                Eigen::Map<Velocity> both(to_[to_begin_[b]]);
                both = 0.5 * (at(copies.from[first]) + at(copies.from[first + 1]));
                continue;
            }
            std::copy_n(copies.from[first], dof, mean_.begin());
            for (std::size_t c = first + 1; c < last; ++c)
                for (std::size_t d = 0; d < dof; ++d) mean_[d] += copies.from[c][d];
            const auto count = static_cast<double>(last - first);
            for (std::size_t d = 0; d < dof; ++d) mean_[d] /= count;
            for (std::size_t t = to_begin_[b]; t < to_begin_[b + 1]; ++t) std::copy_n(mean_.begin(), dof, to_[t]);
        }
    }

    std::vector<double*> to_;  ///< places for the mean of body b: to_begin_[b] <= t < to_begin_[b+1]
    std::vector<std::size_t> to_begin_{0};
    std::array<double, 6> mean_{};  ///< on the stack GCC 12.2 misaligns it: a fault at -O2 with AVX-512
};

namespace detail {

/// A_Gamma, with one row per jump between consecutive copies and degree of freedom: +1 on the first, -1 on the second.
inline Eigen::SparseMatrix<double> jump_matrix(const Copies& copies) {
    std::vector<Eigen::Triplet<double>> entries;
    int row = 0;
    for (int b = 0; b < copies.bodies(); ++b)
        for (int c = copies.begin[static_cast<std::size_t>(b)]; c + 1 < copies.begin[static_cast<std::size_t>(b) + 1];
             ++c)
            for (int d = 0; d < copies.dof; ++d, ++row) {
                entries.emplace_back(row, c * copies.dof + d, 1.0);
                entries.emplace_back(row, (c + 1) * copies.dof + d, -1.0);
            }
    Eigen::SparseMatrix<double> a(row, copies.count() * copies.dof);
    a.setFromTriplets(entries.begin(), entries.end());
    return a;
}

/// Diagonal of M_E^-1 over all copies, copies x dof: multiplicity over whole mass or inertia [1/kg, 1/(kg m^2)].
inline Eigen::VectorXd split_inverse_masses(const Copies& copies) {
    Eigen::VectorXd inverse(copies.count() * copies.dof);
    for (int b = 0; b < copies.bodies(); ++b) {
        const int first = copies.begin[static_cast<std::size_t>(b)],
                  last = copies.begin[static_cast<std::size_t>(b) + 1];
        for (int c = first; c < last; ++c)
            for (int d = 0; d < copies.dof; ++d)
                inverse[c * copies.dof + d] =
                    (last - first) * copies.inverse_mass[static_cast<std::size_t>(b * copies.dof + d)];
    }
    return inverse;
}

}  // namespace detail

/// Gluing by X = sum_E A M_E^-1 A^T, assembled and factorised [DD21, eq. (7)]. Any sparse Cholesky with Eigen's
/// interface will do: Eigen::SimplicialLDLT here, CHOLMOD through Eigen's wrapper in the harness.
template <class Cholesky = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>
class Factorised {
  public:
    static constexpr const char* name = "factorised";  ///< name, as in --interface
    static constexpr Work work = Work::factorised;     ///< kind of work of a copy

    /// Assembles X and factorises it. Called once per step. Throws std::runtime_error unless X is positive definite.
    void setup(const Copies& copies) {
        velocity_.resize(copies.count() * copies.dof);
        jumps_ = detail::jump_matrix(copies);
        correction_ = detail::split_inverse_masses(copies).asDiagonal() * jumps_.transpose();
        if (jumps_.rows() == 0) return;
        x_ = jumps_ * correction_;
        cholesky_ = std::make_unique<Cholesky>(x_);
        if (cholesky_->info() != Eigen::Success)
            throw std::runtime_error("interface operator X is not positive definite");
    }

    /// Solves X Delta F_Gamma = sum_E A V_E for the velocities at `from`; writes those after it at `to`. Copies are as
    /// at setup().
    void operator()(const Copies& copies) {
        if (jumps_.rows() == 0) return;
        const auto dof = static_cast<std::ptrdiff_t>(copies.dof);
        for (std::size_t c = 0; c < copies.from.size(); ++c)
            std::copy_n(copies.from[c], dof, velocity_.data() + static_cast<std::ptrdiff_t>(c) * dof);
        const Eigen::VectorXd multipliers = cholesky_->solve(jumps_ * velocity_);  // Delta F_Gamma
        velocity_ -= correction_ * multipliers;
        for (std::size_t c = 0; c < copies.to.size(); ++c)
            if (copies.to[c]) std::copy_n(velocity_.data() + static_cast<std::ptrdiff_t>(c) * dof, dof, copies.to[c]);
    }

    const Eigen::SparseMatrix<double>& x() const { return x_; }  ///< X [1/kg], a row per jump and degree of freedom

  private:
    Eigen::SparseMatrix<double> jumps_, correction_, x_;
    Eigen::VectorXd velocity_;            ///< of all copies
    std::unique_ptr<Cholesky> cholesky_;  ///< CHOLMOD's wrapper cannot be moved
};

}}  // namespace nscdd::NSCDD_ABI
