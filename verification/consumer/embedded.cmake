# cmake -DREPOSITORY=... -DINSTALLED=... -DWORK=... -DCXX=... -DGENERATOR=... -P embedded.cmake
#
# The kernel within another project: by add_subdirectory and by FetchContent, two sources compiled as one (UNITY_BUILD), and
# by pkg-config. Nothing of our harness is configured. INSTALLED: where consumer/run.cmake has installed the headers.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/call.cmake)
set(body "#include <nscdd/core/contact_problem.hpp>
using M = nscdd::Model<2, nscdd::Frictionless>;
")
file(WRITE ${WORK}/one.cpp "${body}int contacts() { return static_cast<int>(nscdd::ContactProblem<M>{}.contacts.size()); }\n")
file(WRITE ${WORK}/two.cpp "#include <nscdd/core/contact_problem.hpp>\nint contacts();\nint main() { return contacts(); }\n")

foreach(way subdirectory fetched)
    set(how "add_subdirectory(${REPOSITORY} nscdd)")
    if(way STREQUAL fetched)
        set(how "include(FetchContent)\nFetchContent_Declare(nscdd SOURCE_DIR ${REPOSITORY})\nFetchContent_MakeAvailable(nscdd)")
    endif()
    file(WRITE ${WORK}/${way}/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(embedding LANGUAGES CXX)
${how}
if(TARGET nscdd OR TARGET nscdd_files OR CMAKE_CXX_FLAGS)
    message(FATAL_ERROR \"the harness, or flags of its own, within another project\")
endif()
add_executable(embedding ${WORK}/one.cpp ${WORK}/two.cpp)
set_target_properties(embedding PROPERTIES UNITY_BUILD ON)
target_link_libraries(embedding PRIVATE nscdd::kernel)
")
    call(text ${CMAKE_COMMAND} -S ${WORK}/${way} -B ${WORK}/${way}/build -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${CXX})
    call(text ${CMAKE_COMMAND} --build ${WORK}/${way}/build)
    call(text ${WORK}/${way}/build/embedding)
endforeach()

pkg_config(flags nscdd)
if(flags)
    call(text ${CXX} -std=c++20 ${WORK}/one.cpp ${WORK}/two.cpp ${flags} -o ${WORK}/packaged)
    call(text ${WORK}/packaged)
endif()
