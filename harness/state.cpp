#include "state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "replace_file.hpp"

namespace nscdd {
namespace {

void require_range(const hdf5::Reader& file, const char* dataset, const std::vector<int>& values, int low, int high) {
    const auto bad = std::find_if(values.begin(), values.end(), [=](int v) { return v < low || v > high; });
    if (bad != values.end())
        throw file.error(dataset,
                         fmt::format("row {} must lie in [{}, {}], found {}", bad - values.begin(), low, high, *bad));
}

std::string xml_escape(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

// Writes XDMF elements that point into one HDF5 file of n grains.
struct Xdmf {
    std::string file;
    std::size_t n;

    std::string item(std::string_view dataset, std::string_view type, int columns) const {
        const std::string extent = columns == 1 ? fmt::format("{}", n) : fmt::format("{} {}", n, columns);
        return fmt::format(R"(<DataItem Dimensions="{}" NumberType="{}" Precision="{}" Format="HDF">{}:/{}</DataItem>)",
                           extent, type, type == "Int" ? 4 : 8, file, dataset);
    }

    static std::string attribute(std::string_view name, std::string_view kind, std::string_view data) {
        return fmt::format("      <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"Node\">{}</Attribute>\n", name,
                           kind, data);
    }

    // Column k of an (n, 2) dataset: ParaView's vectors have three components.
    std::string column(std::string_view dataset, int k) const {
        return fmt::format(R"(<DataItem ItemType="HyperSlab" Dimensions="{} 1">)"
                           R"(<DataItem Dimensions="3 2" Format="XML">0 {} 1 1 {} 1</DataItem>{}</DataItem>)",
                           n, k, n, item(dataset, "Float", 2));
    }
};

std::string xdmf_text(const std::string& h5_name, const State& state) {
    const int dim = state.packing.dim;
    const Xdmf xdmf{xml_escape(h5_name), state.packing.size()};
    std::string attributes = Xdmf::attribute("radius", "Scalar", xdmf.item("radius", "Float", 1));
    if (dim == 3) {
        attributes += Xdmf::attribute("velocity", "Vector", xdmf.item("velocity", "Float", 3));
    } else {
        attributes += Xdmf::attribute("velocity_x", "Scalar", xdmf.column("velocity", 0));
        attributes += Xdmf::attribute("velocity_y", "Scalar", xdmf.column("velocity", 1));
    }
    attributes += Xdmf::attribute("multiplicity", "Scalar", xdmf.item("multiplicity", "Int", 1));
    attributes += Xdmf::attribute("subdomain", "Scalar", xdmf.item("subdomain", "Int", 1));
    return fmt::format(R"(<?xml version="1.0"?>
<Xdmf Version="3.0">
  <Domain>
    <Grid Name="{}" GridType="Uniform">
      <Time Value="{}"/>
      <Topology TopologyType="Polyvertex" NumberOfElements="{}" NodesPerElement="1"/>
      <Geometry GeometryType="{}">{}</Geometry>
{}    </Grid>
  </Domain>
</Xdmf>
)",
                       xml_escape(state.scene), state.time, xdmf.n, dim == 3 ? "XYZ" : "XY",
                       xdmf.item("x", "Float", dim), attributes);
}

}  // namespace

State read_state(const std::string& path) {
    const hdf5::Reader file(path);
    State state;
    state.packing = read_packing(file);
    const hsize_t n = state.packing.size();
    const auto dim = static_cast<hsize_t>(state.packing.dim);
    state.velocity = file.read<double>("velocity", {n, dim});
    state.spin = file.read<double>("spin", {n, static_cast<hsize_t>(state.spins())});
    state.material = file.read<int>("material", {n});
    state.subdomain = file.read<int>("subdomain", {n});
    state.multiplicity = file.read<int>("multiplicity", {n});

    const hdf5::Shape walls = file.shape("walls/normal");
    const hsize_t w = walls.empty() ? 0 : walls[0];
    state.walls = {.name = file.texts("walls/name", w),
                   .offset = file.read<double>("walls/offset", {w}),
                   .normal = file.read<double>("walls/normal", {w, dim}),
                   .velocity = file.read<double>("walls/velocity", {w, dim}),
                   .normal_speed = file.read<double>("walls/normal_speed", {w})};

    const hdf5::Shape materials = file.shape("materials/density");
    const hsize_t m = materials.empty() ? 0 : materials[0];
    state.materials = {.name = file.texts("materials/name", m), .density = file.read<double>("materials/density", {m})};
    require_range(file, "material", state.material, 0, static_cast<int>(m) - 1);

    const hdf5::Shape contacts = file.shape("contacts/normal");
    const hsize_t c = contacts.empty() ? 0 : contacts[0];
    state.contacts = {.i = file.read<int>("contacts/i", {c}),
                      .j = file.read<int>("contacts/j", {c}),
                      .impulse = file.read<double>("contacts/impulse", {c, dim}),
                      .normal = file.read<double>("contacts/normal", {c, dim}),
                      .gap = file.read<double>("contacts/gap", {c}),
                      .subdomain = file.read<int>("contacts/subdomain", {c}),
                      .normal_impulse = file.read<double>("contacts/normal_impulse", {c})};
    const int last = static_cast<int>(n) - 1;
    require_range(file, "contacts/i", state.contacts.i, 0, last);
    require_range(file, "contacts/j", state.contacts.j, -static_cast<int>(w), last);

    const hdf5::Shape numbers = file.shape("rough/partition");
    state.rough = {.kind = file.texts("rough/kind", 1)[0],
                   .partition = file.read<double>("rough/partition", {numbers.empty() ? 0 : numbers[0]}),
                   .imbalance = file.read<double>("rough/imbalance", {1})[0],
                   .x = file.read<double>("rough/x", {n, dim}),
                   .offset = file.read<double>("rough/offset", {w}),
                   .skin = file.read<double>("rough/skin", {1})[0],
                   .steps_since = file.read<int>("rough/steps_since", {1})[0]};
    if (!(state.rough.imbalance >= 1)) throw file.error("rough/imbalance", "must be >= 1");
    if (!(state.rough.skin > 0)) throw file.error("rough/skin", "must be > 0");
    if (state.rough.steps_since < 0) throw file.error("rough/steps_since", "must be >= 0");

    state.time = file.attribute<double>("time");
    state.step = file.attribute<std::int64_t>("step");
    if (state.step < 0 || state.step > State::most_steps)
        throw InputError(
            fmt::format("{}: attribute 'step': must lie in [0, {}], found {}", path, State::most_steps, state.step));
    state.scene = file.attribute<std::string>("scene");
    return state;
}

std::string xdmf_beside(const std::string& path) {
    return path.empty() ? "" : std::filesystem::path(path).replace_extension(".xdmf").string();
}

std::string write_state(FileSet& files, const std::string& path, const State& state) {
    const std::filesystem::path h5_path(path);
    const std::string xdmf_path = xdmf_beside(path);
    if (xdmf_path == path)
        throw OutputError(path + ": a state is an HDF5 file, .xdmf is the name of the one beside it");

    hdf5::Writer file(path);
    write_packing(file, state.packing);
    const hsize_t n = state.packing.size();
    const auto dim = static_cast<hsize_t>(state.packing.dim);
    file.write("velocity", state.velocity, {n, dim});
    file.write("spin", state.spin, {n, static_cast<hsize_t>(state.spins())});
    file.write("material", state.material, {n});
    file.write("subdomain", state.subdomain, {n});
    file.write("multiplicity", state.multiplicity, {n});

    const hsize_t w = state.walls.offset.size();
    file.texts("walls/name", state.walls.name);
    file.write("walls/offset", state.walls.offset, {w});
    file.write("walls/normal", state.walls.normal, {w, dim});
    file.write("walls/velocity", state.walls.velocity, {w, dim});
    file.write("walls/normal_speed", state.walls.normal_speed, {w});
    file.texts("materials/name", state.materials.name);
    file.write("materials/density", state.materials.density, {state.materials.density.size()});

    const hsize_t c = state.contacts.i.size();
    file.write("contacts/i", state.contacts.i, {c});
    file.write("contacts/j", state.contacts.j, {c});
    file.write("contacts/impulse", state.contacts.impulse, {c, dim});
    file.write("contacts/normal", state.contacts.normal, {c, dim});
    file.write("contacts/gap", state.contacts.gap, {c});
    file.write("contacts/subdomain", state.contacts.subdomain, {c});
    file.write("contacts/normal_impulse", state.contacts.normal_impulse, {c});

    file.texts("rough/kind", {state.rough.kind});
    file.write("rough/partition", state.rough.partition, {state.rough.partition.size()});
    file.write("rough/imbalance", std::vector{state.rough.imbalance}, {1});
    file.write("rough/x", state.rough.x, {n, dim});
    file.write("rough/offset", state.rough.offset, {w});
    file.write("rough/skin", std::vector{state.rough.skin}, {1});
    file.write("rough/steps_since", std::vector{state.rough.steps_since}, {1});

    file.attribute("time", state.time);
    file.attribute("step", state.step);
    file.attribute("scene", state.scene);
    files.add(xdmf_path, xdmf_text(h5_path.filename().string(), state));
    return file.save(files);
}

void write_state(const std::string& path, const State& state) {
    FileSet files;
    write_state(files, path, state);
    files.commit();
}

}  // namespace nscdd
