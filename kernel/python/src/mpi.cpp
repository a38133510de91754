// The extension nscdd._mpi: a communicator of mpi4py as one of the kernel. An extension of its own, lest every user of
// the module loads MPI.
#include <pybind11/pybind11.h>

#include <memory>

#include "nscdd/comm/mpi.hpp"

namespace py = pybind11;

// (capsule of a communicator, number of this process, that of all). `handle`: of Fortran, as mpi4py's Comm.py2f() gives
// it. Collective.
static py::tuple make(int handle, int subdomains, int threads) {
    const MPI_Comm comm = MPI_Comm_f2c(handle);
    int rank = 0, size = 1;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &size);
    using Held = std::unique_ptr<nscdd::Communicator>;
    auto held = std::make_unique<Held>(
        std::make_unique<nscdd::Mpi>(comm, nscdd::Meter::Charged{}, subdomains, nscdd::WithinNode::memory, threads));
    const py::capsule capsule(held.release(), [](void* memory) { delete static_cast<Held*>(memory); });
    return py::make_tuple(capsule, rank, size);
}

PYBIND11_MODULE(_mpi, module) {
    module.doc() = "Communicators of mpi4py for nscdd.";
    module.def("make", &make);
}
