// A communicator of our own, and MPI's errors as exceptions. For mpi.hpp.
#pragma once

#include <mpi.h>

#include <stdexcept>
#include <string>

#include "nscdd/core/abi.hpp"

namespace nscdd::inline NSCDD_ABI {

namespace detail {

inline void check_mpi(int code, const char* call) {
    if (code == MPI_SUCCESS) return;
    char text[MPI_MAX_ERROR_STRING];
    int length = 0;
    MPI_Error_string(code, text, &length);
    throw std::runtime_error(std::string(call) + ": " + std::string(text, static_cast<std::size_t>(length)));
}

// A duplicate of the caller's communicator, so that our messages never meet the caller's.
struct MpiDuplicate {
    MPI_Comm handle = MPI_COMM_NULL;

    explicit MpiDuplicate(MPI_Comm comm) {
        int initialised = 0;
        MPI_Initialized(&initialised);
        if (!initialised) throw std::logic_error("Mpi: MPI is not initialised");
        check_mpi(MPI_Comm_dup(comm, &handle), "MPI_Comm_dup");
        check_mpi(MPI_Comm_set_errhandler(handle, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
    }
    // Of this process, or of all: what MPI_Comm_rank or MPI_Comm_size says.
    int place(int (*ask)(MPI_Comm, int*)) const {
        int number = 0;
        check_mpi(ask(handle, &number), "MPI_Comm_rank or MPI_Comm_size");
        return number;
    }
    MpiDuplicate(const MpiDuplicate&) = delete;
    MpiDuplicate& operator=(const MpiDuplicate&) = delete;
    ~MpiDuplicate() {
        int finalised = 0;
        MPI_Finalized(&finalised);
        if (!finalised) MPI_Comm_free(&handle);
    }
};

}  // namespace detail

}  // namespace nscdd
