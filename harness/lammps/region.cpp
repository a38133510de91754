// Regions of LAMMPS as walls. Their own headers are not installed, so shapes are told by bounds and by probing.
#include <lammps/domain.h>
#include <lammps/error.h>
#include <lammps/region.h>

#include <array>

#include "arguments.hpp"

namespace nscdd {
namespace {

using M = FixArguments::M;
using Vec = M::Vec;

struct Extent {
    Vec low, high;
    explicit Extent(const LAMMPS_NS::Region& r)
        : low(r.extent_xlo, r.extent_ylo, r.extent_zlo), high(r.extent_xhi, r.extent_yhi, r.extent_zhi) {}
    // LAMMPS' INF is 1e20.
    static bool finite(double x) { return std::abs(x) < 1e19; }
    // Of an infinite axis 0, where all is alike.
    Vec middle() const {
        Vec place = Vec::Zero();
        for (int d = 0; d < 3; ++d)
            if (finite(low[d]) && finite(high[d])) place[d] = 0.5 * (low[d] + high[d]);
        return place;
    }
};

// The two faces across an axis, but those that are open or at infinity.
void add_faces(FixArguments& to, const std::string& name, const Extent& b, int d, bool low, bool high) {
    if (low && Extent::finite(b.low[d])) to.add_plane(name, Vec::Unit(d), b.low[d]);
    if (high && Extent::finite(b.high[d])) to.add_plane(name, -Vec::Unit(d), -b.high[d]);
}

// The axis of a cylinder: a place near the edge of its bounds across the axis is outside, across another one inside.
int axis_of(LAMMPS_NS::Region& region, const Extent& b) {
    for (int d = 0; d < 3; ++d)
        if (!Extent::finite(b.low[d]) || !Extent::finite(b.high[d])) return d;
    for (int d = 0; d < 2; ++d) {
        Vec place = b.middle();
        for (int e = 0; e < 3; ++e)
            if (e != d) place[e] += 0.45 * (b.high[e] - b.low[e]);
        if (!region.inside(place[0], place[1], place[2])) return d;
    }
    return 2;
}

}  // namespace

void add_region(LAMMPS_NS::LAMMPS* lmp, const std::string& id, FixArguments& to) {
    const auto refuse = [&](const std::string& why) { lmp->error->all(FLERR, "Fix nscdd region " + id + ": " + why); };
    const int found = lmp->domain->find_region(id);
    if (found < 0) refuse("there is none of this ID");
    LAMMPS_NS::Region& region = *lmp->domain->regions[found];
    region.init();
    const std::string style = region.style, name = "region " + id;
    if (region.dynamic || region.varshape) refuse("it moves, which only walls given by `wall` may");
    if (style == "plane") {
        const auto& box = *lmp->domain;
        for (int corner = 0; corner < 8; ++corner) {
            const Vec x(corner & 1 ? box.boxhi[0] : box.boxlo[0], corner & 2 ? box.boxhi[1] : box.boxlo[1],
                        corner & 4 ? box.boxhi[2] : box.boxlo[2]);
            if (region.surface(x[0], x[1], x[2], 1e20) == 0 || region.contact[0].r == 0) continue;
            const auto& c = region.contact[0];
            const Vec normal = Vec(c.delx, c.dely, c.delz).normalized();
            return to.add_plane(name, normal, normal.dot(x) - c.r);
        }
        refuse("no corner of the box is inside");
    }
    if (!region.interior || !region.bboxflag) refuse("grains must be inside (side in)");
    const Extent bounds(region);
    const auto closed = [&region](int face) { return !region.openflag || !region.open_faces[face]; };
    if (style == "block") {
        for (int d = 0; d < 3; ++d) add_faces(to, name, bounds, d, closed(2 * d), closed(2 * d + 1));
        return;
    }
    if (style != "cylinder") refuse("style " + style + " is none of block, cylinder, plane");
    const int axis = axis_of(region, bounds), across = axis == 0 ? 1 : 0;
    add_faces(to, name, bounds, axis, closed(0), closed(1));
    if (closed(2)) to.add_cylinder(name, bounds.middle(), axis, 0.5 * (bounds.high[across] - bounds.low[across]));
}

}  // namespace nscdd
