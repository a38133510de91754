#include "files/state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <numeric>

#include "files/replace_file.hpp"
#include "files/xdmf.hpp"

namespace nscdd {
namespace {

void require_range(const hdf5::Reader& file, const char* dataset, const std::vector<int>& values, hsize_t first,
                   int low, int high) {
    const auto bad = std::find_if(values.begin(), values.end(), [=](int v) { return v < low || v > high; });
    if (bad != values.end())
        throw file.error(dataset, fmt::format("row {} must lie in [{}, {}], found {}",
                                              first + static_cast<hsize_t>(bad - values.begin()), low, high, *bad));
}

// Datasets of states for pictures: (n) the point of each vertex, and in 2D (n, 3) velocities, because ParaView's
// vectors have three columns.
constexpr const char *vertices = "paraview/vertex", *velocity_3d = "paraview/velocity";

std::string xdmf_text(const std::string& h5, const State& state, std::size_t grains) {
    const int dim = state.packing.dim;
    const auto node = [&](const char* name, const char* kind, const char* dataset, const char* type, int columns) {
        return xdmf::attribute(name, kind, "Node", xdmf::item(h5, dataset, type, grains, columns));
    };
    const std::string attributes = node("radius", "Scalar", "radius", "Float", 1) +
                                   node("velocity", "Vector", dim == 3 ? "velocity" : velocity_3d, "Float", 3) +
                                   node("multiplicity", "Scalar", "multiplicity", "Int", 1) +
                                   node("subdomain", "Scalar", "subdomain", "Int", 1);
    return xdmf::document(fmt::format(R"(    <Grid Name="{}" GridType="Uniform">
      <Time Value="{}"/>
      <Topology TopologyType="Polyvertex" NumberOfElements="{}" NodesPerElement="1">{}</Topology>
      <Geometry GeometryType="{}">{}</Geometry>
{}    </Grid>
)",
                                      xdmf::escape(state.scene), state.time, grains,
                                      xdmf::item(h5, vertices, "Int", grains, 1), dim == 3 ? "XYZ" : "XY",
                                      xdmf::item(h5, "x", "Float", grains, dim), attributes));
}

}  // namespace

State read_state(const std::string& path, const Share& share) {
    const hdf5::Reader file(path);
    State state;
    state.packing = read_packing(file, share);
    const hsize_t n = state.packing.total();
    const hdf5::Rows grains = share.of(n);
    const auto dim = static_cast<hsize_t>(state.packing.dim);
    state.velocity = file.read<double>("velocity", {n, dim}, grains);
    state.spin = file.read<double>("spin", {n, static_cast<hsize_t>(state.spins())}, grains);
    state.material = file.read<int>("material", {n}, grains);
    state.subdomain = file.read<int>("subdomain", {n}, grains);
    state.multiplicity = file.read<int>("multiplicity", {n}, grains);

    const hdf5::Shape walls = file.shape("walls/normal");
    const hsize_t w = walls.empty() ? 0 : walls[0];
    state.walls = {.name = file.texts("walls/name", w),
                   .offset = file.read<double>("walls/offset", {w}),
                   .normal = file.read<double>("walls/normal", {w, dim}),
                   .velocity = file.read<double>("walls/velocity", {w, dim}),
                   .normal_speed = file.read<double>("walls/normal_speed", {w})};

    if (file.has("obstacles/facets")) {
        const hdf5::Shape obstacles = file.shape("obstacles/facets");
        const hsize_t o = obstacles.empty() ? 0 : obstacles[0];
        state.obstacles = {.name = file.texts("obstacles/name", o), .facets = file.read<int>("obstacles/facets", {o})};
    }
    const int facets = std::accumulate(state.obstacles.facets.begin(), state.obstacles.facets.end(), 0);

    if (file.has("cell/periodic"))
        state.cell = {.periodic = file.read<int>("cell/periodic", {dim}),
                      .gradient = file.read<double>("cell/gradient", {dim, dim}),
                      .size = file.read<double>("cell/size", {dim}),
                      .tilt = file.read<double>("cell/tilt", {dim, dim}),
                      .broad_phase_size = file.read<double>("rough/cell_size", {dim}),
                      .broad_phase_tilt = file.read<double>("rough/cell_tilt", {dim, dim}),
                      .stretch = file.read<double>("rough/stretch", {dim, dim})};

    if (file.has("so_far/edges"))
        state.so_far = {.h = {},
                        .edges = file.read<double>("so_far/edges", {dim}),
                        .flowed = file.read<double>("so_far/flowed", {dim, dim}),
                        .inserted = {},
                        .removed = {},
                        .came = {},
                        .left = {}};
    if (file.has("so_far/h")) state.so_far.h = file.read<double>("so_far/h", {1});
    if (file.has("so_far/inserted")) {
        const auto list = [&file](const char* name) {
            const hdf5::Shape shape = file.shape(name);
            return file.read<double>(name, {shape.empty() ? 0 : shape[0]});
        };
        state.so_far.inserted = list("so_far/inserted");
        state.so_far.removed = list("so_far/removed");
        state.so_far.came = file.read<double>("so_far/came", {State::SoFar::amounts});
        state.so_far.left = file.read<double>("so_far/left", {State::SoFar::amounts});
    }
    state.has_fixed = file.has("fixed");
    if (state.has_fixed) state.packing.fixed = file.read<int>("fixed", {n}, grains);

    const hdf5::Shape materials = file.shape("materials/density");
    const hsize_t m = materials.empty() ? 0 : materials[0];
    state.materials = {.name = file.texts("materials/name", m), .density = file.read<double>("materials/density", {m})};
    require_range(file, "material", state.material, grains.begin, 0, static_cast<int>(m) - 1);

    const hdf5::Shape contacts = file.shape("contacts/normal");
    const hsize_t c = contacts.empty() ? 0 : contacts[0];
    const hdf5::Rows rows = Share{share.part, share.parts}.of(c);
    state.contacts = {.i = file.read<int>("contacts/i", {c}, rows),
                      .j = file.read<int>("contacts/j", {c}, rows),
                      .impulse = file.read<double>("contacts/impulse", {c, dim}, rows),
                      .normal = file.read<double>("contacts/normal", {c, dim}, rows),
                      .gap = file.read<double>("contacts/gap", {c}, rows),
                      .subdomain = file.read<int>("contacts/subdomain", {c}, rows),
                      .normal_impulse = file.read<double>("contacts/normal_impulse", {c}, rows)};
    if (file.has("contacts/couple")) {
        state.contacts.couple = file.read<double>("contacts/couple", {c, static_cast<hsize_t>(state.spins())}, rows);
        state.contacts.have_couples = true;
    }
    const int last = static_cast<int>(n) - 1;
    require_range(file, "contacts/i", state.contacts.i, rows.begin, 0, last);
    require_range(file, "contacts/j", state.contacts.j, rows.begin, -static_cast<int>(w) - facets, last);

    const hdf5::Shape numbers = file.shape("rough/partition");
    state.broad_phase = {.kind = file.texts("rough/kind", 1)[0],
                         .partition = file.read<double>("rough/partition", {numbers.empty() ? 0 : numbers[0]}),
                         .imbalance = file.read<double>("rough/imbalance", {1})[0],
                         .x = file.read<double>("rough/x", {n, dim}, grains),
                         .offset = file.read<double>("rough/offset", {w}),
                         .skin = file.read<double>("rough/skin", {1})[0],
                         .steps_since = file.read<int>("rough/steps_since", {1})[0],
                         .time = file.has("rough/time") ? file.read<double>("rough/time", {1})[0] : 0.0};
    if (!(state.broad_phase.imbalance >= 1)) throw file.error("rough/imbalance", "must be >= 1");
    if (!(state.broad_phase.skin > 0)) throw file.error("rough/skin", "must be > 0");
    if (state.broad_phase.steps_since < 0) throw file.error("rough/steps_since", "must be >= 0");

    state.time = file.attribute<double>("time");
    const auto count = [&](const char* name, std::int64_t most) {
        const auto value = file.attribute<std::int64_t>(name);
        if (value < 0 || value > most)
            throw InputError(fmt::format("{}: attribute '{}': must lie in [0, {}], found {}", path, name, most, value));
        return value;
    };
    state.step = count("step", State::most_steps);
    state.steps_left = count("steps_left", std::numeric_limits<int>::max());
    state.scene = file.attribute<std::string>("scene");
    return state;
}

std::string xdmf_beside(const std::string& path) {
    return path.empty() ? "" : std::filesystem::path(path).replace_extension(".xdmf").string();
}

StateWriter::StateWriter(FileSet& files, const std::string& path, const State& head, std::size_t grains,
                         std::size_t contacts, For use)
    : file_(files, path),
      pictured_(use == For::pictures),
      flat_(head.packing.dim == 2),
      couples_(head.contacts.have_couples) {
    const hsize_t n = grains, c = contacts, w = head.walls.offset.size();
    const auto dim = static_cast<hsize_t>(head.packing.dim);
    file_.declare<double>("x", {n, dim});
    file_.declare<double>("radius", {n});
    file_.write("box", head.packing.box, {dim});
    file_.attribute("dim", static_cast<std::int64_t>(head.packing.dim));
    file_.declare<double>("velocity", {n, dim});
    if (pictured_) file_.declare<int>(vertices, {n});
    if (pictured_ && flat_) file_.declare<double>(velocity_3d, {n, 3});
    file_.declare<double>("spin", {n, static_cast<hsize_t>(head.spins())});
    for (const char* dataset : {"material", "subdomain", "multiplicity"}) file_.declare<int>(dataset, {n});

    file_.texts("walls/name", head.walls.name);
    file_.write("walls/offset", head.walls.offset, {w});
    file_.write("walls/normal", head.walls.normal, {w, dim});
    file_.write("walls/velocity", head.walls.velocity, {w, dim});
    file_.write("walls/normal_speed", head.walls.normal_speed, {w});
    file_.texts("materials/name", head.materials.name);
    file_.write("materials/density", head.materials.density, {head.materials.density.size()});

    if (!head.obstacles.name.empty()) {
        file_.texts("obstacles/name", head.obstacles.name);
        file_.write("obstacles/facets", head.obstacles.facets, {head.obstacles.facets.size()});
        file_.write("rough/time", std::vector{head.broad_phase.time}, {1});
    }
    if (!head.cell.periodic.empty()) {
        file_.write("cell/periodic", head.cell.periodic, {dim});
        file_.write("cell/size", head.cell.size, {dim});
        file_.write("cell/tilt", head.cell.tilt, {dim, dim});
        file_.write("cell/gradient", head.cell.gradient, {dim, dim});
        file_.write("rough/cell_size", head.cell.broad_phase_size, {dim});
        file_.write("rough/cell_tilt", head.cell.broad_phase_tilt, {dim, dim});
        file_.write("rough/stretch", head.cell.stretch, {dim, dim});
    }

    if (!head.so_far.edges.empty()) {
        file_.write("so_far/edges", head.so_far.edges, {dim});
        file_.write("so_far/flowed", head.so_far.flowed, {dim, dim});
    }
    if (!head.so_far.h.empty()) file_.write("so_far/h", head.so_far.h, {1});
    if (!head.so_far.came.empty()) {
        file_.write("so_far/inserted", head.so_far.inserted, {head.so_far.inserted.size()});
        file_.write("so_far/removed", head.so_far.removed, {head.so_far.removed.size()});
        file_.write("so_far/came", head.so_far.came, {State::SoFar::amounts});
        file_.write("so_far/left", head.so_far.left, {State::SoFar::amounts});
    }
    fixed_ = head.has_fixed;
    if (fixed_) file_.declare<int>("fixed", {n});

    for (const char* dataset : {"contacts/i", "contacts/j", "contacts/subdomain"}) file_.declare<int>(dataset, {c});
    for (const char* dataset : {"contacts/impulse", "contacts/normal"}) file_.declare<double>(dataset, {c, dim});
    for (const char* dataset : {"contacts/gap", "contacts/normal_impulse"}) file_.declare<double>(dataset, {c});
    if (couples_) file_.declare<double>("contacts/couple", {c, static_cast<hsize_t>(head.spins())});

    file_.texts("rough/kind", {head.broad_phase.kind});
    file_.write("rough/partition", head.broad_phase.partition, {head.broad_phase.partition.size()});
    file_.write("rough/imbalance", std::vector{head.broad_phase.imbalance}, {1});
    file_.declare<double>("rough/x", {n, dim});
    file_.write("rough/offset", head.broad_phase.offset, {w});
    file_.write("rough/skin", std::vector{head.broad_phase.skin}, {1});
    file_.write("rough/steps_since", std::vector{head.broad_phase.steps_since}, {1});

    file_.attribute("time", head.time);
    file_.attribute("step", head.step);
    file_.attribute("steps_left", head.steps_left);
    file_.attribute("scene", head.scene);
}

void StateWriter::append(const State& rows) {
    file_.append("x", rows.packing.x);
    file_.append("radius", rows.packing.radius);
    file_.append("velocity", rows.velocity);
    if (pictured_) {
        std::vector<int> rows_of(rows.packing.size());
        for (int& vertex : rows_of) vertex = vertices_++;
        file_.append(vertices, rows_of);
    }
    if (pictured_ && flat_) {
        std::vector<double> velocity;
        for (std::size_t k = 0; k < rows.velocity.size(); k += 2)
            velocity.insert(velocity.end(), {rows.velocity[k], rows.velocity[k + 1], 0.0});
        file_.append(velocity_3d, velocity);
    }
    file_.append("spin", rows.spin);
    file_.append("material", rows.material);
    if (fixed_) file_.append("fixed", rows.packing.fixed);
    file_.append("subdomain", rows.subdomain);
    file_.append("multiplicity", rows.multiplicity);
    file_.append("rough/x", rows.broad_phase.x);
    file_.append("contacts/i", rows.contacts.i);
    file_.append("contacts/j", rows.contacts.j);
    file_.append("contacts/impulse", rows.contacts.impulse);
    file_.append("contacts/normal", rows.contacts.normal);
    file_.append("contacts/gap", rows.contacts.gap);
    file_.append("contacts/subdomain", rows.contacts.subdomain);
    file_.append("contacts/normal_impulse", rows.contacts.normal_impulse);
    if (couples_) file_.append("contacts/couple", rows.contacts.couple);
}

void StateWriter::save() { file_.save(); }

void write_xdmf(FileSet& files, const std::string& state_path, const State& head, std::size_t grains) {
    files.add(xdmf_beside(state_path), xdmf_text(std::filesystem::path(state_path).filename().string(), head, grains));
}

void write_state(const std::string& path, const State& state) {
    if (xdmf_beside(path) == path)
        throw OutputError(path + ": a state is an HDF5 file, .xdmf is the name of the one beside it");
    FileSet files;
    StateWriter writer(files, path, state, state.packing.size(), state.contacts.i.size());
    writer.append(state);
    writer.save();
    write_xdmf(files, path, state, state.packing.size());
    files.commit();
}

}  // namespace nscdd
