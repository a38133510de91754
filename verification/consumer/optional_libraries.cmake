# cmake -DINCLUDE=kernel/include -P optional_libraries.cmake
#
# Only comm/mpi.hpp and its parts comm/mpi_*.hpp include mpi.h, only partition/metis.hpp metis.h, and no header
# includes these: who does not ask for a library does not need it.
cmake_minimum_required(VERSION 3.25)
file(GLOB_RECURSE headers RELATIVE ${INCLUDE} ${INCLUDE}/nscdd/*.hpp)
file(GLOB mpi_headers RELATIVE ${INCLUDE} ${INCLUDE}/nscdd/comm/mpi.hpp ${INCLUDE}/nscdd/comm/mpi_*.hpp)
list(SORT mpi_headers)
set(metis_headers nscdd/partition/metis.hpp)
foreach(library mpi metis)
    set(found)
    foreach(header IN LISTS headers)
        file(STRINGS ${INCLUDE}/${header} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"](${library}\\.h|(.*/)?${library}(_[a-z]+)?\\.hpp)[>\"]")
        if(lines)
            list(APPEND found ${header})
        endif()
    endforeach()
    list(SORT found)
    if(NOT found STREQUAL "${${library}_headers}")
        message(SEND_ERROR "${library}.h is included, perhaps by way of ${${library}_headers}, by: ${found}")
    endif()
endforeach()
