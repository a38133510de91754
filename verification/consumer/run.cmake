# cmake -DREPOSITORY=... -DWORK=... -DCXX=... -DGENERATOR=... -P run.cmake
#
# Installs the kernel without harness and tests, and builds and runs the consumer against what was installed. The
# consumer must get include paths and the standard from it, nothing else, and nothing of MPI.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/call.cmake)
call(text ${CMAKE_COMMAND} -S ${REPOSITORY} -B ${WORK}/kernel -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${CXX}
    -DNSCDD_HARNESS=OFF -DNSCDD_TESTS=OFF -DCMAKE_INSTALL_PREFIX=${WORK}/installed)
call(text ${CMAKE_COMMAND} --install ${WORK}/kernel)
call(text ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/consumer -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${CXX}
    -DCMAKE_BUILD_TYPE= -DCMAKE_PREFIX_PATH=${WORK}/installed -DCMAKE_EXPORT_COMPILE_COMMANDS=ON)
call(text ${CMAKE_COMMAND} --build ${WORK}/consumer)
call(answers ${WORK}/consumer/consumer)
message("${answers}")

# How main.cpp was compiled: compiler, include paths, standard, input, output.
file(READ ${WORK}/consumer/compile_commands.json commands)
string(JSON command GET "${commands}" 0 command)
separate_arguments(flags UNIX_COMMAND "${command}")
list(POP_FRONT flags)
list(FILTER flags EXCLUDE REGEX "^-std=(gnu|c)\\+\\+20$|^-I|^-isystem$|^/|^-o$|\\.o$|^-c$")
if(flags)
    message(FATAL_ERROR "nscdd::kernel forces on its consumers: ${flags}")
endif()
if(NOT command MATCHES "${WORK}/installed/include" OR command MATCHES "${REPOSITORY}/kernel")
    message(FATAL_ERROR "the consumer is not compiled against the installed kernel: ${command}")
endif()

string(REGEX REPLACE " -o [^ ]+ -c " " -M " command "${command}")
separate_arguments(arguments UNIX_COMMAND "${command}")
call(depends ${arguments})
if(NOT depends MATCHES "nscdd/step/simulation\\.hpp" OR depends MATCHES "mpi\\.h")
    message(FATAL_ERROR "the umbrella includes MPI, or not the kernel:\n${depends}")
endif()

call(libraries ldd ${WORK}/consumer/consumer)
if(NOT libraries MATCHES "libstdc\\+\\+|libc\\+\\+" OR libraries MATCHES "libmpi")
    message(FATAL_ERROR "the consumer links MPI:\n${libraries}")
endif()
