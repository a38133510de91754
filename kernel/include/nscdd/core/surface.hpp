/// @file
/// Surfaces that grains meet by the closest point: segments in 2D, triangles in 3D, cylinders (circles in 2D).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/core/model.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Corners of a segment (2D) or a triangle (3D) [m]. Grains meet both of its sides.
template <class M>
using Facet = std::array<typename M::Vec, M::dim>;

/// A thin round wall without ends: grains meet it from inside and from outside. In 2D a circle.
template <class M>
struct Cylinder {
    typename M::Vec centre = M::Vec::Zero();                  ///< a point of the axis; with a length the middle [m]
    typename M::Vec axis = M::Vec::Unit(M::dim - 1);          ///< unit; in 2D it does not count
    double radius = 0;                                        ///< [m]
    double length = std::numeric_limits<double>::infinity();  ///< along the axis [m]; in 2D it does not count
};

namespace detail {

/// The point of a facet or cylinder that is closest to a place.
template <class M>
struct Closest {
    double distance = 0;                       ///< to the place [m]
    typename M::Vec point = M::Vec::Zero();    ///< [m]
    typename M::Vec normal = M::Vec::UnitX();  ///< unit, from the point to the place; any if these are the same
    bool edge = false;                         ///< an edge or corner, from which the surface may go on elsewhere
};

/// Of a segment, in any dimension: where on it the closest point is, from 0 to 1.
template <class Vec>
double along_segment(const Vec& a, const Vec& b, const Vec& x) {
    const Vec way = b - a;
    return std::clamp((x - a).dot(way) / way.squaredNorm(), 0.0, 1.0);
}

inline Eigen::Vector3d cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Unit normal of a facet on one of its sides.
template <class M>
typename M::Vec facet_normal(const Facet<M>& f) {
    const typename M::Vec way = f[1] - f[0];
    if constexpr (M::dim == 2)
        return typename M::Vec(-way[1], way[0]).normalized();
    else
        return cross(way, f[2] - f[0]).normalized();
}

/// `normal`: facet_normal().
template <class M>
Closest<M> closest(const Facet<M>& f, const typename M::Vec& normal, const typename M::Vec& x) {
    using Vec = typename M::Vec;
    const auto within = [&] {  // over the inside of the facet
        const double height = (x - f[0]).dot(normal);
        return Closest<M>{std::abs(height), x - height * normal, height < 0 ? Vec(-normal) : normal, false};
    };
    const auto at_edge = [&](const Vec& point) {
        const Vec way = x - point;
        const double distance = way.norm();
        return Closest<M>{distance, point, distance > 0 ? Vec(way / distance) : normal, true};
    };
    if constexpr (M::dim == 2) {
        const double t = along_segment(f[0], f[1], x);
        return t > 0 && t < 1 ? within() : at_edge(t > 0 ? f[1] : f[0]);
    } else {
        bool inside = true;
        Closest<M> best;
        best.distance = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec &a = f[k], &b = f[(k + 1) % 3];
            if (cross(normal, b - a).dot(x - a) > 0) continue;  // on the inner side of this edge
            inside = false;
            const Vec point = a + along_segment(a, b, x) * (b - a);
            const Closest<M> here = at_edge(point);
            if (here.distance < best.distance) best = here;
        }
        return inside ? within() : best;
    }
}

template <class M>
Closest<M> closest(const Cylinder<M>& c, const typename M::Vec& x) {
    using Vec = typename M::Vec;
    Vec radial = x - c.centre;
    double height = 0, beyond = 0;
    if constexpr (M::dim == 3) {
        height = radial.dot(c.axis);
        radial -= height * c.axis;
        beyond = std::abs(height) - 0.5 * c.length;
    }
    const double from_axis = radial.norm();
    if (from_axis > 0)
        radial /= from_axis;
    else  // all directions are the same
        radial = M::dim == 2 ? Vec(Vec::UnitX()) : Vec(c.axis.unitOrthogonal());
    if (beyond > 0) {
        Vec point = c.centre + c.radius * radial;
        if constexpr (M::dim == 3) point += std::copysign(0.5 * c.length, height) * c.axis;
        const Vec way = x - point;
        const double distance = way.norm();
        return {distance, point, distance > 0 ? Vec(way / distance) : radial, true};
    }
    const double out = from_axis - c.radius;
    return {std::abs(out), x - out * radial, out < 0 ? Vec(-radial) : radial, false};
}

/// Boxes around facets in a tree, which finds those near a place. Boxes of its leaves have up to four facets.
template <class M>
class FacetTree {
  public:
    explicit FacetTree(const std::vector<Facet<M>>& facets) : order_(facets.size()) {
        std::iota(order_.begin(), order_.end(), 0);
        if (!facets.empty()) build(facets, 0, order_.size());
    }
    /// visit(number) for all facets whose box reaches into the cube of half-side `reach` [m] about a place.
    void visit(const typename M::Vec& place, double reach, auto&& visit) const {
        std::vector<std::size_t> open;
        if (!nodes_.empty()) open.push_back(0);
        while (!open.empty()) {
            const Node& node = nodes_[open.back()];
            open.pop_back();
            if (((node.low - place).array() > reach).any() || ((place - node.high).array() > reach).any()) continue;
            if (node.right > 0) {
                open.push_back(node.right);
                open.push_back(static_cast<std::size_t>(&node - nodes_.data()) + 1);
                continue;
            }
            for (std::size_t k = node.begin; k < node.end; ++k) visit(order_[k]);
        }
    }

  private:
    struct Node {
        typename M::Vec low, high;
        std::size_t begin, end, right = 0;  ///< the left child is the next node; 0: a leaf
    };
    void build(const std::vector<Facet<M>>& facets, std::size_t begin, std::size_t end) {
        constexpr double most = (std::numeric_limits<double>::max)();
        const std::size_t self = nodes_.size();
        nodes_.push_back({M::Vec::Constant(most), M::Vec::Constant(-most), begin, end});
        for (std::size_t k = begin; k < end; ++k)
            for (const auto& corner : facets[static_cast<std::size_t>(order_[k])]) {
                nodes_[self].low = nodes_[self].low.cwiseMin(corner);
                nodes_[self].high = nodes_[self].high.cwiseMax(corner);
            }
        if (end - begin <= 4) return;
        Eigen::Index axis = 0;
        (nodes_[self].high - nodes_[self].low).maxCoeff(&axis);
        const std::size_t middle = begin + (end - begin) / 2;
        const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
        const auto place = [&](int f) {
            double sum = 0;
            for (const auto& corner : facets[static_cast<std::size_t>(f)]) sum += corner[axis];
            return sum;
        };
        std::nth_element(at(begin), at(middle), at(end), [&](int a, int b) {
            const double pa = place(a), pb = place(b);
            return pa < pb || (pa == pb && a < b);
        });
        build(facets, begin, middle);
        nodes_[self].right = nodes_.size();
        build(facets, middle, end);
    }

    std::vector<int> order_;
    std::vector<Node> nodes_;
};

/// Facets or a cylinder, checked, with what a search needs. All who use one share it: make_surface().
template <class M>
class Surface {
  public:
    using Vec = typename M::Vec;

    /// Throws std::invalid_argument, "facet 3 ...", for a facet that is not finite or whose corners are on one line (in
    /// 2D: are one), and where there is none or too many.
    explicit Surface(std::vector<Facet<M>> facets) : facets_(std::move(facets)), tree_(checked(facets_)) {
        for (const Facet<M>& facet : facets_) normals_.push_back(facet_normal<M>(facet));
    }
    /// Throws std::invalid_argument for a cylinder that is not finite, or has no radius, length or unit axis.
    explicit Surface(const Cylinder<M>& cylinder) : cylinder_(cylinder), tree_(facets_) {
        if (!cylinder.centre.allFinite() || !(cylinder.radius > 0) || !std::isfinite(cylinder.radius) ||
            !(cylinder.length > 0) || !(std::abs(cylinder.axis.norm() - 1) < 1e-9))
            throw std::invalid_argument("a cylinder needs a finite place, a positive radius and length, a unit axis");
    }

    const std::vector<Facet<M>>& facets() const { return facets_; }           ///< none of a cylinder
    const std::optional<Cylinder<M>>& cylinder() const { return cylinder_; }  ///< none where there are facets
    std::size_t size() const { return cylinder_ ? 1 : facets_.size(); }       ///< number of facets; 1 of a cylinder
    Closest<M> closest(int facet, const Vec& x) const {                       ///< of one of its facets
        if (cylinder_) return detail::closest(*cylinder_, x);
        const auto k = static_cast<std::size_t>(facet);
        return detail::closest<M>(facets_[k], normals_[k], x);
    }
    /// visit(facet) for all facets that may be nearer than `reach` [m] to a place, and others, in any order.
    void visit_near(const Vec& x, double reach, auto&& visit) const {
        if (cylinder_)
            visit(0);
        else
            tree_.visit(x, reach, visit);
    }

  private:
    static const std::vector<Facet<M>>& checked(const std::vector<Facet<M>>& facets) {
        constexpr std::size_t most = 100'000'000;  // so that numbers of walls and facets fit into an int
        if (facets.empty() || facets.size() > most) throw std::invalid_argument("a surface has 1 to 1e8 facets");
        for (std::size_t k = 0; k < facets.size(); ++k) {
            const Facet<M>& f = facets[k];
            std::string name = "facet ";
            name += std::to_string(k);
            double longest = 0, size = 0;
            for (int c = 0; c < M::dim; ++c) {
                const auto at = static_cast<std::size_t>(c), next = static_cast<std::size_t>((c + 1) % M::dim);
                if (!f[at].allFinite()) throw std::invalid_argument(name += " is not finite");
                longest = (std::max)(longest, (f[next] - f[at]).norm());
            }
            if constexpr (M::dim == 3)
                size = cross(f[1] - f[0], f[2] - f[0]).norm() / longest;  // height over the longest side
            else
                size = longest;
            if (!(size > 1e-9 * longest)) throw std::invalid_argument(name += ": its corners are on one line");
        }
        return facets;
    }

    std::vector<Facet<M>> facets_;
    std::vector<Vec> normals_;
    std::optional<Cylinder<M>> cylinder_;
    FacetTree<M> tree_;
};

}  // namespace detail

///@{
/// A surface to be shared. Throws as Surface does.
template <class M>
std::shared_ptr<const detail::Surface<M>> make_surface(std::vector<Facet<M>> facets) {
    return std::make_shared<const detail::Surface<M>>(std::move(facets));
}
template <class M>
std::shared_ptr<const detail::Surface<M>> make_surface(const Cylinder<M>& cylinder) {
    return std::make_shared<const detail::Surface<M>>(cylinder);
}
///@}

}}  // namespace nscdd::NSCDD_ABI
