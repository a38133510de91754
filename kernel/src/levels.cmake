# Libraries that the loader picks. The C library (2.33 and later) looks below each folder of libraries in glibc-hwcaps/x86-64-v4,
# then -v3 and -v2, and takes the first that the processor can run: man 8 ld.so. Nothing of ours chooses.
#
# This build makes the libraries of the least set of NSCDD_LEVELS, and configures and builds itself once more for each other.
# The names in them are the same (core/abi.hpp: NSCDD_ABI), and so is the layout of what passes between them and a program:
# packets are of no type that is stored. -Bsymbolic: a library calls its own inline functions, not those of a lesser program.
set(NSCDD_LIBRARY STATIC)
set(NSCDD_LIBRARY_DIR ${PROJECT_BINARY_DIR}/lib CACHE PATH "Where libraries are built")
mark_as_advanced(NSCDD_LIBRARY_DIR)

# nscdd_library(TARGET NAME): a library of the kind and the place that NSCDD_LEVELS asks for.
function(nscdd_library target name)
    if(NOT NSCDD_LEVELS)
        return()
    endif()
    set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name} LIBRARY_OUTPUT_DIRECTORY ${NSCDD_LIBRARY_DIR} DEFINE_SYMBOL ""
                          SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
    target_link_options(${target} PRIVATE -Wl,-Bsymbolic -Wl,--no-undefined)
    if(TARGET nscdd_levels)
        add_dependencies(${target} nscdd_levels)
    endif()
    set_property(GLOBAL APPEND PROPERTY NSCDD_LIBRARIES ${target})
endfunction()

if(NOT NSCDD_LEVELS OR NOT NSCDD_COMPILED)
    return()
endif()
set(NSCDD_LIBRARY SHARED)
list(GET NSCDD_LEVELS 0 least)
set(others ${NSCDD_LEVELS})
list(POP_FRONT others)
target_compile_options(nscdd_flags INTERFACE -march=${least} -fPIC -fno-semantic-interposition $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
target_compile_definitions(nscdd_flags INTERFACE NSCDD_ABI=by_level)

if(others)
    include(ExternalProject)
    add_custom_target(nscdd_levels)
    if(CMAKE_BUILD_TYPE STREQUAL "Release")  # they are installed as they lie there
        set(strip -s)
    endif()
    foreach(level IN LISTS others)
        # one after the other: each uses all cores
        ExternalProject_Add(nscdd_${level} SOURCE_DIR ${PROJECT_SOURCE_DIR} BINARY_DIR ${PROJECT_BINARY_DIR}/${level}
            PREFIX ${PROJECT_BINARY_DIR}/${level}/prefix DEPENDS ${previous} BUILD_ALWAYS ON INSTALL_COMMAND "" USES_TERMINAL_BUILD ON
            CMAKE_ARGS -DNSCDD_LEVELS=${level} -DNSCDD_LIBRARY_DIR=${NSCDD_LIBRARY_DIR}/glibc-hwcaps/${level}
                       -DNSCDD_HARNESS=${NSCDD_HARNESS} -DNSCDD_PROGRAM=${NSCDD_PROGRAM} -DNSCDD_COMPILED=ON -DNSCDD_PYTHON=OFF -DNSCDD_TESTS=OFF
                       -DNSCDD_WERROR=${NSCDD_WERROR} -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE} -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
                       -DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS} -DCMAKE_SHARED_LINKER_FLAGS=${strip} -DCMAKE_SKIP_RPATH=ON
            BUILD_COMMAND ${CMAKE_COMMAND} --build <BINARY_DIR> --target nscdd_libraries)
        add_dependencies(nscdd_levels nscdd_${level})
        set(previous nscdd_${level})
    endforeach()
endif()
