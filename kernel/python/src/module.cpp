// The extension nscdd._core: reports, exceptions, and what the other sources add.
#include "module.hpp"

#include <cctype>

#include "files/error.hpp"
#include "model/live.hpp"

namespace nscdd::python { namespace {

void add_reports(py::module_& module) {
    py::class_<StepReport::Energy>(module, "StepEnergy", "Energy balance of a step; works are of the step [J].")
        .def_readonly("before", &StepReport::Energy::before,
                      "Kinetic energy of grains and driven walls before the step [J].")
        .def_readonly("kinetic", &StepReport::Energy::kinetic,
                      "Kinetic energy of grains and driven walls after the step [J].")
        .def_readonly("external", &StepReport::Energy::external, "Work of gravity and of the grains' loads [J].")
        .def_readonly("walls", &StepReport::Energy::walls, "Work of the walls, and of a cell that flows [J].")
        .def_readonly("normal", &StepReport::Energy::normal, "Work of the contacts along their normals [J].")
        .def_readonly("friction", &StepReport::Energy::friction, "Work of the contacts along their tangents [J].")
        .def_property_readonly("round_off", &StepReport::Energy::round_off, "What is left of the balance [J].");

    py::class_<SolveReport>(module, "SolveReport", "End of the solution of one contact problem.")
        .def_readonly("converged", &SolveReport::converged, "Whether every bound that was asked for is kept.")
        .def_readonly("iterations", &SolveReport::iterations, "Iterations made.")
        .def_readonly("eta", &SolveReport::residual, "The figure on which `tolerance` is set [1].")
        .def_readonly("velocity_error", &SolveReport::velocity_error, "Error of the velocities at contacts [1].")
        .def_readonly("energy_gain", &SolveReport::energy_gain, "Share of energy that contacts make [1].")
        .def_readonly("penetration", &SolveReport::penetration, "The step would close a contact so deep [m].")
        .def_readonly("gap_error", &SolveReport::gap_error, "The step is exact for gaps that differ by this [1].")
        .def_readonly("distance", &SolveReport::distance, "Estimated distance of the velocities from an answer [1].")
        .def_readonly("newton_contacts", &SolveReport::newton_contacts, "Contacts that Newton's method solved.");

    py::class_<StepReport>(module, "StepReport", "What a step has come to.")
        .def_property_readonly(
            "converged", [](const StepReport& r) { return r.solve.converged; },
            "Whether every bound that was asked for is kept.")
        .def_property_readonly(
            "iterations", [](const StepReport& r) { return r.solve.iterations; },
            "Iterations of the solver, of all attempts.")
        .def_property_readonly(
            "eta", [](const StepReport& r) { return r.solve.residual; },
            "The figure on which `tolerance` is set, at the end of the step [1].")
        .def_property_readonly(
            "contacts", [](const StepReport& r) { return static_cast<std::int64_t>(r.contacts); },
            "Contacts in the whole scene, open ones included.")
        .def_property_readonly(
            "interface_grains", [](const StepReport& r) { return static_cast<std::int64_t>(r.interface_grains); },
            "Grains with contacts in several subdomains.")
        .def_readonly("attempts", &StepReport::attempts,
                      "More than 1 where the answer changed which pairs are contacts.")
        .def_readonly("solve", &StepReport::solve, "All figures of the solver, a SolveReport.")
        .def_readonly("energy", &StepReport::energy, "The energy balance, a StepEnergy.")
        .def("__repr__", [](const StepReport& r) {
            return py::str("StepReport(converged={}, iterations={}, eta={:.3g}, contacts={})")
                .format(r.solve.converged, r.solve.iterations, r.solve.residual, static_cast<std::int64_t>(r.contacts));
        });
}

// Options that are named as on the command line get their names of Python: --max-gap-error is max_gap_error.
std::string without_dashes(const std::string& told) {
    std::string text;
    for (std::size_t k = 0; k < told.size(); ++k) {
        const bool starts = told.compare(k, 2, "--") == 0 && k + 2 < told.size() && std::islower(told[k + 2]) &&
                            (k == 0 || told[k - 1] == ' ');
        if (!starts) {
            text += told[k];
            continue;
        }
        for (k += 2; k < told.size() && (std::islower(told[k]) || told[k] == '-'); ++k)
            text += told[k] == '-' ? '_' : told[k];
        --k;
    }
    return text;
}

void add_exceptions(py::module_& module) {
    static PyObject* const refused =
        py::exception<RefusedStep>(module, "StepRefused", PyExc_RuntimeError).release().ptr();
    py::handle(refused).attr("__doc__") =
        "A step that cannot be made. Attributes: step, its number; i and j, ids of the worst pair (j < 0: wall -1 - j, "
        "both "
        "-1 where the reason is no pair); h, a time step that would do [s], 0 where none is known.";
    py::handle(refused).attr("__module__") = "nscdd";
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const RefusedStep& error) {
            const py::object raised = py::handle(refused)(py::str(error.what()));
            raised.attr("step") = error.refusal.step;
            raised.attr("i") = error.refusal.i;
            raised.attr("j") = error.refusal.j;
            raised.attr("h") = error.refusal.h;
            PyErr_SetObject(refused, raised.ptr());
        } catch (const InputError& error) {
            PyErr_SetString(PyExc_ValueError, without_dashes(error.what()).c_str());
        } catch (const OutputError& error) {
            PyErr_SetString(PyExc_OSError, error.what());
        } catch (const std::invalid_argument& error) {  // what fails on a process is thrown as such by all of them
            const std::string told = error.what();
            const bool disk = told.find(": cannot write: ") != told.npos || told.find(": cannot make ") != told.npos;
            PyErr_SetString(disk ? PyExc_OSError : PyExc_ValueError, error.what());
        } catch (const std::logic_error& error) {
            PyErr_SetString(PyExc_RuntimeError, error.what());
        }
    });
}

}}  // namespace nscdd::python

PYBIND11_MODULE(_core, module) {
    module.doc() = "The compiled part of nscdd.";
    module.attr("__version__") = NSCDD_VERSION;
    nscdd::python::add_exceptions(module);
    nscdd::python::add_reports(module);
    nscdd::python::add_files(module);
    nscdd::python::add_simulation(module);
    nscdd::python::add_solve(module);
}
