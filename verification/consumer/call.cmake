# call(OUTPUT COMMAND...): runs the command in WORK, sets OUTPUT to what it prints, stops with that where it fails.
function(call output)
    execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE text)
    if(NOT result EQUAL 0)
        string(JOIN " " command ${ARGN})
        message(FATAL_ERROR "${command}\n${text}")
    endif()
    set(${output} "${text}" PARENT_SCOPE)
endfunction()
