#include "files/packing.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <limits>

namespace nscdd {
namespace {

void require_positive(const hdf5::Reader& file, const char* dataset, const std::vector<double>& values, hsize_t first) {
    const auto bad = std::find_if(values.begin(), values.end(), [](double v) { return v <= 0; });
    if (bad != values.end())
        throw file.error(dataset, fmt::format("row {} must be > 0, found {}",
                                              first + static_cast<hsize_t>(bad - values.begin()), *bad));
}

}  // namespace

hdf5::Rows Share::of(hsize_t rows) const {
    const hsize_t all = dealt > 0 ? dealt : rows, p = static_cast<hsize_t>(part), n = static_cast<hsize_t>(parts);
    const auto start = [&](hsize_t k) { return std::min(all / n * k + all % n * k / n, rows); };
    return {start(p), start(p + 1)};
}

Packing read_packing(const hdf5::Reader& file, const Share& share) {
    const hdf5::Shape shape = file.shape("x");
    if (shape.size() != 2 || (shape[1] != 2 && shape[1] != 3))
        throw file.error("x", "must have shape (n, 2) or (n, 3), found " + hdf5::to_string(shape));
    const auto [n, dim] = std::pair(shape[0], shape[1]);
    if (n > std::numeric_limits<int>::max()) throw file.error("x", fmt::format("holds too many grains, {}", n));

    const hdf5::Rows rows = share.of(n);
    Packing packing{.dim = static_cast<int>(dim),
                    .x = file.read<double>("x", {n, dim}, rows),
                    .radius = file.read<double>("radius", {n}, rows),
                    .box = file.read<double>("box", {dim}),
                    .before = rows.begin,
                    .after = n - rows.end};
    require_positive(file, "radius", packing.radius, rows.begin);
    require_positive(file, "box", packing.box, 0);
    return packing;
}

void write_packing(hdf5::Writer& file, const Packing& packing) {
    const auto dim = static_cast<hsize_t>(packing.dim);
    file.write("x", packing.x, {packing.size(), dim});
    file.write("radius", packing.radius, {packing.size()});
    file.write("box", packing.box, {dim});
    file.attribute("dim", static_cast<std::int64_t>(packing.dim));
}

Packing read_packing(const std::string& path, const Share& share) {
    const hdf5::Reader file(path);
    Packing packing = read_packing(file, share);
    const hsize_t n = packing.total(), dim = static_cast<hsize_t>(packing.dim);
    if (n == 0) throw file.error("x", "is empty: a packing needs at least one grain");
    const hdf5::Rows rows = share.of(n);
    if (file.has("velocity")) packing.velocity = file.read<double>("velocity", {n, dim}, rows);
    if (file.has("spin")) packing.spin = file.read<double>("spin", {n, hsize_t{dim == 3 ? 3u : 1u}}, rows);
    if (file.has("periodic")) packing.periodic = file.read<int>("periodic", {dim});
    if (file.has("cell/periodic")) {
        packing.periodic = file.read<int>("cell/periodic", {dim});
        packing.tilt = file.read<double>("cell/tilt", {dim, dim});
    }
    for (const int axis : packing.periodic)
        if (axis != 0 && axis != 1) throw file.error("periodic", fmt::format("must be 0 or 1, found {}", axis));
    packing.has_fixed = file.has("fixed");
    if (packing.has_fixed) packing.fixed = file.read<int>("fixed", {n}, rows);
    if (!file.has("material")) return packing;
    packing.material = file.read<int>("material", {n}, rows);
    if (file.has("materials/name")) {
        const hdf5::Shape names = file.shape("materials/name");
        packing.materials = file.texts("materials/name", names.empty() ? 0 : names[0]);
    }
    return packing;
}

void write_packing(const std::string& path, const Packing& packing,
                   const std::map<std::string, std::string>& attributes) {
    hdf5::Writer file(path);
    write_packing(file, packing);
    if (!packing.periodic.empty()) file.write("periodic", packing.periodic, {packing.periodic.size()});
    for (const auto& [name, value] : attributes) file.attribute(name, value);
    file.save();
}

}  // namespace nscdd
