nscdd_test(test_basics "quick;sanitized;threads" unit/test_communicator.cpp unit/test_mailbox.cpp unit/test_packet.cpp unit/test_sweeper.cpp)
nscdd_test(test_law "quick" unit/test_contact_law.cpp unit/test_delassus.cpp)
nscdd_test(test_schemes "quick;threads" agreement/test_schemes.cpp)
nscdd_test(test_decomposition "sanitized" unit/test_partition.cpp unit/test_partitioners.cpp unit/test_any_ranks.cpp
           unit/test_gluing.cpp)
nscdd_test(test_scenes "sanitized" unit/test_detection.cpp unit/test_passing.cpp unit/test_misuse.cpp unit/test_analytic.cpp)
nscdd_test(test_iteration "" unit/test_anderson.cpp unit/test_conservation.cpp unit/test_invariance.cpp unit/test_velocity_error.cpp
           unit/test_distance.cpp)
nscdd_test(test_cell "" unit/test_cell.cpp)
nscdd_test(test_moving "" unit/test_moving.cpp)
nscdd_test(test_obstacles "" unit/test_obstacles.cpp)
nscdd_test(test_exchange "" unit/test_exchange.cpp)
nscdd_test(test_references "" unit/test_newton.cpp unit/test_gradient.cpp)
nscdd_test(test_local_form "" unit/test_local_form.cpp)
nscdd_test(test_cohesive "" unit/test_cohesive.cpp)
nscdd_test(test_rolling "" unit/test_rolling.cpp unit/test_rolling_form.cpp)
# 40 steps over and over: minutes under the sanitizers, in --full
nscdd_test(test_steps "" unit/test_stepping.cpp agreement/test_reference.cpp)

# The judge of the random scenes: are accepted steps near the answer?
nscdd_test(test_judge "" wild/test_judge.cpp wild/verdict.cpp wild/active_set.cpp)
set_source_files_properties(wild/active_set.cpp PROPERTIES SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS -O2)

foreach(program test_cell test_decomposition test_steps)
    nscdd_link_metis(${program})
endforeach()

# The fast sweep as users compile it: optimised, contracted, for this processor unless NSCDD_NATIVE is off, all warnings on
add_executable(test_sweep_as_shipped unit/test_sweep_as_shipped.cpp)
target_link_libraries(test_sweep_as_shipped PRIVATE nscdd::kernel catch_main)
target_include_directories(test_sweep_as_shipped PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
target_compile_options(test_sweep_as_shipped PRIVATE -O3 -Wall -Wextra $<$<BOOL:${NSCDD_NATIVE}>:-march=native>
                       $<$<BOOL:${NSCDD_WERROR}>:-Werror>)
catch_discover_tests(test_sweep_as_shipped TEST_PREFIX "test_sweep_as_shipped: " PROPERTIES LABELS unit TIMEOUT 600)

if(NSCDD_FULL_TESTS)
    # The sweep by the narrowest packets: a kernel compiled for this alone, in two models.
    nscdd_test(test_sweeper_narrow "full" unit/test_packet.cpp unit/test_sweeper.cpp)
    target_compile_definitions(test_sweeper_narrow PRIVATE NSCDD_LANES=2 NSCDD_WITHOUT_COMPILED_KERNEL)
    set_target_properties(test_sweeper_narrow PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)
    # A study of what a kernel in single precision would cost, of which nothing is in the kernel.
    nscdd_test(test_single_precision "full" unit/test_single_precision.cpp)
endif()

if(TARGET nscdd_files)
    nscdd_test(test_files "sanitized" unit/test_scene.cpp unit/test_packing.cpp unit/test_shares.cpp
               unit/test_fclib.cpp unit/test_costs.cpp)
    target_link_libraries(test_files PRIVATE nscdd_files)
    nscdd_link_metis(test_files)

    find_package(CLI11 REQUIRED)
    nscdd_test_program(wild_scenes "" wild/main.cpp wild/table.cpp wild/verdict.cpp wild/active_set.cpp)
    target_link_libraries(wild_scenes PRIVATE CLI11::CLI11 nscdd_files)
    add_test(NAME "accepted steps of random scenes are near the answer" COMMAND wild_scenes --scenes 50 --seed 1 --max-iterations 3000
             --solvers nlgs,nlgs-accelerated,dcs-accelerated --distance 0.3 --energy-gain 1e-3)
    set_tests_properties("accepted steps of random scenes are near the answer" PROPERTIES LABELS unit TIMEOUT 600)
    # scenes where impulses far larger than those of the answer left their round-off in the velocities: Newton's trials, and sweeps before them
    foreach(seed 1811 1571)
        add_test(NAME "velocities by Newton's method are those of its impulses: scene ${seed}" COMMAND wild_scenes --scenes 1 --seed ${seed}
                 --solvers newton --distance 0.3 --inconsistent 1e-8)
        set_tests_properties("velocities by Newton's method are those of its impulses: scene ${seed}" PROPERTIES LABELS unit TIMEOUT 600)
    endforeach()
endif()

if(MPI_CXX_FOUND)
    add_library(mpi_main OBJECT mpi/mpi_main.cpp)
    target_link_libraries(mpi_main PUBLIC Catch2::Catch2 MPI::MPI_CXX)
    target_compile_options(mpi_main PRIVATE -O0)
    nscdd_mpi_test(test_communicator_mpi "3" "1;2;4;7;8" mpi/test_communicator_mpi.cpp)
    # under the sanitizers more ranks than cores take ten minutes for code that three ranks go through
    set(more_ranks 1 3)
    if(NOT NSCDD_SANITIZED)
        list(APPEND more_ranks 4 7 8)
    endif()
    nscdd_mpi_test(test_mpi_bitwise "2" "${more_ranks}" mpi/test_mpi_bitwise.cpp)
    nscdd_link_metis(test_mpi_bitwise)
    if(NOT NSCDD_SANITIZED)
        nscdd_mpi_runs("test_mpi_bitwise, hard scenes" test_mpi_bitwise mpi "1;3;4;7;8" [any_ranks])  # 2 ranks run all
    endif()
    add_executable(ping_pong mpi/ping_pong.cpp)
    target_link_libraries(ping_pong PRIVATE nscdd::kernel nscdd_flags MPI::MPI_CXX)
    if(TARGET nscdd_files)
        add_executable(lone_error mpi/lone_error.cpp)
        target_link_libraries(lone_error PRIVATE nscdd_files nscdd_flags MPI::MPI_CXX)
        add_test(NAME "an error of one rank alone" COMMAND ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG} 3 $<TARGET_FILE:lone_error>)
        set_tests_properties("an error of one rank alone" PROPERTIES LABELS mpi TIMEOUT 60 RESOURCE_LOCK mpirun  # ten seconds of waiting
                             PASS_REGULAR_EXPRESSION "nscdd: rank 1 alone: what no other rank knows" FAIL_REGULAR_EXPRESSION "not stopped"
                             ENVIRONMENT "${mpi_environment};ASAN_OPTIONS=detect_leaks=0")
    endif()
endif()
if(TARGET Simgrid::smpi)
    add_library(ping_pong_simulated MODULE mpi/ping_pong.cpp)
    set_target_properties(ping_pong_simulated PROPERTIES PREFIX "" SUFFIX ""
                          LIBRARY_OUTPUT_DIRECTORY "${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
    target_link_libraries(ping_pong_simulated PRIVATE nscdd::kernel nscdd_flags Simgrid::smpi)
endif()

get_target_property(eigen_include Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
add_test(NAME consumer COMMAND ${CMAKE_COMMAND} -DREPOSITORY=${PROJECT_SOURCE_DIR} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/consumer
         -DCXX=${CMAKE_CXX_COMPILER} -DGENERATOR=${CMAKE_GENERATOR} -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/run.cmake)
add_test(NAME "consumer within another project" COMMAND ${CMAKE_COMMAND} -DREPOSITORY=${PROJECT_SOURCE_DIR}
         -DINSTALLED=${CMAKE_CURRENT_BINARY_DIR}/consumer/installed -DWORK=${CMAKE_CURRENT_BINARY_DIR}/embedded
         -DCXX=${CMAKE_CXX_COMPILER} -DGENERATOR=${CMAKE_GENERATOR} -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/embedded.cmake)
set_tests_properties("consumer within another project" PROPERTIES DEPENDS consumer)
add_test(NAME "consumer with options of its own" COMMAND ${CMAKE_COMMAND} -DINCLUDE=${PROJECT_SOURCE_DIR}/kernel/include
         -DCXX=${CMAKE_CXX_COMPILER} -DNM=${CMAKE_NM} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/foreign
         "-DSYSTEM=${eigen_include};${MPI_CXX_INCLUDE_DIRS}"
         -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/foreign.cmake)
add_test(NAME "what the compiler says" COMMAND ${CMAKE_COMMAND} -DINCLUDE=${PROJECT_SOURCE_DIR}/kernel/include
         -DCXX=${CMAKE_CXX_COMPILER} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/messages -DSYSTEM=${eigen_include}
         -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/messages.cmake)
add_test(NAME "headers compile alone" COMMAND ${CMAKE_COMMAND} -DINCLUDE=${PROJECT_SOURCE_DIR}/kernel/include
         -DCXX=${CMAKE_CXX_COMPILER} -DWORK=${CMAKE_CURRENT_BINARY_DIR} "-DSYSTEM=${eigen_include};${MPI_CXX_INCLUDE_DIRS}"
         -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/headers.cmake)
add_test(NAME "one header knows MPI, one METIS" COMMAND ${CMAKE_COMMAND} -DINCLUDE=${PROJECT_SOURCE_DIR}/kernel/include
         -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/optional_libraries.cmake)
add_test(NAME "consumer of the compiled kernel" COMMAND ${CMAKE_COMMAND} -DBUILD=${PROJECT_BINARY_DIR} -DCXX=${CMAKE_CXX_COMPILER} -DNM=${CMAKE_NM}
         -DWORK=${CMAKE_CURRENT_BINARY_DIR}/compiled -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/compiled.cmake)
# it compiles the kernel twice, ten minutes: when the kernel, or what is said of instruction sets, changes
add_test(NAME "libraries for each processor" COMMAND ${CMAKE_COMMAND} -DREPOSITORY=${PROJECT_SOURCE_DIR} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/levels
         -DCXX=${CMAKE_CXX_COMPILER} -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/levels.cmake)
set_tests_properties("libraries for each processor" PROPERTIES LABELS full TIMEOUT 2400)
set_tests_properties(consumer "consumer within another project" "consumer of the compiled kernel" "what the compiler says" "headers compile alone" "one header knows MPI, one METIS"
                     PROPERTIES LABELS build TIMEOUT 600)
# it compiles for two minutes; the kernel breaks it when GCC warns anew
set_tests_properties("consumer with options of its own" PROPERTIES LABELS full TIMEOUT 600)

if(NSCDD_PROGRAM)
    find_program(NSCDD_TEST_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)  # Debian's, which has h5py
    function(nscdd_program_test name label module)
        add_test(NAME "program: ${name}" COMMAND ${NSCDD_TEST_PYTHON} -m unittest ${module} ${ARGN}
                 WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/program)
        set_tests_properties("program: ${name}" PROPERTIES LABELS "${label}" TIMEOUT 900
            ENVIRONMENT "${mpi_environment};NSCDD=$<TARGET_FILE:nscdd>;NSCDD_MPIRUN=${MPIEXEC_EXECUTABLE};PYTHONDONTWRITEBYTECODE=1")
    endfunction()
    nscdd_program_test("bad input" "program;sanitized" test_bad_input)
    nscdd_program_test("outputs" "program;sanitized" test_outputs)
    nscdd_program_test("what compare trusts" "program;sanitized" test_compare)
    nscdd_program_test("notes, and packings with more" program test_notes)
    nscdd_program_test("another answer or a wrong one" program test_another_answer)
    nscdd_program_test("inputs that failed" program test_failing)
    set_tests_properties("program: inputs that failed" PROPERTIES SKIP_REGULAR_EXPRESSION "OK \\(skipped")
    nscdd_program_test("pack, run, compare" program test_program.Program)
    nscdd_program_test("packings by both generators" program test_packings)
    nscdd_program_test("go on from a state" program test_restart)
    nscdd_program_test("within LAMMPS" program test_lammps)
    set_tests_properties("program: within LAMMPS" PROPERTIES SKIP_REGULAR_EXPRESSION "OK \\(skipped")
    nscdd_program_test("cells that repeat" program test_cell)
    nscdd_program_test("motions of walls" program test_motions)
    nscdd_program_test("obstacles" program test_obstacles)
    nscdd_program_test("contact laws by name" program test_laws)
    nscdd_program_test("grains, and when a run ends" program test_grains)
    nscdd_program_test("checkpoints" program test_checkpoint.Checkpoints test_checkpoint.Faults)
    nscdd_program_test("time series" program test_series.Series test_series.Stopped test_series.Targets)
    nscdd_program_test("frames" program test_series.Frames)
    nscdd_program_test("hard cases" program test_hard_cases)
    nscdd_program_test("exchange of contact problems" program test_fclib test_fclib_rolling.Files)
    nscdd_program_test("rolling resistance beside Siconos" program test_fclib_rolling.Agreement)
    set_tests_properties("program: rolling resistance beside Siconos" PROPERTIES SKIP_REGULAR_EXPRESSION "OK \\(skipped=2\\)")
    nscdd_program_test("simulated machines" program test_simulated)
    # a thousand simulated ranks: minutes where a machine is slow or busy
    set_tests_properties("program: simulated machines" PROPERTIES SKIP_REGULAR_EXPRESSION "OK \\(skipped" TIMEOUT 3600)
    nscdd_program_test("bundle for other machines" program test_bundle.Bundle.test_programs_start_and_ranks_are_simulated_and_measured)
    nscdd_program_test("what the bundle measures" "program;full" test_bundle.Bundle.test_run_makes_what_is_sent_back)
    set_tests_properties("program: bundle for other machines" "program: what the bundle measures" PROPERTIES
                         SKIP_REGULAR_EXPRESSION "OK \\(skipped" RESOURCE_LOCK mpirun)
    nscdd_program_test("judge of regressions" program test_regression)
    nscdd_program_test("counted numbers beside the record" program test_counted)
    nscdd_program_test("engine of the suite" program test_suite)
    nscdd_program_test("page of results" program test_report)
    nscdd_program_test("homogeneous shear beside LAMMPS" program test_rheology)
    nscdd_program_test("page of the paper" program test_report_paper)
    nscdd_program_test("times, and whether they are believed" program test_times)
    nscdd_program_test("options of scenes, help and results" program test_options)
    nscdd_program_test("floors of kernel and program" program test_floors)
    nscdd_program_test("words a sentence" program test_words)
    nscdd_program_test("packages" program test_packages)
    nscdd_program_test("site of manual and reference" program test_docs)
    set_tests_properties("program: site of manual and reference" PROPERTIES SKIP_REGULAR_EXPRESSION "OK \\(skipped")
    nscdd_program_test("commands of the manual" program test_manual.Tutorial test_manual.Agreement test_manual.Index)
    nscdd_program_test("a program of one's own, as the manual builds it" program test_manual.OwnCode)
    if(TARGET nscdd_python)
        nscdd_program_test("Python module" program test_python test_python_solve test_manual.Python)
        nscdd_program_test("exchange of grains" program test_exchange.Files test_exchange.Commands test_exchange.Refusals)
        nscdd_program_test("exchange of grains with YADE" program test_exchange.Yade)
        nscdd_program_test("grains that VTK reads" program test_exchange.Vtk)
        set_tests_properties("program: exchange of grains with YADE" "program: grains that VTK reads" PROPERTIES SKIP_REGULAR_EXPRESSION "OK \\(skipped")
    endif()
    nscdd_program_test("the paper at its smallest" program test_paper)
    nscdd_program_test("granular physics" program test_physics)
    nscdd_program_test("gallery" program test_gallery)
    # counts of the reduced scenes against those that were accepted: a minute on two cores
    add_test(NAME "regression of counts and simulated speed-ups" COMMAND ${NSCDD_TEST_PYTHON} -m nscdd_suite regression
             --results ${CMAKE_CURRENT_BINARY_DIR}/regression)
    set_tests_properties("regression of counts and simulated speed-ups" PROPERTIES LABELS program TIMEOUT 600 PROCESSORS 2
        ENVIRONMENT "NSCDD=$<TARGET_FILE:nscdd>;PYTHONPATH=${PROJECT_SOURCE_DIR}/harness/suite;PYTHONDONTWRITEBYTECODE=1")
    # six minutes
    nscdd_program_test("killed a hundred times" "program;full" test_checkpoint.HundredKills.test_killed_at_random_moments)
    nscdd_program_test("beside other codes" program test_peers)
    # Half a minute each: two of scripts that measure, and a count of iterations that is seldom off
    nscdd_program_test("speed against error" "program;full" test_accuracy)
    nscdd_program_test("what acceleration saves" "program;full" test_acceleration)
    nscdd_program_test("iterations at 8 subdomains" "program;full" test_program.Iterations)
    # They call mpirun, as the tests with ranks do. Jobs side by side now and then fail to start (open-mpi/ompi#8510), and
    # their ranks, bound and spinning, share cores.
    set_tests_properties("program: bad input" "program: outputs" "program: pack, run, compare" "program: go on from a state"
                         "program: checkpoints" "program: time series" "program: frames" "program: killed a hundred times"
                         "program: commands of the manual" "program: the paper at its smallest" PROPERTIES RESOURCE_LOCK mpirun)
    add_dependencies(sanitized_tests nscdd)
endif()

# Seconds of the longest, about: ctest starts them first, so that none is waited for at the end.
function(nscdd_long seconds)
    foreach(test IN LISTS ARGN)
        if(TEST ${test})
            set_tests_properties(${test} PROPERTIES COST ${seconds})
        endif()
    endforeach()
endfunction()
nscdd_long(60 "headers compile alone" "program: a program of one's own, as the manual builds it" "program: bad input")
nscdd_long(30 "regression of counts and simulated speed-ups" "program: outputs" "program: simulated machines" "program: the paper at its smallest"
           "what the compiler says" "consumer")
nscdd_long(15 "program: site of manual and reference" "program: go on from a state" "program: checkpoints" "program: pack, run, compare"
           "program: time series" "program: hard cases" "an error of one rank alone")

find_package(benchmark)
if(benchmark_FOUND AND TARGET nscdd_files)
    # two minutes of compiling that no test needs: `cmake --build build --target nscdd_bench`
    add_executable(nscdd_bench EXCLUDE_FROM_ALL benchmark/bench_step.cpp benchmark/bench_sweep.cpp)
    target_include_directories(nscdd_bench PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
    target_link_libraries(nscdd_bench PRIVATE nscdd_files nscdd::kernel nscdd_flags benchmark::benchmark)
    if(NSCDD_FULL_TESTS)
        set_target_properties(nscdd_bench PROPERTIES EXCLUDE_FROM_ALL OFF)
    endif()
endif()
