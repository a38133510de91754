# cmake -DINCLUDE=kernel/include -DCXX=... -DWORK=... "-DSYSTEM=dir;..." -P headers.cmake
#
# Every header of the kernel compiles alone, may be included twice, and is in the namespace of the instruction set. SYSTEM:
# directories of Eigen and MPI. Eigen/Core, four fifths of what there is to parse, is parsed once for all of them.
cmake_minimum_required(VERSION 3.25)
set(flags -std=c++20 -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror -I${INCLUDE})
foreach(directory IN LISTS SYSTEM)
    list(APPEND flags -isystem ${directory})
endforeach()
file(GLOB_RECURSE headers RELATIVE ${INCLUDE} ${INCLUDE}/nscdd/*.hpp)
list(LENGTH headers count)
if(count LESS 20)
    message(FATAL_ERROR "only ${count} headers found below ${INCLUDE}")
endif()
file(MAKE_DIRECTORY ${WORK})
file(WRITE ${WORK}/eigen.hpp "#include <Eigen/Core>\n")
execute_process(COMMAND ${CXX} ${flags} -x c++-header ${WORK}/eigen.hpp -o ${WORK}/eigen.hpp.gch COMMAND_ERROR_IS_FATAL ANY)
foreach(header IN LISTS headers)
    file(STRINGS ${INCLUDE}/${header} opened REGEX "^namespace nscdd")
    if(opened AND NOT opened MATCHES "^namespace nscdd { inline namespace NSCDD_ABI {( namespace (detail|plain) {)?$")
        message(SEND_ERROR "${header} opens another namespace than nscdd's inline NSCDD_ABI: ${opened}")
    endif()
    file(WRITE ${WORK}/alone.cpp "#include \"${header}\"\n#include \"${header}\"\n")
    execute_process(COMMAND ${CXX} ${flags} -Winvalid-pch -include ${WORK}/eigen.hpp -fsyntax-only ${WORK}/alone.cpp
                    RESULT_VARIABLE result ERROR_VARIABLE text)
    if(NOT result EQUAL 0)
        message(SEND_ERROR "${header} does not compile alone:\n${text}")
    endif()
endforeach()
