// nscdd._core.solve_*: contact problems of one's own detection, and of SciPy's sparse matrices.
#include <array>
#include <optional>

#include "model/solve_local.hpp"
#include "module.hpp"
#include "nscdd/compiled.hpp"

namespace nscdd::python {

namespace {

// work() without the GIL. Where it cannot go on, what was given is wrong: a singular M, numbers that are not finite.
auto solved_by(auto&& work) {
    const py::gil_scoped_release release;
    try {
        return work();
    } catch (const std::runtime_error& error) {
        throw InputError(error.what());
    }
}

template <class Number>
auto at(const std::vector<Number>& numbers, std::size_t k) {
    return numbers.empty() ? Number{} : numbers[k];
}

// Arrays in C order; those that may be missing are empty.
struct Grains {
    std::vector<double> velocity, spin, inv_mass, inv_inertia, centre, radius;
    std::vector<double> wall_velocity;
};
struct Touches {
    std::vector<int> i, j;  // j < 0: wall -1-j
    std::vector<double> normal, bias, friction, lever_i, lever_j, impulse;
};

template <class M>
ContactProblem<M> make_problem(const Grains& grains, const Touches& touches, double h) {
    using Vec = Eigen::Map<const typename M::Vec>;
    constexpr std::size_t dim = M::dim, spins = M::spins;
    ContactProblem<M> problem;
    problem.h = h;
    for (std::size_t g = 0; g < grains.inv_mass.size(); ++g) {
        Body<M>& body = problem.bodies.emplace_back();
        body.v.template head<M::dim>() = Vec(&grains.velocity[dim * g]);
        body.v.template tail<M::spins>() = Eigen::Map<const typename M::Spin>(&grains.spin[spins * g]);
        body.inv_mass = grains.inv_mass[g];
        body.inv_inertia = grains.inv_inertia[g];
        if (!grains.centre.empty()) problem.centres.emplace_back(Vec(&grains.centre[dim * g]));
    }
    problem.radii = grains.radius;
    if (!grains.radius.empty()) problem.least_radius = *std::ranges::min_element(grains.radius);
    for (std::size_t w = 0; w < grains.wall_velocity.size() / dim; ++w)
        problem.walls.emplace_back().prescribed = Vec(&grains.wall_velocity[dim * w]);
    for (std::size_t c = 0; c < touches.i.size(); ++c) {
        const bool wall = touches.j[c] < 0;
        Contact<M>& contact = (wall ? problem.wall_contacts : problem.contacts).emplace_back();
        contact.i = touches.i[c];
        contact.j = wall ? -1 - touches.j[c] : touches.j[c];
        contact.normal = Vec(&touches.normal[dim * c]);
        contact.bias = touches.bias[c];
        contact.friction_coefficient = touches.friction[c];
        contact.lever_i = touches.lever_i[c];
        contact.lever_j = wall ? 0 : touches.lever_j[c];
        if (!touches.impulse.empty()) contact.r = Vec(&touches.impulse[dim * c]);
    }
    return problem;
}

template <class M>
SolveReport solve_by(const std::string& solver, ContactProblem<M>& problem, const SolveOptions& options) {
    if (solver == "newton") {
        NewtonOptions newton{.tolerance = options.tolerance, .bounds = options.bounds};
        newton.max_iterations = std::min(options.max_iterations, newton.max_iterations);
        return newton_solve<NewtonFactors>(problem, newton);
    }
    if (solver == "spg") return projected_gradient(problem, options, Descent::spectral);
    if (solver == "apgd") return projected_gradient(problem, options, Descent::nesterov);
    if (solver == "nlgs") return nlgs(problem, options);
    throw InputError("solver must be one of 'nlgs' 'newton' 'spg' 'apgd', found '" + solver + "'");
}

template <class M>
py::dict solve(const Grains& grains, const Touches& touches, double h, const std::string& solver,
               const SolveOptions& options) {
    ContactProblem<M> problem = make_problem<M>(grains, touches, h);
    std::vector<double> velocity, spin, impulse(touches.i.size() * M::dim);
    const SolveReport report = solved_by([&] {
        validate(problem);  // indices, before the impulses that it starts from are applied
        if (!touches.impulse.empty()) detail::apply_impulses(problem);
        return solve_by(solver, problem, options);
    });
    for (const auto& body : problem.bodies) {
        velocity.insert(velocity.end(), body.v.data(), body.v.data() + M::dim);
        spin.insert(spin.end(), body.v.data() + M::dim, body.v.data() + M::dim + M::spins);
    }
    std::size_t grain = 0, wall = 0;
    for (std::size_t c = 0; c < touches.i.size(); ++c) {
        const Contact<M>& contact = touches.j[c] < 0 ? problem.wall_contacts[wall++] : problem.contacts[grain++];
        std::copy_n(contact.r.data(), M::dim, impulse.begin() + static_cast<std::ptrdiff_t>(c * M::dim));
    }
    const auto n = static_cast<py::ssize_t>(problem.bodies.size()), m = static_cast<py::ssize_t>(touches.i.size());
    py::dict answer;
    answer["velocities"] = owned(std::move(velocity), {n, M::dim});
    answer["spins"] = M::dim == 3 ? owned(std::move(spin), {n, 3}) : owned(std::move(spin), {n});
    answer["impulses"] = owned(std::move(impulse), {m, M::dim});
    answer["report"] = report;
    return answer;
}

SolveOptions to_options(const py::dict& given, SolveOptions options) {
    py::set known;
    detail::visit_options(options, [&](const detail::OptionInfo& info, auto& value) {
        known.add(info.name);
        if (given.contains(info.name))
            value = to<std::remove_reference_t<decltype(value)>>(info.name, given[info.name]);
    });
    for (const auto& [key, value] : given)
        if (!known.contains(key)) throw InputError("solve: unknown option '" + key.cast<std::string>() + "'");
    detail::check_options(options);
    return options;
}

py::dict solve_grains(int dim, const py::dict& g, const py::dict& c, double h, py::handle solver_name,
                      const py::dict& options) {
    const auto solver = to<std::string>("solver", solver_name);
    const auto doubles = [](const py::dict& from, const char* key) {
        return from[key].is_none() ? std::vector<double>() : list(from[key].cast<Doubles>());
    };
    const Grains grains{doubles(g, "velocity"),     doubles(g, "spin"),   doubles(g, "inv_mass"),
                        doubles(g, "inv_inertia"),  doubles(g, "centre"), doubles(g, "radius"),
                        doubles(g, "wall_velocity")};
    const Touches touches{list(c["i"].cast<Ints>()), list(c["j"].cast<Ints>()), doubles(c, "normal"),
                          doubles(c, "bias"),        doubles(c, "friction"),    doubles(c, "lever_i"),
                          doubles(c, "lever_j"),     doubles(c, "impulse")};
    const SolveOptions chosen = to_options(options, SolveOptions{}.accelerated());
    return dim == 2 ? solve<compiled::Disks>(grains, touches, h, solver, chosen)
                    : solve<compiled::Spheres>(grains, touches, h, solver, chosen);
}

// ---- sparse matrices

using Sparse = Eigen::SparseMatrix<double>;

// By columns, as scipy.sparse.csc_matrix has it.
Sparse to_sparse(const py::dict& csc, Eigen::Index rows, Eigen::Index columns) {
    const auto data = csc["data"].cast<Doubles>();
    const auto indices = csc["indices"].cast<Ints>(), indptr = csc["indptr"].cast<Ints>();
    return Eigen::Map<const Sparse>(rows, columns, static_cast<Eigen::Index>(data.size()), indptr.data(),
                                    indices.data(), data.data());
}

Eigen::VectorXd to_vector(const Doubles& array) {
    return Eigen::Map<const Eigen::VectorXd>(array.data(), array.size());
}

std::vector<double> to_list(const Eigen::VectorXd& vector) { return {vector.data(), vector.data() + vector.size()}; }

py::dict answer_of(const SolvedLocal& solved, const Eigen::VectorXd& v, int size) {
    const auto contacts = static_cast<py::ssize_t>(solved.solution.r.size() / size);
    const ErrorMeasures& e = solved.measures;
    py::dict errors, answer;
    errors["natural_map"] = e.natural_map;
    errors["natural_map_velocity"] = e.natural_map_velocity;
    errors["unilateral"] = e.unilateral;
    errors["eta"] = e.eta;
    errors["cone_excess"] = e.cone_excess;
    errors["complementarity"] = e.complementarity;
    errors["dissipation"] = e.dissipation;
    errors["worst_contact"] = e.worst_contact;
    answer["impulses"] = owned(to_list(solved.solution.r), {contacts, size});
    answer["relative_velocities"] = owned(to_list(solved.solution.u), {contacts, size});
    answer["velocities"] = owned(to_list(v), {static_cast<py::ssize_t>(v.size())});
    answer["errors"] = errors;
    answer["report"] = solved.report;
    answer["cpu"] = solved.cpu;
    return answer;
}

struct Asked {
    std::string solver;
    BlockOptions options;
    Eigen::VectorXd start;
};

Asked asked(py::handle solver_name, py::handle tolerance, py::handle max_iterations, py::handle check_every,
            const Doubles& start) {
    const auto solver = to<std::string>("solver", solver_name);
    const BlockOptions options{to<double>("tolerance", tolerance), to<int>("check_every", check_every),
                               to<int>("max_iterations", max_iterations)};
    std::string told;
    for (const LocalSolverInfo& info : offered_local_solvers()) {
        if (solver == info.name) return {solver, options, to_vector(start)};
        ((told += " '") += info.name) += "'";
    }
    throw InputError("solver must be one of" + told + ", found '" + solver + "'");
}

py::dict solve_matrix(int dim, const py::dict& w, const Doubles& q, const Doubles& friction, const Doubles& rolling,
                      const Asked& how) {
    const LocalProblem problem{dim, to_sparse(w, q.size(), q.size()), to_vector(q), to_vector(friction),
                               to_vector(rolling)};
    const SolvedLocal solved = solved_by([&] { return solve_local(problem, how.solver, how.options, how.start); });
    return answer_of(solved, {}, problem.size());
}

py::dict solve_global(int dim, const py::dict& m, const py::dict& h, const Doubles& f, const Doubles& w,
                      const Doubles& friction, const Doubles& rolling, const Asked& how) {
    const GlobalProblem problem{dim,
                                to_sparse(m, f.size(), f.size()),
                                to_sparse(h, f.size(), w.size()),
                                to_vector(f),
                                to_vector(w),
                                to_vector(friction),
                                to_vector(rolling)};
    Eigen::VectorXd v;
    const SolvedLocal solved = solved_by([&] {
        SolvedLocal found = solve_local(condense(problem), how.solver, how.options, how.start);
        v = body_velocities(problem, found.solution.r);
        return found;
    });
    return answer_of(solved, v, problem.size());
}

py::dict dict_of(const Sparse& matrix) {
    const auto copy = [](const auto* first, Eigen::Index count) { return std::vector(first, first + count); };
    const auto stored = matrix.nonZeros();
    py::dict csc;
    csc["data"] = owned(copy(matrix.valuePtr(), stored), {stored});
    csc["indices"] = owned(copy(matrix.innerIndexPtr(), stored), {stored});
    csc["indptr"] = owned(copy(matrix.outerIndexPtr(), matrix.cols() + 1), {matrix.cols() + 1});
    csc["shape"] = py::make_tuple(matrix.rows(), matrix.cols());
    return csc;
}

py::dict read_problem(const std::string& path) {
    const auto problem = read_fclib(path);
    const auto vector = [](const Eigen::VectorXd& v) { return owned(to_list(v), {v.size()}); };
    py::dict out;
    if (const auto* local = std::get_if<LocalProblem>(&problem)) {
        out["dimension"] = local->dim;
        out["W"] = dict_of(local->w);
        out["q"] = vector(local->q);
        out["mu"] = vector(local->friction);
        if (local->rolls()) out["mu_r"] = vector(local->rolling);
        return out;
    }
    const auto& global = std::get<GlobalProblem>(problem);
    out["dimension"] = global.dim;
    out["M"] = dict_of(global.m);
    out["H"] = dict_of(global.h);
    out["f"] = vector(global.f);
    out["w"] = vector(global.w);
    out["mu"] = vector(global.friction);
    if (global.rolls()) out["mu_r"] = vector(global.rolling);
    return out;
}

}  // namespace

void add_solve(py::module_& module) {
    py::class_<Asked>(module, "Asked").def(py::init(&asked));
    module.def("solve_grains", &solve_grains);
    module.def("solve_matrix", &solve_matrix);
    module.def("solve_global", &solve_global);
    module.def("read_problem", &read_problem);
}

}  // namespace nscdd::python
