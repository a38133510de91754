# cmake -DINCLUDE=kernel/include -P optional_libraries.cmake
#
# Only comm/mpi.hpp includes mpi.h, only partition/metis.hpp metis.h, and no other header includes these two: who does not ask
# for a library does not need it.
cmake_minimum_required(VERSION 3.25)
file(GLOB_RECURSE headers RELATIVE ${INCLUDE} ${INCLUDE}/nscdd/*.hpp)
foreach(only comm/mpi.hpp partition/metis.hpp)
    get_filename_component(library ${only} NAME_WE)
    set(found)
    foreach(header IN LISTS headers)
        file(STRINGS ${INCLUDE}/${header} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"](${library}\\.h|(.*/)?${library}\\.hpp)[>\"]")
        if(lines)
            list(APPEND found ${header})
        endif()
    endforeach()
    if(NOT found STREQUAL "nscdd/${only}")
        message(SEND_ERROR "${library}.h is included, perhaps by way of ${only}, by: ${found}")
    endif()
endforeach()
