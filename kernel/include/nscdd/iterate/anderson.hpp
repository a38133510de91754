/// @file
/// Anderson acceleration of whole iterations [Anderson65, Walker11]. The last few iterates, and the change of each by
/// its sweep, are combined such that the change would have been least.
///
/// Impulses and glued velocities depend on each other affinely, V = V_free + M^-1 H r. So both take the same
/// combination, and no exchange is added. The combination may leave the cone; the next sweep brings every contact back
/// into it.
#pragma once

#include "nscdd/core/abi.hpp"  // before anything else of Eigen

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// The coefficients of the combination, the same on every rank. Those who hold the iterates keep them in `window`
/// slots. Each slot has an iterate g_j and the change f_j of the sweep that led to it. An iteration starts from
/// ```
/// x = g + sum_j c_j (g_j - g),   then g_last = g;   f = sweep(x) - x,   then f_now = f,   for c_j = coefficient(j),
/// ```
/// and tells update() the products f.f, f.f_0, f.f_1 ..., summed over all contacts, before f takes its slot.
class Anderson {
  public:
    static constexpr int largest_window = 8;                  ///< largest number of earlier iterates to combine
    using Products = std::array<double, largest_window + 1>;  ///< f.f, then f.f_j by slot [J]: products() are in use
    /// Weight of the tangential part of a change over that of the normal part, W_n. The tangential part changes
    /// whenever a contact turns from sticking to sliding. W itself as metric takes a quarter more iterations. With no
    /// weight at all a grain that rolls without a normal change would not count.
    static constexpr double tangential_weight = 0.1;
    /// Bound on sum |c_j|. Where walls leave no room all f_j are nearly equal, so the minimising c_j are huge. Without
    /// the bound impulses grow a thousandfold there, and their round-off throws grains out.
    static constexpr double longest = 5;
    ///@{
    /// After `many` iterations one in `pause` starts from the iterate itself, without a combination. Without pauses
    /// slow problems end in a cycle of combinations whose coefficients stay far below 1 (METHOD.md, section 8).
    static constexpr int many = 200, pause = 5;
    ///@}
    /// Weight [1/kg] of a contact: W_n of split masses times (split/whole)^4. `split` and `whole` are W_n of split and
    /// of whole masses (METHOD.md, section 8). Split masses slow interface contacts, which decide the number of
    /// iterations.
    static double metric(double split, double whole) {
        const double square = split / whole * (split / whole);
        return split * square * square;
    }

    /// Makes an empty window. `window` is the number of earlier iterates to combine, 0 to largest_window. It is not
    /// checked here (check_options()).
    explicit Anderson(int window)
        : window_(window),
          coefficients_(Vector::Zero(window_)),
          products_(Matrix::Zero(window_, window_)),
          now_(0),
          last_(window_ - 1) {}

    int window() const { return window_; }                                          ///< number of slots
    std::size_t products() const { return static_cast<std::size_t>(window_ + 1); }  ///< numbers that update() reads
    double coefficient(int slot) const { return coefficients_[slot]; }  ///< c_j; 0 where the slot takes no part
    int now() const { return now_; }            ///< slot that takes f, the change by this iteration's sweep
    int last() const { return last_; }          ///< slot that takes g, the end of the last iteration
    int restarts() const { return restarts_; }  ///< number of times that a change that grew has emptied the window

    /// True where velocities have to be computed from the impulses again before they are judged.
    ///
    /// Velocities and impulses are combined by the same coefficients, so V = V_free + M^-1 H r stays true but for
    /// round-off. Coefficients beyond 1 multiply that round-off, by `growth_` at most. A heavy ball on light ones shows
    /// it after 60 iterations, packings after thousands. The limit of the factor is 1e4.
    bool velocities_stale() const { return growth_ > 1e4; }
    /// Empties the window. The next iteration starts from g itself.
    void forget() {
        coefficients_.setZero();
        filled_ = 0;
        growth_ = 1;
    }

    /// Sets the coefficients of the next iteration from products() numbers [J]. If f.f has grown, the window is emptied
    /// and nothing is combined. It is a template, so only its callers compile Eigen's factors.
    template <class = void>
    void update(const double* products) {
        const double own = products[0];
        const Vector with = Eigen::Map<const Eigen::VectorXd>(products + 1, window_);
        coefficients_.setZero();
        ++updates_;
        if (own == 0) return;  // a fixed point
        if (filled_ > 0 && own > previous_) {
            filled_ = 0;
            ++restarts_;
        } else if (updates_ <= many || updates_ % pause != 0) {
            combine(own, with);
        }
        previous_ = own;
        products_.row(now_) = with;
        products_.col(now_) = with;
        products_(now_, now_) = own;
        filled_ = (std::min)(filled_ + 1, window_);
        last_ = now_;
        now_ = (now_ + 1) % window_;
    }

  private:
    /// A matrix of fixed capacity, because on a few contacts allocations would cost more than the sweep. It is not
    /// aligned, because Eigen's alignment depends on the instruction set, and the names of its functions do not
    /// (abi.hpp).
    using Matrix =
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::DontAlign, largest_window, largest_window>;
    using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::DontAlign, largest_window, 1>;

    // GCC 12 does not see that no more than `window` numbers are in use, and warns of more than there is room for.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Warray-bounds"
#endif
    /// Minimises |f + sum_j c_j (f_j - f)| by its normal equations.
    template <class = void>
    void combine(double own, const Vector& with) {
        std::array<int, largest_window> used;
        Eigen::Index n = 0;
        for (int age = 0; age < filled_; ++age) {
            const int slot = (last_ - age + window_) % window_;
            // Leaves out slots with |f_j - f|^2 <= 1e-14 |f|^2: round-off.
            if (products_(slot, slot) - 2 * with[slot] + own > 1e-14 * own) used[static_cast<std::size_t>(n++)] = slot;
        }
        if (n == 0) return;
        Matrix a(n, n);
        Vector b(n);
        for (Eigen::Index i = 0; i < n; ++i) {
            const int si = used[static_cast<std::size_t>(i)];
            b[i] = own - with[si];
            for (Eigen::Index j = 0; j < n; ++j) {
                const int sj = used[static_cast<std::size_t>(j)];
                a(i, j) = products_(si, sj) - with[si] - with[sj] + own;
            }
        }
        const Vector scale = a.diagonal().cwiseSqrt().cwiseInverse();
        Matrix scaled = scale.asDiagonal() * a * scale.asDiagonal();
        scaled.diagonal().array() += 1e-10;
        const Eigen::LLT<Matrix> factors(scaled);
        if (factors.info() != Eigen::Success) return;
        const Vector c = scale.asDiagonal() * factors.solve(scale.asDiagonal() * b);
        if (!c.allFinite()) return;
        const double shorten = (std::min)(1.0, longest / c.lpNorm<1>());
        for (Eigen::Index i = 0; i < n; ++i) coefficients_[used[static_cast<std::size_t>(i)]] = shorten * c[i];
        growth_ *= std::abs(1 - coefficients_.sum()) + coefficients_.lpNorm<1>();
    }
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

    int window_;
    Vector coefficients_;  ///< by slot
    Matrix products_;      ///< f_i.f_j by slot
    int now_, last_;       ///< slots of this iteration's change, and of the last one
    int filled_ = 0, restarts_ = 0;
    int updates_ = 0;
    double previous_ = 0;
    double growth_ = 1;  ///< of round-off since velocities came from the impulses, at most
};

/// The acceleration of a sweep that has none. Its functions do nothing.
struct Unaccelerated {
    void prefetch(const auto&...) {}  ///< nothing, as there are no earlier iterates
    void before(const auto&...) {}    ///< nothing, as the sweep starts from the impulse itself
    void after(const auto&...) {}     ///< nothing, as there are no products to add
};

}}}  // namespace nscdd::NSCDD_ABI::detail
