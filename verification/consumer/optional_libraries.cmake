# cmake -DINCLUDE=kernel/include -P optional_libraries.cmake
#
# Only comm/mpi.hpp and its part comm/mpi_duplicate.hpp include mpi.h, only partition/metis.hpp metis.h, and no other header
# includes these: who does not ask for a library does not need it.
cmake_minimum_required(VERSION 3.25)
file(GLOB_RECURSE headers RELATIVE ${INCLUDE} ${INCLUDE}/nscdd/*.hpp)
foreach(only comm/mpi partition/metis)
    get_filename_component(library ${only} NAME)
    set(found)
    foreach(header IN LISTS headers)
        file(STRINGS ${INCLUDE}/${header} lines
             REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"](${library}\\.h|(.*/)?${library}(_[a-z]+)?\\.hpp)[>\"]")
        if(lines)
            list(APPEND found ${header})
        endif()
    endforeach()
    if(NOT nscdd/${only}.hpp IN_LIST found)
        message(SEND_ERROR "${library}.h is not included by ${only}.hpp")
    endif()
    list(FILTER found EXCLUDE REGEX "^nscdd/${only}(_[a-z]+)?\\.hpp$")
    if(found)
        message(SEND_ERROR "${library}.h is included, perhaps by way of ${only}.hpp, by: ${found}")
    endif()
endforeach()
