// nscdd._core.Live: a run whose caller makes the steps.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <sstream>

#include "model/live.hpp"
#include "model/prepare_run.hpp"
#include "model/scene_table.hpp"
#include "module.hpp"
#include "nscdd/comm/in_process.hpp"

namespace nscdd::python {

namespace {

// ---- from Python's dictionaries to what the program reads

void append(toml::array& array, py::handle value);
toml::table to_table(py::handle dict);

// A number of NumPy, and an array without axes, as Python has it; others as they are.
py::object plain(py::handle value) {
    const bool common = PyFloat_Check(value.ptr()) || PyLong_Check(value.ptr()) || PyUnicode_Check(value.ptr());
    if (!common && py::hasattr(value, "item") && py::object(py::getattr(value, "ndim", py::none())).equal(py::int_(0)))
        return value.attr("item")();
    return py::reinterpret_borrow<py::object>(value);
}

// visit(x), x what TOML calls this value.
void visit_value(py::handle given, auto&& visit) {
    const py::object value = plain(given);
    if (py::isinstance<py::bool_>(value)) return visit(value.cast<bool>());
    if (py::isinstance<py::str>(value)) return visit(value.cast<std::string>());
    if (PyDict_Check(value.ptr()) || py::isinstance(value, py::module_::import("collections.abc").attr("Mapping")))
        return visit(to_table(py::dict(value)));
    if (PyFloat_Check(value.ptr())) return visit(value.cast<double>());
    // Arrays of one number have an index too.
    if (!PySequence_Check(value.ptr()) && PyIndex_Check(value.ptr()))
        return visit(py::int_(value).cast<std::int64_t>());
    if (PySequence_Check(value.ptr())) {
        toml::array array;
        // An object, not a handle: an array makes its items as they are asked for, and nobody else keeps them.
        for (const py::object item : py::reinterpret_borrow<py::sequence>(value)) append(array, item);
        return visit(std::move(array));
    }
    visit(py::float_(value).cast<double>());  // TypeError where it is no number
}

void append(toml::array& array, py::handle value) {
    visit_value(value, [&array]<class Value>(Value&& item) { array.push_back(std::forward<Value>(item)); });
}

toml::table to_table(py::handle dict) {
    toml::table table;
    for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(dict)) {
        if (value.is_none()) continue;
        const auto name = to<std::string>("a key", key);
        const auto insert = [&]<class Value>(Value&& item) { table.insert_or_assign(name, std::forward<Value>(item)); };
        converted(name, value, [&value, &insert] { visit_value(value, insert); });
    }
    return table;
}

// change(name), for each file that walls and obstacles of a scene are read from.
void for_each_file(toml::table& scene, auto&& change) {
    for (const char* kind : {"wall", "obstacle"})
        if (toml::array* const things = scene[kind].as_array())
            things->for_each([&change](toml::table& thing) {
                for (const char* key : {"stl", "file"})
                    if (toml::value<std::string>* const name = thing[key].as_string()) **name = change(**name);
            });
}

template <class Value>
std::optional<Value> find(const py::dict& options, const char* name) {
    if (!options.contains(name) || options[name].is_none()) return {};
    return to<Value>(name, options[name]);
}

std::string one_of(const char* what, const std::string& name, const std::vector<std::string>& names) {
    if (std::ranges::find(names, name) != names.end()) return name;
    std::string told = std::string(what) + " must be one of";
    for (const std::string& known : names) told += " '" + known + "'";
    throw InputError(told + ", found '" + name + "'");
}

RunArguments to_arguments(const py::dict& options) {
    RunArguments arguments;
    const auto any = [](const auto&) { return true; };
    arguments.start.packing = find<std::string>(options, "packing");
    arguments.start.from = find<std::string>(options, "state");
    arguments.start.adopt = find<bool>(options, "adopt").value_or(false);
    arguments.subdomains = find<int>(options, "subdomains").value_or(1);
    arguments.threads = find<int>(options, "threads").value_or(1);
    if (const auto name = find<std::string>(options, "scheme"))
        arguments.scheme = one_of("scheme", *name, names_of(offered_schemes(), any));
    if (const auto name = find<std::string>(options, "interface"))
        arguments.interface = value_of(interface_names, one_of("interface", *name, names_in(interface_names)));
    if (const auto name = find<std::string>(options, "multiplicity"))
        arguments.multiplicity =
            value_of(multiplicity_names, one_of("multiplicity", *name, names_in(multiplicity_names)));
    arguments.partition.kind = find<std::string>(options, "partition");
    if (arguments.partition.kind) one_of("partition", *arguments.partition.kind, names_of(offered_partitions(), any));
    arguments.partition.grid = find<std::vector<int>>(options, "grid").value_or(std::vector<int>());
    arguments.partition.given_imbalance = find<double>(options, "imbalance");
    if (const double given = arguments.partition.imbalance(); !(given >= 1 && given <= 1e6))
        throw InputError(fmt::format("imbalance must be a number in [1, 1000000], found {}", given));
    if (const auto solver = find<py::dict>(options, "solver")) {
        const toml::table given = to_table(*solver);
        TomlTable table(given, "nscdd", "");
        arguments.solver = read_solve_settings(table);
        table.finish();
    }
    return arguments;
}

// ---- a run, and who is at work on it

// Where a run is made: in this process, or on the ranks of a communicator of nscdd._mpi, one a process and more.
struct Place {
    std::unique_ptr<Communicator> comm;  // null: in this process
    Share share;

    explicit Place(const py::object& over_mpi) {
        if (over_mpi.is_none()) return;
        const auto parts = over_mpi.cast<py::tuple>();  // a capsule, the number of this process, that of all
        comm = std::move(*parts[0].cast<py::capsule>().get_pointer<std::unique_ptr<Communicator>>());
        share = {parts[1].cast<int>(), parts[2].cast<int>()};
    }
};

class Handle {
  public:
    // scene: that a simulation of arrays has, as in a scene file.
    Handle(RunRequest request, Place place, toml::table scene = {})
        : scene_(std::move(scene)), made_in_(getpid()), threads_(*request.threads) {
        for_each_file(scene_, [](const std::string& name) { return std::filesystem::absolute(name).string(); });
        if (!place.comm) place.comm = std::make_unique<InProcess>(*request.subdomains, threads_);
        const py::gil_scoped_release release;
        live_ = make_live(std::move(request), std::move(place.comm));
    }

    // Threads stay behind in the process that was forked, so that nobody can wait for them: the child keeps the run.
    ~Handle() {
        if (forked()) (void)live_.release();
    }
    Handle(const Handle&) = delete;

    // To look at the run, between steps.
    Live& live() {
        if (!live_) throw std::logic_error("Simulation: it ended with the process's last use of MPI");
        if (busy_) throw std::logic_error("Simulation: another thread is within step()");
        if (forked())
            throw std::logic_error("Simulation: its threads have stayed behind in the process that was forked");
        return *live_;
    }
    StepReport step() {
        Live& live = this->live();
        rows_ = {};
        contacts_ = {};
        const Busy now(busy_);
        std::optional<py::gil_scoped_release> release;
        if (!recording_) release.emplace();  // two threads must not be within HDF5, which h5py uses too
        return live.step();
    }
    void record(std::vector<std::string> series, std::vector<std::string> frames, int every) {
        live().record(std::move(series), std::move(frames), every);
        recording_ = true;
    }
    void stop() {
        Live& live = this->live();
        recording_ = false;
        live.stop();
    }
    void close() {
        if (!busy_ && !forked()) live_.reset();
    }

    // (n, numbers of a load); forces, then torques.
    py::array loads() {
        Live& live = this->live();
        std::vector<double> loads = live.loads();
        const py::ssize_t size = live.load_size();
        const auto rows = static_cast<py::ssize_t>(loads.size()) / size;
        return owned(std::move(loads), {rows, size});
    }
    void set_loads(const Doubles& loads) { live().set_loads(list(loads)); }
    void set_velocities(const Doubles& velocities) {
        live().set_velocities(list(velocities));
        rows_ = {};
    }

    // Arrays by id, the same until the next step.
    const py::dict& rows() {
        Live& live = this->live();
        if (rows_) return *rows_;
        GrainRows grains = live.grains();
        State& state = grains.state;
        const auto n = static_cast<py::ssize_t>(state.packing.size()),
                   dim = py::ssize_t(live.request().scene.dimension);
        py::dict rows;
        rows["positions"] = owned(std::move(state.packing.x), {n, dim});
        rows["velocities"] = owned(std::move(state.velocity), {n, dim});
        rows["spins"] = dim == 3 ? owned(std::move(state.spin), {n, 3}) : owned(std::move(state.spin), {n});
        rows["radii"] = owned(std::move(state.packing.radius), {n});
        rows["materials"] = owned(std::move(state.material), {n});
        rows["subdomains"] = owned(std::move(state.subdomain), {n});
        rows["multiplicities"] = owned(std::move(state.multiplicity), {n});
        rows["ids"] = owned(std::move(grains.ids), {n});
        rows["masses"] = owned(std::move(grains.masses), {n});
        return rows_.emplace(std::move(rows));
    }
    const py::dict& contacts() {
        Live& live = this->live();
        if (contacts_) return *contacts_;
        State::Contacts found = live.contacts();
        const auto n = static_cast<py::ssize_t>(found.i.size()), dim = py::ssize_t(live.request().scene.dimension);
        py::dict rows;
        rows["i"] = owned(std::move(found.i), {n});
        rows["j"] = owned(std::move(found.j), {n});
        rows["normal"] = owned(std::move(found.normal), {n, dim});
        rows["gap"] = owned(std::move(found.gap), {n});
        rows["impulse"] = owned(std::move(found.impulse), {n, dim});
        rows["normal_impulse"] = owned(std::move(found.normal_impulse), {n});
        if (found.have_couples) rows["couple"] = owned(std::move(found.couple), {n, dim == 3 ? 3 : 1});
        rows["subdomain"] = owned(std::move(found.subdomain), {n});
        return contacts_.emplace(std::move(rows));
    }
    void set_wall_velocity(std::size_t w, const std::vector<double>& velocity) {
        live().set_wall_velocity(w, velocity);
        toml::table* const wall = scene_["wall"][w].as_table();
        if (wall == nullptr) return;
        toml::array values;
        for (const double v : velocity) values.push_back(v);
        wall->insert_or_assign("velocity", std::move(values));
        if ((*wall)["motion"] == "fixed") wall->insert_or_assign("motion", "velocity");
    }
    void set_wall_force(std::size_t w, double force) {
        live().set_wall_force(w, force);
        if (toml::table* const wall = scene_["wall"][w].as_table()) wall->insert_or_assign("force", force);
    }
    void set_wall_pressure(std::size_t w, double pressure) {
        live().set_wall_pressure(w, pressure);
        if (toml::table* const wall = scene_["wall"][w].as_table()) wall->insert_or_assign("pressure", pressure);
    }

    // The scene as text of a file in that folder, walls with what moves them now.
    std::string scene_text(const std::string& folder) {
        if (scene_.empty()) throw InputError("the scene is in " + live().request().scene.file + " already");
        toml::table scene = scene_;
        for_each_file(scene, [from = std::filesystem::absolute(folder)](const std::string& name) {
            return std::filesystem::relative(name, from).string();
        });
        std::ostringstream text;
        text << scene << '\n';
        return text.str();
    }
    py::array in_place(Records which) {
        RecordsInPlace place = live().in_place(which);
        py::list names, formats, offsets;
        for (const auto& field : place.fields) {
            names.append(field.name);
            formats.append(field.numbers == 0   ? py::object(py::str("i4"))
                           : field.numbers == 1 ? py::object(py::str("f8"))
                                                : py::object(py::make_tuple("f8", py::make_tuple(field.numbers))));
            offsets.append(field.offset);
        }
        const py::dtype type(names, formats, offsets, static_cast<py::ssize_t>(place.stride));
        auto* kept = new std::shared_ptr<void>(std::move(place.owner));
        const py::capsule owner(kept, [](void* memory) { delete static_cast<std::shared_ptr<void>*>(memory); });
        py::array view(type, {static_cast<py::ssize_t>(place.count)}, {static_cast<py::ssize_t>(place.stride)},
                       place.first, owner);
        view.attr("setflags")(py::arg("write") = false);
        return view;
    }

  private:
    bool forked() const { return threads_ > 1 && getpid() != made_in_; }

    struct Busy {  // set and cleared with the GIL held
        explicit Busy(bool& of) : flag(of) { flag = true; }
        ~Busy() { flag = false; }
        Busy(const Busy&) = delete;
        bool& flag;
    };

    toml::table scene_;
    std::unique_ptr<Live> live_;
    pid_t made_in_;
    int threads_;
    bool busy_ = false, recording_ = false;
    std::optional<py::dict> rows_, contacts_;
};

std::unique_ptr<Handle> from_arrays(const py::dict& scene, const std::string& name, const Doubles& positions,
                                    const Doubles& radii, const py::dict& more, const py::dict& options,
                                    const py::object& over_mpi) {
    Place place(over_mpi);
    const auto total = static_cast<hsize_t>(radii.size());
    const hdf5::Rows rows = place.share.of(total);  // of this process; each has all arrays
    const auto cut = [&]<class Number>(const std::vector<Number>& all) {
        if (all.empty()) return all;
        const auto width = static_cast<std::ptrdiff_t>(all.size() / total);
        const auto at = [&](hsize_t row) { return all.begin() + static_cast<std::ptrdiff_t>(row) * width; };
        return std::vector<Number>(at(rows.begin), at(rows.end));
    };
    const auto take = [&more](const char* key) {
        const auto found = find<Doubles>(more, key);
        return found ? list(*found) : std::vector<double>();
    };
    Packing packing;
    packing.dim = static_cast<int>(positions.shape(1));
    packing.x = cut(list(positions));
    packing.radius = cut(list(radii));
    packing.box = take("box");
    packing.velocity = cut(take("velocities"));
    packing.spin = cut(take("spins"));
    if (const auto found = find<Ints>(more, "material")) packing.material = cut(list(*found));
    packing.before = rows.begin;
    packing.after = total - rows.end;
    RunArguments arguments = to_arguments(options);
    arguments.start.adopt = arguments.start.from.has_value();  // the scene does not say which grains it had
    toml::table table = to_table(scene);
    RunRequest request =
        prepare_run(arguments, scene_of(table, name), std::move(packing), place.share, place.comm != nullptr);
    if (const auto solver = find<py::dict>(options, "solver"))
        for (auto&& [key, value] : to_table(*solver))
            table.insert("solver", toml::table()).first->second.as_table()->insert_or_assign(key, std::move(value));
    request.masses = take("masses");
    const Packing& start = request.goes_on() ? request.from.packing : request.packing;
    if (!request.masses.empty()) {
        if (request.masses.size() != start.total())
            throw InputError("Simulation: masses must be as many as the grains");
        if (std::ranges::count(request.masses, std::numeric_limits<double>::infinity()) > 0) request.has_fixed = true;
        const auto first = request.masses.begin() + static_cast<std::ptrdiff_t>(start.before);
        request.masses = {first, first + static_cast<std::ptrdiff_t>(start.size())};
    }
    return std::make_unique<Handle>(std::move(request), std::move(place), std::move(table));
}

std::unique_ptr<Handle> from_file(const std::string& path, const py::dict& options, const py::object& over_mpi) {
    Place place(over_mpi);
    RunArguments arguments = to_arguments(options);
    arguments.start.scene = path;
    arguments.caller_counts = true;
    RunRequest request = prepare_run(arguments, {}, place.share, place.comm != nullptr);
    return std::make_unique<Handle>(std::move(request), std::move(place));
}

py::dict as_dict(const SeriesRow& row) {
    py::dict values;
    for (const SeriesValue& value : row) {
        std::vector<py::ssize_t> shape(value.shape.begin(), value.shape.end());
        values[value.name.c_str()] =
            shape.empty() ? py::object(py::float_(value.values[0])) : py::object(owned(value.values, std::move(shape)));
    }
    return values;
}

py::dict as_dict(const LiveWall& wall) {
    const auto vector = [](const std::vector<double>& v) { return owned(v, {static_cast<py::ssize_t>(v.size())}); };
    py::dict values;
    values["name"] = wall.name;
    values["normal"] = vector(wall.normal);
    values["velocity"] = vector(wall.velocity);
    values["offset"] = wall.offset;
    values["force"] = wall.force;
    values["mass"] = wall.mass;
    values["driven"] = wall.driven;
    return values;
}

py::dict as_dict(const LiveCell& cell) {
    const auto dim = static_cast<py::ssize_t>(cell.size.size());
    py::list axes;
    for (std::size_t d = 0; d < cell.periodic.size(); ++d)
        if (cell.periodic[d]) axes.append(std::string(1, "xyz"[d]));
    py::dict values;
    values["periodic"] = axes;
    values["size"] = owned(cell.size, {dim});
    values["tilt"] = owned(cell.tilt, {dim, dim});
    values["gradient"] = owned(cell.gradient, {dim, dim});
    return values;
}

}  // namespace

void add_simulation(py::module_& module) {
    const auto scene = [](Handle& h) -> const Scene& { return h.live().request().scene; };
    py::class_<Handle>(module, "Live")
        .def("step", &Handle::step)
        .def("record", &Handle::record)
        .def("stop", &Handle::stop)
        .def("close", &Handle::close)
        .def("loads", &Handle::loads)
        .def("set_loads", &Handle::set_loads)
        .def("set_velocities", &Handle::set_velocities)
        .def("save", [](Handle& h, const std::string& path) { h.live().save(path); })
        .def("scene_text", &Handle::scene_text)
        .def("rows", &Handle::rows)
        .def("contacts", &Handle::contacts)
        .def("grains_in_place", [](Handle& live) { return live.in_place(Records::grains); })
        .def("contacts_in_place", [](Handle& live) { return live.in_place(Records::contacts); })
        .def("wall_contacts_in_place", [](Handle& live) { return live.in_place(Records::wall_contacts); })
        .def("measures", [](Handle& h) { return as_dict(h.live().measures()); })
        .def("cell", [](Handle& h) { return as_dict(h.live().cell()); })
        .def("wall_count", [](Handle& h) { return h.live().wall_count(); })
        .def("wall", [](Handle& h, std::size_t w) { return as_dict(h.live().wall(w)); })
        .def("wall_pressure", [scene](Handle& h, std::size_t w) { return scene(h).walls.at(w).pressure; })
        .def("set_wall_velocity", &Handle::set_wall_velocity)
        .def("set_wall_force", &Handle::set_wall_force)
        .def("set_wall_pressure", &Handle::set_wall_pressure)
        .def("steps", [](Handle& h) { return h.live().steps(); })
        .def("stopped_by", [](Handle& h) { return h.live().stopped_by(); })
        .def("time", [](Handle& h) { return h.live().time(); })
        .def("grain_count", [](Handle& h) { return h.live().grain_count(); })
        .def("dimension", [scene](Handle& h) { return scene(h).dimension; })
        .def("name", [scene](Handle& h) { return scene(h).name; })
        .def("law", [scene](Handle& h) { return scene(h).law; })
        .def("h", [scene](Handle& h) { return scene(h).step.h; })
        .def("count", [scene](Handle& h) { return scene(h).step.count; })
        .def("has_own_loads",
             [scene](Handle& h) {
                 return std::ranges::any_of(scene(h).grains, [](const SceneGrain& grain) {
                     return !grain.force.isZero(0) || !grain.torque.isZero(0);
                 });
             })
        .def("may_stop", [scene](Handle& h) { return scene(h).stop.any(); })
        .def("material_names",
             [scene](Handle& h) {
                 std::vector<std::string> names;
                 for (const auto& material : scene(h).materials) names.push_back(material.name);
                 return names;
             })
        .def("scheme", [](Handle& h) { return *h.live().request().scheme; })
        .def("subdomains", [](Handle& h) { return h.live().comm().size(); });
    module.def("from_arrays", &from_arrays);
    module.def("from_file", &from_file);
}

}  // namespace nscdd::python
