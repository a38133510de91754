# cmake -DBUILD=... -DWORK=... -DCXX=... -DNM=... -P compiled.cmake
#
# Installs nscdd::compiled from a build of ours, and builds and runs a program against it, which must not compile the
# kernel once more.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/call.cmake)
set(ENV{CXXFLAGS})
set(ENV{LDFLAGS})

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
call(text ${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/installed)
file(WRITE ${WORK}/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(compiled LANGUAGES CXX)
find_package(nscdd REQUIRED)
add_executable(compiled ${CMAKE_CURRENT_LIST_DIR}/compiled.cpp)
target_link_libraries(compiled PRIVATE nscdd::compiled)
")
call(text ${CMAKE_COMMAND} -S ${WORK} -B ${WORK}/build -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_BUILD_TYPE=Release
    -DCMAKE_PREFIX_PATH=${WORK}/installed)
call(text ${CMAKE_COMMAND} --build ${WORK}/build)
call(answer ${WORK}/build/compiled)
message("${answer}")
file(GLOB_RECURSE object ${WORK}/build/compiled.cpp.o)
call(symbols ${NM} -C --undefined-only ${object})
if(NOT symbols MATCHES "Simulation<.*>::Simulation" OR NOT symbols MATCHES "by_nscdd<")
    message(FATAL_ERROR "the program compiles the kernel itself; it lacks:\n${symbols}")
endif()
