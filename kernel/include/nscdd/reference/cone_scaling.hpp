/// @file
/// The friction cone for interior-point methods: the Jordan algebra of the second-order cone, and Nesterov and Todd's
/// scaling of one contact [NesterovTodd97]. The algebra is written with the normal n instead of a first axis.
#pragma once

#include "nscdd/core/abi.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Vectors of `size` components in the axes of n; with size 1 the cone is the half-line. a_n = a . n, a_t the rest.
template <int size>
struct Cone {
    using Vec = Eigen::Matrix<double, size, 1, Eigen::DontAlign>;
    using Block = Eigen::Matrix<double, size, size, Eigen::DontAlign>;

    Vec n;  ///< unit

    Vec tangent(const Vec& a) const { return a - a.dot(n) * n; }
    Vec mirrored(const Vec& a) const { return 2 * a.dot(n) * n - a; }

    /// a_n^2 - |a_t|^2: positive inside.
    double determinant(const Vec& a) const {
        const double t = tangent(a).norm();
        return (a.dot(n) - t) * (a.dot(n) + t);
    }

    Vec product(const Vec& a, const Vec& b) const {
        return a.dot(b) * n + a.dot(n) * tangent(b) + b.dot(n) * tangent(a);
    }

    /// x with product(a, x) = b, a inside.
    Vec quotient(const Vec& a, const Vec& b) const {
        const double x = (a.dot(n) * b.dot(n) - tangent(a).dot(tangent(b))) / determinant(a);
        return x * n + (tangent(b) - x * tangent(a)) / a.dot(n);
    }

    /// The r and w inside the cone with r - w = y and product(r, w) = gap n: smoothed parts of y inside it and outside
    /// [Fukushima02].
    std::pair<Vec, Vec> split(const Vec& y, double gap) const {
        const Vec t = tangent(y);
        const double length = t.norm();
        const auto positive = [gap](double v) {  // (v + sqrt(v^2 + 4 gap))/2 without cancellation
            const double root = std::sqrt(v * v + 4 * gap);
            return v > 0 ? 0.5 * (v + root) : 2 * gap / (root - v);
        };
        const double high = y.dot(n) + length, low = y.dot(n) - length;
        const Vec e = length > 0 ? Vec(t / length) : Vec(Vec::Zero());
        const auto vector = [&](double a, double b) { return Vec(0.5 * ((a + b) * n + (a - b) * e)); };
        return {vector(positive(high), positive(low)), vector(positive(-high), positive(-low))};
    }

    /// The longest t for which a + t da is inside, a being inside; at most `most`.
    double step_limit(const Vec& a, const Vec& da, double most) const {
        const double slope = da.dot(n), tangential = tangent(da).norm();
        const double square = (slope - tangential) * (slope + tangential);
        const double half = a.dot(n) * slope - tangent(a).dot(tangent(da)), inside = determinant(a);
        const double under = half * half - square * inside;
        double t = slope < 0 ? (std::min)(most, -a.dot(n) / slope) : most;
        if (under < 0) return t;
        const double q = -(half + std::copysign(std::sqrt(under), half));  // no cancellation: roots q/square, inside/q
        for (const double root : {q / square, inside / q})
            if (root > 0) t = (std::min)(t, root);
        return t;
    }
};

/// The symmetric positive W with W z = W^-1 s, for s and z inside the cone.
template <int size>
struct ConeScaling {
    using Vec = typename Cone<size>::Vec;
    using Block = typename Cone<size>::Block;

    Block w, inverse;
    Vec point;  ///< W z

    bool compute(const Cone<size>& cone, const Vec& s, const Vec& z) {
        const double ds = cone.determinant(s), dz = cone.determinant(z);
        if (!(ds > 0 && dz > 0 && ds < (std::numeric_limits<double>::max)())) return false;  // inside, to round-off
        const Vec unit_s = s / std::sqrt(ds), unit_z = z / std::sqrt(dz);
        const Vec v = (unit_s + cone.mirrored(unit_z)) / std::sqrt(2 + 2 * unit_s.dot(unit_z));
        const double scale = std::pow(ds / dz, 0.25);
        w = scale * root(cone, v);
        inverse = root(cone, cone.mirrored(v)) / scale;
        point = w * z;
        return point.allFinite();
    }

  private:
    static Block root(const Cone<size>& cone, const Vec& v) {
        const Vec t = cone.tangent(v), &n = cone.n;
        const double a = v.dot(n);
        const Block nn = n * n.transpose();
        return a * nn + n * t.transpose() + t * n.transpose() + Block::Identity() - nn + t * t.transpose() / (1 + a);
    }
};

}}}  // namespace nscdd::NSCDD_ABI::detail
