// nscdd._core: packings and states of the program, read and written.
#include <algorithm>

#include "files/state.hpp"
#include "module.hpp"

namespace nscdd::python {

namespace {

// Without numbers where there should be some, the file does not have it.
void set(py::dict& to, const char* name, auto numbers, std::vector<py::ssize_t> shape) {
    if (!numbers.empty() || std::ranges::count(shape, 0) > 0) to[name] = owned(std::move(numbers), std::move(shape));
}

std::string axes(const std::vector<int>& periodic) {
    std::string names;
    for (std::size_t d = 0; d < periodic.size(); ++d)
        if (periodic[d]) names += "xyz"[d];
    return names;
}

py::dict as_dict(Packing packing) {
    const auto n = static_cast<py::ssize_t>(packing.size()), dim = py::ssize_t(packing.dim);
    py::dict out;
    set(out, "positions", std::move(packing.x), {n, dim});
    set(out, "radii", std::move(packing.radius), {n});
    set(out, "box", std::move(packing.box), {dim});
    set(out, "velocities", std::move(packing.velocity), {n, dim});
    if (dim == 3)
        set(out, "spins", std::move(packing.spin), {n, 3});
    else
        set(out, "spins", std::move(packing.spin), {n});
    set(out, "material", std::move(packing.material), {n});
    set(out, "fixed", std::move(packing.fixed), {n});
    set(out, "tilt", std::move(packing.tilt), {dim, dim});
    out["materials"] = packing.materials;
    out["periodic"] = axes(packing.periodic);
    return out;
}

py::dict read_state_dict(const std::string& path) {
    State state = read_state(path);
    const auto dim = py::ssize_t(state.packing.dim);
    state.packing.velocity = std::move(state.velocity);
    state.packing.spin = std::move(state.spin);
    state.packing.material = std::move(state.material);
    state.packing.materials = state.materials.name;
    state.packing.periodic = state.cell.periodic;
    state.packing.tilt = state.cell.tilt;
    py::dict out = as_dict(std::move(state.packing));
    set(out, "gradient", std::move(state.cell.gradient), {dim, dim});
    py::dict walls, contacts;
    for (std::size_t w = 0; w < state.walls.name.size(); ++w) {
        const auto vector = [&](const std::vector<double>& rows) {
            const auto first = rows.begin() + static_cast<std::ptrdiff_t>(w) * dim;
            return owned(std::vector<double>(first, first + dim), {dim});
        };
        py::dict wall;
        wall["offset"] = state.walls.offset[w];
        wall["normal"] = vector(state.walls.normal);
        wall["velocity"] = vector(state.walls.velocity);
        walls[state.walls.name[w].c_str()] = wall;
    }
    State::Contacts& c = state.contacts;
    const auto m = static_cast<py::ssize_t>(c.i.size());
    contacts["i"] = owned(std::move(c.i), {m});
    contacts["j"] = owned(std::move(c.j), {m});
    contacts["normal"] = owned(std::move(c.normal), {m, dim});
    contacts["gap"] = owned(std::move(c.gap), {m});
    contacts["impulse"] = owned(std::move(c.impulse), {m, dim});
    contacts["normal_impulse"] = owned(std::move(c.normal_impulse), {m});
    if (c.have_couples) contacts["couple"] = owned(std::move(c.couple), {m, dim == 3 ? 3 : 1});
    contacts["subdomain"] = owned(std::move(c.subdomain), {m});
    out["dimension"] = dim;
    out["walls"] = walls;
    out["contacts"] = contacts;
    out["densities"] = owned(state.materials.density, {static_cast<py::ssize_t>(state.materials.density.size())});
    out["step"] = state.step;
    out["time"] = state.time;
    out["scene"] = state.scene;
    return out;
}

void write(const std::string& path, const Doubles& x, const Doubles& radius, const Doubles& box,
           std::vector<int> periodic) {
    Packing packing{static_cast<int>(x.shape(1)), list(x), list(radius), list(box)};
    packing.periodic = std::move(periodic);
    write_packing(path, packing, {{"source", "nscdd for Python"}});
}

}  // namespace

void add_files(py::module_& module) {
    module.def("read_packing", [](const std::string& path) { return as_dict(read_packing(path)); });
    module.def("write_packing", &write);
    module.def("read_state", &read_state_dict);
}

}  // namespace nscdd::python
