// What the sources of the extension share.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <vector>

#include "files/error.hpp"

namespace nscdd::python {

namespace py = pybind11;

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Ints = py::array_t<int, py::array::c_style | py::array::forcecast>;

// An array that owns the numbers of a vector, of the shape given; read-only.
template <class Number>
py::array owned(std::vector<Number> numbers, std::vector<py::ssize_t> shape) {
    auto* kept = new std::vector<Number>(std::move(numbers));
    const py::capsule owner(kept, [](void* memory) { delete static_cast<std::vector<Number>*>(memory); });
    py::array array(py::dtype::of<Number>(), std::move(shape), kept->data(), owner);
    array.attr("setflags")(py::arg("write") = false);
    return array;
}

template <class Number, int flags>
std::vector<Number> list(const py::array_t<Number, flags>& array) {
    return std::vector<Number>(array.data(), array.data() + array.size());
}

// convert(), which makes something of a value of Python; InputError, which names it, where it is of another kind.
auto converted(const std::string& name, py::handle value, auto&& convert) {
    try {
        return convert();
    } catch (const py::cast_error&) {
    } catch (const py::error_already_set& error) {
        if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
    }
    throw InputError(py::str("{} cannot be {:.60}").format(name, py::repr(value)).cast<std::string>());
}

template <class Value>
Value to(const std::string& name, py::handle value) {
    return converted(name, value, [&] { return value.cast<Value>(); });
}

void add_files(py::module_& module);
void add_simulation(py::module_& module);
void add_solve(py::module_& module);

}  // namespace nscdd::python
