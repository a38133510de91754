# cmake -DINCLUDE=kernel/include -DCXX=... -DNM=... -DWORK=... "-DSYSTEM=dir;..." -P foreign.cmake
#
# What only a compiler can be asked. Under options that are not ours: -ffast-math is refused; C++23 with strict warnings,
# optimised for this machine, gives none; units for two instruction sets in one program share nothing of the kernel. And what
# it says of a partition, a contact law or a solver that lacks something. SYSTEM: directories of Eigen.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/call.cmake)
set(compile ${CXX} -std=c++20 -I${INCLUDE})
foreach(directory IN LISTS SYSTEM)
    list(APPEND compile -isystem ${directory})
endforeach()
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})

# -ffast-math
file(WRITE ${WORK}/fast.cpp "#include <nscdd/core/model.hpp>\n")
foreach(option -ffast-math -Ofast -ffinite-math-only)
    execute_process(COMMAND ${compile} ${option} -Wfatal-errors -fsyntax-only ${WORK}/fast.cpp RESULT_VARIABLE result ERROR_VARIABLE text)
    if(result EQUAL 0 OR NOT text MATCHES "nscdd: compile without -ffast-math")
        message(SEND_ERROR "${option} is not refused:\n${text}")
    endif()
endforeach()

# A partition that lacks something
file(WRITE ${WORK}/partition.cpp "#include <nscdd/partition/partition.hpp>
using M = nscdd::Model<2, nscdd::Frictionless>;
struct Whole {
    int owner(const M::Vec&) const { return 0; }
    void visit_owners(const M::Vec&, double, auto&& visit) const { visit(0); }
#ifdef NAMED
    const char* name() const { return \"whole\"; }
#endif
};
nscdd::Partition<M> partition = Whole{};
")
call(text ${compile} -DNAMED -fsyntax-only ${WORK}/partition.cpp)
execute_process(COMMAND ${compile} -fsyntax-only ${WORK}/partition.cpp RESULT_VARIABLE result ERROR_VARIABLE text)
if(result EQUAL 0 OR NOT text MATCHES "nscdd: a partition needs `std::string name\\(\\) const`")
    message(SEND_ERROR "a partition without a name is not refused in words:\n${text}")
endif()

# A contact law that lacks something, one after the other
file(WRITE ${WORK}/law.cpp "#include <nscdd/core/model.hpp>
struct Law {
    static constexpr const char* name = \"sticky\";
#ifndef NO_FRICTION
    static constexpr bool friction = true;
#endif
    struct Coefficients {
#ifndef NO_EQUALITY
        bool operator==(const Coefficients&) const = default;
#endif
    };
    using Pairing = nscdd::Pairing;
#ifndef NO_COEFFICIENTS
    static Coefficients coefficients(const Pairing&, double, double) { return {}; }
#endif
#ifndef NO_FAULT
    static const char* fault(const Coefficients&) { return nullptr; }
#endif
#ifdef NO_PACKET
    using Real = double;
#else
    template <class Real>
#endif
    static Real normal(Real trial, const Coefficients&) { return nscdd::larger(Real(0), trial); }
#ifndef NO_EXCESS
    template <class Real>
    static Real excess(Real normal, const Coefficients&) { return normal; }
#endif
#ifndef NO_LIMIT
    template <class Real>
    static Real limit(Real normal, const Coefficients&) { return normal; }
#endif
};
nscdd::Model<3, Law>::Vec vec;
")
call(text ${compile} -fsyntax-only ${WORK}/law.cpp)
foreach(lack "FRICTION=`static constexpr bool friction`" "EQUALITY=`struct Coefficients` with defaults and operator=="
             "COEFFICIENTS=`static Coefficients coefficients" "FAULT=`static const char. fault" "PACKET=must be templates"
             "EXCESS=`normal.x, k.` and `excess.x, k.`" "LIMIT=`limit.normal, k.`")
    string(REGEX MATCH "^[A-Z]+" what "${lack}")
    string(REGEX REPLACE "^[A-Z]+=" "" expected "${lack}")
    execute_process(COMMAND ${compile} -DNO_${what} -fsyntax-only ${WORK}/law.cpp RESULT_VARIABLE result ERROR_VARIABLE text)
    if(result EQUAL 0 OR NOT text MATCHES "contact law[^\n]*${expected}")
        message(SEND_ERROR "a law without ${what} is not refused in words:\n${text}")
    endif()
endforeach()

# A solver that returns no report
file(WRITE ${WORK}/solver.cpp "#include <nscdd/step/simulation.hpp>
using M = nscdd::Model<2, nscdd::Frictionless>;
void step(nscdd::Simulation<M>& simulation) {
    simulation.step([](std::span<nscdd::Subdomain<M>>, nscdd::Communicator&, nscdd::PhaseSeconds&) { RETURN; });
}
")
call(text ${compile} "-DRETURN=return nscdd::SolveReport{}" -fsyntax-only ${WORK}/solver.cpp)
execute_process(COMMAND ${compile} "-DRETURN=return" -fsyntax-only ${WORK}/solver.cpp RESULT_VARIABLE result ERROR_VARIABLE text)
if(result EQUAL 0 OR NOT text MATCHES "StepSolver")
    message(SEND_ERROR "a solver without a report is not refused in words:\n${text}")
endif()

# Two instruction sets: any x86-64's, and this machine's as a strict consumer compiles it. Linked in both orders: the linker
# takes the first copy that it meets.
set(march_narrow -march=x86-64 -O0)
set(march_wide -march=native -std=c++23 -O3 -Wall -Wextra -Werror)
execute_process(COMMAND ${compile} -march=x86-64 -fsyntax-only ${WORK}/fast.cpp RESULT_VARIABLE other ERROR_QUIET)
execute_process(COMMAND ${compile} -march=native -dM -E -x c++ /dev/null OUTPUT_VARIABLE macros ERROR_QUIET)
set(sets wide)
if(other OR NOT macros MATCHES "__AVX__")
    message("two instruction sets in one program: skipped, this machine has but one")
else()
    list(PREPEND sets narrow)
endif()
set(unit ${CMAKE_CURRENT_LIST_DIR}/instruction_sets.cpp)
foreach(set IN LISTS sets)
    call(text ${compile} ${march_${set}} -DUNIT=${set} ${unit} -c -o ${set}.o)
    call(symbols ${NM} --defined-only --extern-only --format=posix ${set}.o)
    string(REGEX MATCHALL "[^\n]*nscdd[^\n]* [WVu] [^\n]*" symbols "${symbols}")
    list(TRANSFORM symbols REPLACE " .*" "")
    list(LENGTH symbols count)
    if(count LESS 20)
        message(FATAL_ERROR "only ${count} weak symbols of the kernel found in ${set}.o")
    endif()
    set(symbols_${set} ${symbols})
endforeach()
if(NOT symbols_narrow)
    return()
endif()
foreach(symbol IN LISTS symbols_narrow)
    if(symbol IN_LIST symbols_wide)
        message(SEND_ERROR "defined for both instruction sets: ${symbol}")
    endif()
endforeach()
call(text ${compile} ${unit} -c -o main.o)
foreach(order "narrow.o;wide.o" "wide.o;narrow.o")
    call(text ${CXX} main.o ${order} -o program)
    call(answers ./program)
    message("${answers}")
endforeach()
