nscdd_test(test_communicator quick unit/test_communicator.cpp)
nscdd_test(test_law quick unit/test_contact_law.cpp unit/test_delassus.cpp)
nscdd_test(test_sweeper quick unit/test_sweeper.cpp)
nscdd_test(test_sweeper_unvectorised quick unit/test_sweeper.cpp)  # where Eigen knows no packets, or is told to use none
target_compile_definitions(test_sweeper_unvectorised PRIVATE EIGEN_DONT_VECTORIZE)
nscdd_test(test_anderson quick unit/test_anderson.cpp)
nscdd_test(test_local_form quick unit/test_local_form.cpp)
nscdd_test(test_partition quick unit/test_partition.cpp)
nscdd_test(test_gluing quick unit/test_gluing.cpp)
nscdd_test(test_detection quick unit/test_detection.cpp unit/test_stepping.cpp)
nscdd_test(test_misuse quick unit/test_misuse.cpp)
nscdd_test(test_conservation quick unit/test_conservation.cpp)
nscdd_test(test_analytic quick unit/test_analytic.cpp)
nscdd_test(test_newton quick unit/test_newton.cpp)
nscdd_test(test_invariance quick unit/test_invariance.cpp)
nscdd_test(test_gradient quick unit/test_gradient.cpp)
nscdd_test(test_single_precision quick unit/test_single_precision.cpp)
nscdd_test(test_schemes quick agreement/test_schemes.cpp)
nscdd_test(test_reference quick agreement/test_reference.cpp)

foreach(test test_detection test_gluing test_partition test_sweeper test_sweeper_unvectorised)
    target_compile_options(${test} PRIVATE -O0)  # they compile for a minute and run for a moment
endforeach()

if(TARGET nscdd_files)
    nscdd_test(test_files quick unit/test_scene.cpp unit/test_packing.cpp unit/test_fclib.cpp)
    target_link_libraries(test_files PRIVATE nscdd_files)
endif()

if(MPI_CXX_FOUND)
    nscdd_mpi_test(test_communicator_mpi "1;2;3;4" mpi/test_communicator_mpi.cpp)
    nscdd_mpi_test(test_mpi_bitwise "1;2;4" mpi/test_mpi_bitwise.cpp)
    # Catch2's runner apart from our flags: with sanitizers GCC takes some of std::regex in it for uninitialised
    add_library(mpi_main OBJECT mpi/mpi_main.cpp)
    target_link_libraries(mpi_main PUBLIC Catch2::Catch2 MPI::MPI_CXX)
    target_link_libraries(test_communicator_mpi PRIVATE mpi_main)
    target_link_libraries(test_mpi_bitwise PRIVATE mpi_main)
endif()

get_target_property(eigen_include Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
add_test(NAME consumer COMMAND ${CMAKE_COMMAND} -DREPOSITORY=${PROJECT_SOURCE_DIR} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/consumer
         -DCXX=${CMAKE_CXX_COMPILER} -DGENERATOR=${CMAKE_GENERATOR} -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/run.cmake)
add_test(NAME "consumer with options of its own" COMMAND ${CMAKE_COMMAND} -DINCLUDE=${PROJECT_SOURCE_DIR}/kernel/include
         -DCXX=${CMAKE_CXX_COMPILER} -DNM=${CMAKE_NM} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/foreign -DSYSTEM=${eigen_include}
         -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/foreign.cmake)
add_test(NAME "headers compile alone" COMMAND ${CMAKE_COMMAND} -DINCLUDE=${PROJECT_SOURCE_DIR}/kernel/include
         -DCXX=${CMAKE_CXX_COMPILER} -DWORK=${CMAKE_CURRENT_BINARY_DIR} "-DSYSTEM=${eigen_include};${MPI_CXX_INCLUDE_DIRS}"
         -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/headers.cmake)
add_test(NAME "only one header knows MPI" COMMAND ${CMAKE_COMMAND} -DINCLUDE=${PROJECT_SOURCE_DIR}/kernel/include
         -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/mpi_only_there.cmake)
set_tests_properties(consumer "consumer with options of its own" "headers compile alone" "only one header knows MPI" PROPERTIES LABELS build TIMEOUT 600)

if(NSCDD_PROGRAM)
    find_program(NSCDD_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)  # Debian's, which has h5py
    function(nscdd_program_test name label module)
        add_test(NAME "program: ${name}" COMMAND ${NSCDD_PYTHON} -m unittest ${module}
                 WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/program)
        set_tests_properties("program: ${name}" PROPERTIES LABELS "${label}" TIMEOUT 900
            ENVIRONMENT "${mpi_environment};NSCDD=$<TARGET_FILE:nscdd>;NSCDD_MPIRUN=${MPIEXEC_EXECUTABLE};PYTHONDONTWRITEBYTECODE=1")
    endfunction()
    nscdd_program_test("bad input" "program;sanitized" test_bad_input)
    nscdd_program_test("outputs" "program;sanitized" test_outputs)
    nscdd_program_test("what compare trusts" "program;sanitized" test_compare)
    nscdd_program_test("pack, run, compare" program test_program.Program)
    nscdd_program_test("go on from a state" program test_restart)
    nscdd_program_test("hard cases" program test_hard_cases)
    nscdd_program_test("speed against error" program test_accuracy)
    nscdd_program_test("what acceleration saves" program test_acceleration)
    nscdd_program_test("exchange of contact problems" program test_fclib)
    nscdd_program_test("iterations at 8 subdomains" slow test_program.Iterations)
    # both call mpirun, as the tests with ranks do, and jobs side by side now and then fail to start (open-mpi/ompi#8510)
    set_tests_properties("program: bad input" "program: pack, run, compare" "program: go on from a state" PROPERTIES RESOURCE_LOCK mpirun)
    add_test(NAME "report generator" COMMAND ${NSCDD_PYTHON} ${PROJECT_SOURCE_DIR}/reports/selftest.py)
    set_tests_properties("report generator" PROPERTIES LABELS program TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endif()

find_package(benchmark)
if(benchmark_FOUND AND TARGET nscdd_files)
    add_executable(nscdd_bench benchmark/bench_step.cpp benchmark/bench_sweep.cpp)
    target_link_libraries(nscdd_bench PRIVATE nscdd_files nscdd::kernel nscdd_flags benchmark::benchmark)
endif()
