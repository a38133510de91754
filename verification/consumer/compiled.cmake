# cmake -DBUILD=... -DWORK=... -DCXX=... -DNM=... -P compiled.cmake
#
# Installs nscdd::compiled from a build of ours, and builds and runs an example against it, which must not compile the
# kernel once more.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/call.cmake)
call(text ${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/installed)
with_compiled_kernel(program)
file(WRITE ${WORK}/compiled.cpp "${program}")
file(WRITE ${WORK}/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(compiled LANGUAGES CXX)
find_package(nscdd REQUIRED)
add_executable(compiled compiled.cpp)
target_link_libraries(compiled PRIVATE nscdd::compiled)
")
call(text ${CMAKE_COMMAND} -S ${WORK} -B ${WORK}/build -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_BUILD_TYPE=Release
    -DCMAKE_PREFIX_PATH=${WORK}/installed)
call(text ${CMAKE_COMMAND} --build ${WORK}/build)
call(answer ${WORK}/build/compiled)
if(NOT answer MATCHES "step 1000: 10 contacts, +[0-9]+ iterations, energy 0 J")
    message(FATAL_ERROR "the balls do not rest:\n${answer}")
endif()
file(GLOB_RECURSE object ${WORK}/build/compiled.cpp.o)
call(symbols ${NM} -C --undefined-only ${object})
if(NOT symbols MATCHES "Simulation<.*>::Simulation" OR NOT symbols MATCHES "by_nscdd<")
    message(FATAL_ERROR "the program compiles the kernel itself; it lacks:\n${symbols}")
endif()
