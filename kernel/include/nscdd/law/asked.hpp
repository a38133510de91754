#pragma once

#include <tuple>

#include <Eigen/Eigenvalues>

#include "nscdd/core/contact_problem.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The change that its contacts ask of a body whose neighbours stay as they are (METHOD.md, section 5.5).
template <class M>
struct Asked {
    using Matrix = Eigen::Matrix<double, M::dim, M::dim>;             ///< of A
    static constexpr std::size_t numbers = M::dim * M::dim + M::dim;  ///< numbers that copies of a body send each other
    Matrix held = Matrix::Zero();           ///< A: sum of the projections on the directions that its contacts hold
    typename M::Vec miss = M::Vec::Zero();  ///< b: sum of the velocities that they miss in it [m/s]
    auto summed() { return std::tie(held, miss); }  ///< members that copies of the body add up

    /// Adds the request of one contact. sign is 1 for the first body of a contact, -1 for the second.
    void add(const Matrix& contact_holds, const typename M::Vec& contact_misses, double sign) {
        held += contact_holds;
        miss += sign * contact_misses;
    }
    /// Square of the least change of velocity u that gives the contacts what they ask, in the mean: |A^+ b|^2
    /// [m^2/s^2]. The rank of A is taken but for round-off. The theorem of Cayley and Hamilton gives the square where
    /// it is accurate.
    double square() const {
        const double b = miss.squaredNorm();
        if (b == 0) return 0;
        constexpr double flat = 1e-13;  // eigenvalue over the largest one: of contacts within 3e-7 of one line
        const double first = held.trace(), second = 0.5 * (first * first - held.squaredNorm());
        if (!(second > flat * first * first)) return b / (first * first);
        const typename M::Vec once = held * miss;
        if constexpr (M::dim == 3) {
            if (second < 1e-3 * first * first) return square_by_axes(flat * first);
            if (const double third = held.determinant(); third > 10 * flat * first * second)
                return (held * once - first * once + second * miss).squaredNorm() / (third * third);
        }
        return (first * miss - once).squaredNorm() / (second * second);
    }

  private:
    /// The same square, axis by axis.
    double square_by_axes(double least) const {
        const Eigen::SelfAdjointEigenSolver<Matrix> axes(held);
        double sum = 0;
        for (int d = 0; d < M::dim; ++d) {
            const double along = axes.eigenvectors().col(d).dot(miss) / axes.eigenvalues()[d];
            if (axes.eigenvalues()[d] > least) sum += along * along;
        }
        return sum;
    }
};

}}}  // namespace nscdd::NSCDD_ABI::detail
