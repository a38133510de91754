# cmake -DINCLUDE=kernel/include -P optional_libraries.cmake
#
# Only comm/mpi.hpp and its part comm/mpi_node.hpp include mpi.h, only partition/metis.hpp metis.h, and no header
# includes these: who does not ask for a library does not need it.
cmake_minimum_required(VERSION 3.25)
file(GLOB_RECURSE headers RELATIVE ${INCLUDE} ${INCLUDE}/nscdd/*.hpp)
set(mpi_headers nscdd/comm/mpi.hpp nscdd/comm/mpi_node.hpp)
set(metis_headers nscdd/partition/metis.hpp)
foreach(library mpi metis)
    set(found)
    foreach(header IN LISTS headers)
        file(STRINGS ${INCLUDE}/${header} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"](${library}\\.h|(.*/)?${library}(_node)?\\.hpp)[>\"]")
        if(lines)
            list(APPEND found ${header})
        endif()
    endforeach()
    list(SORT found)
    if(NOT found STREQUAL "${${library}_headers}")
        message(SEND_ERROR "${library}.h is included, perhaps by way of ${${library}_headers}, by: ${found}")
    endif()
endforeach()
