#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>

#include "nscdd/core/two_digits.hpp"
#include "nscdd/core/wall.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// A scene that repeats along some axes. Each grain stands for all of its images, which are one of the cell's sides or
/// several away. Nothing repeats as long as no axis is periodic.
/// ```
/// nscdd::Cell<Model> cell{.periodic = {true, true, false}, .size = {0.2, 0.1, 0}};
/// ```
/// A cell may flow: all places move by `gradient` times their way from `low`, and velocities of grains are what they
/// have besides [Evans08, SLLOD]. A shear moves images past each other (Lees and Edwards): `tilt`.
template <class M>
struct Cell {
    using Vec = typename M::Vec;

    std::array<bool, M::dim> periodic{};  ///< whether the scene repeats, of each axis
    Vec low = Vec::Zero();                ///< corner from which the cell reaches [m]; where it is changes no answer
    Vec size = Vec::Zero();               ///< sides [m]; of axes that are not periodic it does not count
    typename M::Gradient tilt = M::Gradient::Zero();  ///< (e, d): the next image along d is this far along e < d [m]
    std::array<bool, M::dim> driven{};                ///< whether a stress drives the side, of each axis
    Vec stress = Vec::Zero();                         ///< of driven sides, positive in compression [Pa], [N/m] in 2D
    /// Inertia of each driven side against changes of its rate, as a mass that moves by `length` times the rate [kg].
    /// At least three times the mass of all grains.
    double mass = 0;
    double length = 0;  ///< of that motion [m]; Simulation sets it to the diameter of the largest grain
    typename M::Gradient gradient =
        M::Gradient::Zero();  ///< of the flow's velocity [1/s]: upper triangle, of periodic axes

    static constexpr const char* shortest =
        "shorter than 2.01 diameters of the largest grain";  ///< said of too_short()
    /// Whether a grain could touch its own image, or two images of another one, which have one contact.
    bool too_short(int d, double largest_radius) const { return along(d) && size[d] < 4.02 * largest_radius; }

    /// Whether any axis is periodic.
    bool repeats() const {
        return std::any_of(periodic.begin(), periodic.end(), [](bool axis) { return axis; });
    }
    /// The shortest side [m]; infinity where nothing repeats.
    double least_size() const {
        double least = std::numeric_limits<double>::infinity();
        for (int d = 0; d < M::dim; ++d)
            if (along(d)) least = (std::min)(least, size[d]);
        return least;
    }

    /// Whether it flows.
    bool flows() const { return any_driven() || !gradient.isZero(0); }
    /// Whether a stress drives any side: entries of `gradient` are then speeds of sides as they are now.
    bool any_driven() const {
        return std::any_of(driven.begin(), driven.end(), [](bool side) { return side; });
    }
    /// Number of driven sides: of bodies that stand behind the walls of a problem, in the order of axes.
    std::size_t sides() const { return static_cast<std::size_t>(std::count(driven.begin(), driven.end(), true)); }
    /// Force of its stress on a driven side, on the motion by `length` times the rate [N].
    double force(int d) const { return stress[d] * size.prod() / length; }
    /// A velocity relative to a place that is `apart` away [m/s], with what the flow adds.
    Vec with_flow(const Vec& velocity, const Vec& apart) const {
        return flows() ? Vec(velocity + detail::flow_over<M>(gradient, apart)) : velocity;
    }
    /// Gradient of the flow in coordinates that have moved with it for `since` [s] [1/s].
    typename M::Gradient gradient_after(double since) const {
        typename M::Gradient after = gradient;  // X with X (1 + since gradient) = gradient
        for (int d = 0; d < M::dim; ++d)
            for (int e = 0; e <= d; ++e) {
                for (int k = e; k < d; ++k) after(e, d) -= since * after(e, k) * gradient(k, d);
                after(e, d) /= 1 + since * gradient(d, d);
            }
        return after;
    }
    /// Lets images move by a flow for `dt` [s].
    void move_images(const typename M::Gradient& flow, double dt) {
        for (int d = 0; d < M::dim; ++d) {
            Vec way = side(d);
            way += dt * detail::flow_over<M>(flow, way);
            size[d] = way[d];
            for (int e = 0; e < d; ++e) tilt(e, d) = way[e];
        }
        for (int d = 0; d < M::dim; ++d)  // the same images, the least tilted
            for (int e = d - 1; e >= 0; --e)
                if (along(e)) {
                    const Vec way = std::round(tilt(e, d) / size[e]) * side(e);
                    for (int f = 0; f <= e; ++f) tilt(f, d) -= way[f];
                }
    }

    /// From b to the nearest image of a [m], where that is nearer than half of the cell.
    Vec apart(const Vec& a, const Vec& b) const { return nearest(a - b); }
    /// The same of the way from b to any image of a [m].
    Vec nearest(Vec way) const {
        for (int d = M::dim - 1; d >= 0; --d)
            if (along(d)) way -= std::round(way[d] / size[d]) * side(d);
        return way;
    }
    /// Middle between a and the image of b that is nearest to it, within the cell. Of the same a and b to the last bit
    /// the same.
    Vec middle(const Vec& a, const Vec& b) const {
        if (!repeats()) return 0.5 * (a + b);
        return wrapped(a + 0.5 * apart(b, a));
    }
    /// The image of a point that is in the cell.
    Vec wrapped(Vec point) const {
        for (int d = M::dim - 1; d >= 0; --d)
            if (along(d)) point -= std::floor((point[d] - low[d]) / size[d]) * side(d);
        return point;
    }
    /// visit(image) for each image of a point that is in the cell or at most `reach` [m] from it, per axis, and no
    /// farther than one side; the one in the cell first.
    void visit_images(const Vec& point, double reach, auto&& visit) const {
        if (repeats())
            visit_from(M::dim - 1, point, reach, visit);
        else
            visit(point);
    }

  private:
    bool along(int d) const { return periodic[static_cast<std::size_t>(d)]; }
    /// From a place to its next image along axis d [m].
    Vec side(int d) const { return tilt.col(d) + size[d] * Vec::Unit(d); }
    void visit_from(int d, Vec point, double reach, auto& visit) const {
        if (d < 0) return static_cast<void>(visit(point));
        if (!along(d)) return visit_from(d - 1, point, reach, visit);
        point -= std::floor((point[d] - low[d]) / size[d]) * side(d);
        visit_from(d - 1, point, reach, visit);
        if (point[d] - low[d] <= reach) visit_from(d - 1, point + side(d), reach, visit);
        if (low[d] + size[d] - point[d] <= reach) visit_from(d - 1, point - side(d), reach, visit);
    }
};

namespace detail {

/// `largest_radius` of the scene's grains [m]. Throws std::invalid_argument for a cell that is none, in which a grain
/// could touch its own image or two images of another one, or that a wall crosses.
template <class M>
void check_cell(const Cell<M>& cell, std::span<const Wall<M>> walls, double largest_radius, double mass) {
    const auto axis = [&cell](int d) { return cell.periodic[static_cast<std::size_t>(d)]; };
    for (int d = 0; d < M::dim; ++d)
        for (int e = 0; e < M::dim; ++e) {
            const double rate = cell.gradient(e, d), tilt = cell.tilt(e, d);
            if (!std::isfinite(rate) || !std::isfinite(tilt))
                throw std::invalid_argument("cell: gradient and tilt must be finite");
            if ((rate != 0 && (e > d || !axis(d) || !axis(e))) || (tilt != 0 && (e >= d || !axis(d) || !axis(e))))
                throw std::invalid_argument(
                    "cell: gradient and tilt may be set of periodic axes, above the diagonal (the gradient on it too)");
        }
    if (cell.any_driven()) {
        for (int d = 0; d < M::dim; ++d)
            if (!axis(d) || !std::isfinite(cell.stress[d]))
                throw std::invalid_argument("cell: a stress drives sides where all axes are periodic, and is finite");
        if (!(cell.mass > 0) || !std::isfinite(cell.mass))
            throw std::invalid_argument("cell: sides that a stress drives need a positive mass");
        if (cell.mass < 3 * mass)
            throw std::invalid_argument("cell: the mass of sides must be at least three times that of all grains, " +
                                        two_digits(3 * mass, std::ceil) + " kg, for sweeps to converge");
    }
    if (cell.flows() && !M::friction)
        throw std::invalid_argument("cell: one that flows needs a model with friction, of which 0 will do");
    if (cell.flows() && !walls.empty()) throw std::invalid_argument("cell: one that flows has no walls");
    for (int d = 0; d < M::dim; ++d) {
        if (!axis(d)) continue;
        std::string name = "cell: the side along ";
        name += "xyz"[d];
        if (!std::isfinite(cell.size[d]) || !(cell.size[d] > 0) || !std::isfinite(cell.low[d]))
            throw std::invalid_argument(name + " must be positive and finite");
        if (cell.too_short(d, largest_radius)) throw std::invalid_argument((name += " is ") += cell.shortest);
        for (const Wall<M>& wall : walls)
            if (wall.normal[d] != 0)
                throw std::invalid_argument((name += " crosses wall ") += std::to_string(&wall - walls.data()));
    }
}

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
