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
