# WORK is empty, and compilers get no flags of the environment.
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
set(ENV{CXXFLAGS})
set(ENV{LDFLAGS})

# call(OUTPUT COMMAND...): runs the command in WORK, sets OUTPUT to what it prints, stops with that where it fails.
function(call output)
    execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE text)
    if(NOT result EQUAL 0)
        string(JOIN " " command ${ARGN})
        message(FATAL_ERROR "${command}\n${text}")
    endif()
    set(${output} "${text}" PARENT_SCOPE)
endfunction()

# with_compiled_kernel(OUTPUT): an example of ours, by nscdd::compiled.
function(with_compiled_kernel output)
    file(READ ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../../kernel/examples/ten_balls.cpp program)
    string(REPLACE "nscdd/nscdd.hpp" "nscdd/compiled.hpp" program "${program}")
    string(REPLACE "nscdd::Model<3, nscdd::Coulomb>" "nscdd::compiled::Spheres" program "${program}")
    if(NOT program MATCHES "nscdd/compiled.hpp.*nscdd::compiled::Spheres")
        message(FATAL_ERROR "ten_balls.cpp has not what is replaced in it")
    endif()
    set(${output} "${program}" PARENT_SCOPE)
endfunction()
