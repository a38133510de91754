# cmake -DINCLUDE=kernel/include -P mpi_only_there.cmake
#
# comm/mpi.hpp is the only header of the kernel that includes mpi.h, and no other header includes it.
cmake_minimum_required(VERSION 3.25)
file(GLOB_RECURSE headers RELATIVE ${INCLUDE} ${INCLUDE}/nscdd/*.hpp)
set(with_mpi)
foreach(header IN LISTS headers)
    file(STRINGS ${INCLUDE}/${header} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"](mpi\\.h|.*comm/mpi\\.hpp|mpi\\.hpp)[>\"]")
    if(lines)
        list(APPEND with_mpi ${header})
    endif()
endforeach()
if(NOT with_mpi STREQUAL "nscdd/comm/mpi.hpp")
    message(FATAL_ERROR "MPI is included by: ${with_mpi}")
endif()
