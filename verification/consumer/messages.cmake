# cmake -DINCLUDE=kernel/include -DCXX=... -DWORK=... "-DSYSTEM=dir;..." -P messages.cmake
#
# What the compiler says of a partition, a contact law, a solver, a scheme or a gluing that lacks something, and of C++17:
# a sentence. Nothing is compiled but syntax. SYSTEM: directories of Eigen.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/call.cmake)
set(compile ${CXX} -std=c++20 -I${INCLUDE})
foreach(directory IN LISTS SYSTEM)
    list(APPEND compile -isystem ${directory})
endforeach()
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})

# C++17: our sentence, and nothing of what lacks in it
file(WRITE ${WORK}/old.cpp "#include <nscdd/nscdd.hpp>\n")
execute_process(COMMAND ${compile} -std=c++17 -fsyntax-only ${WORK}/old.cpp RESULT_VARIABLE result ERROR_VARIABLE text)
string(REGEX MATCHALL "error:[^\n]*" said "${text}")
list(LENGTH said count)
if(result EQUAL 0 OR NOT said MATCHES "^error: [^;]*nscdd: compile as C..20 or later" OR count GREATER 2)
    message(SEND_ERROR "C++17 is not refused in one sentence:\n${text}")
endif()

# Macros may have the names min and max: in the headers they stand in parentheses, as (std::min)(a, b)
file(GLOB_RECURSE headers ${INCLUDE}/nscdd/*.hpp)
foreach(header IN LISTS headers)
    file(STRINGS ${header} bare REGEX "^([^/]|/[^/])*[^a-zA-Z_](min|max)\\(")
    if(bare)
        message(SEND_ERROR "${header}: a macro could take min or max in: ${bare}")
    endif()
endforeach()

# The headers of all that follows, parsed once
file(WRITE ${WORK}/parsed.hpp "#include <nscdd/core/model.hpp>
#include <nscdd/decompose/dcs.hpp>
#include <nscdd/partition/partition.hpp>
#include <nscdd/step/by_nscdd.hpp>
")
call(text ${compile} -x c++-header ${WORK}/parsed.hpp -o ${WORK}/parsed.hpp.gch)
list(APPEND compile -include ${WORK}/parsed.hpp)

# refused(FILE LACK SENTENCE): -DLACK of the file is an error that says so, and has no other sentence of ours.
function(refused file lack sentence)
    execute_process(COMMAND ${compile} -D${lack} -fsyntax-only ${WORK}/${file} RESULT_VARIABLE result ERROR_VARIABLE text)
    string(REGEX MATCHALL "static assertion failed[^\n]*|static_assert failed[^\n]*" said "${text}")
    list(LENGTH said count)
    if(result EQUAL 0 OR NOT said MATCHES "${sentence}" OR NOT count EQUAL 1)
        message(SEND_ERROR "${file}, ${lack}: expected this sentence alone: ${sentence}\n${text}")
    endif()
endfunction()

# A partition that lacks something
file(WRITE ${WORK}/partition.cpp "using M = nscdd::Model<2, nscdd::Frictionless>;
struct Whole {
    int owner(const M::Vec&) const { return 0; }
    void visit_owners(const M::Vec&, double, auto&& visit) const { visit(0); }
#ifndef UNNAMED
    const char* name() const { return \"whole\"; }
#endif
};
nscdd::Partition<M> partition = Whole{};
")
call(text ${compile} -fsyntax-only ${WORK}/partition.cpp)
refused(partition.cpp UNNAMED "nscdd: a partition needs `std::string name\\(\\) const`")

# A contact law that lacks something, one after the other. It needs no name.
file(WRITE ${WORK}/law.cpp "struct Law {
#ifdef NO_CONSTANT
    static const bool friction;
#elif !defined NO_FRICTION
    static constexpr bool friction = true;
#endif
    struct K {
#ifndef NO_EQUALITY
        bool operator==(const K&) const = default;
#endif
    };
#ifndef NO_STRUCT
    using Coefficients = K;
#endif
    using Pairing = nscdd::Pairing;
#ifndef NO_COEFFICIENTS
    static K coefficients(const Pairing&, double, double) { return {}; }
#endif
#ifndef NO_FAULT
    static const char* fault(const K&) { return nullptr; }
#endif
#ifdef NO_PACKET
    using Real = double;
#else
    template <class Real>
#endif
    static Real normal(Real trial, const K&) { return nscdd::larger(Real(0), trial); }
#ifndef NO_EXCESS
    template <class Real>
    static Real excess(Real normal, const K&) { return normal; }
#endif
#ifndef NO_LIMIT
    template <class Real>
    static Real limit(Real normal, const K&) { return normal; }
#endif
};
nscdd::Model<3, Law>::Vec vec;
")
call(text ${compile} -fsyntax-only ${WORK}/law.cpp)
foreach(lack "FRICTION=`static constexpr bool friction`" "CONSTANT=`static constexpr bool friction`, a constant"
             "STRUCT=`struct Coefficients` with defaults" "EQUALITY=`struct Coefficients` with defaults and operator=="
             "COEFFICIENTS=`static Coefficients coefficients" "FAULT=`static const char. fault" "PACKET=must be templates"
             "EXCESS=`normal.x, k.` and `excess.x, k.`" "LIMIT=`limit.normal, k.`")
    string(REGEX MATCH "^[A-Z]+" what "${lack}")
    string(REGEX REPLACE "^[A-Z]+=" "contact law[^\n]*" sentence "${lack}")
    refused(law.cpp NO_${what} "${sentence}")
endforeach()

# A solver that returns no report, one that cannot be copied, what is no scheme of gluing, and what glues nothing
file(WRITE ${WORK}/solver.cpp "#include <memory>
using M = nscdd::Model<2, nscdd::Frictionless>;
using Parts = std::span<nscdd::Subdomain<M>>;
struct Moved {
#ifdef MOVE_ONLY
    std::unique_ptr<int> memory;
#endif
    nscdd::SolveReport operator()(Parts, nscdd::Communicator&, nscdd::PhaseSeconds&) const { return {}; }
};
#ifdef NO_SCHEME
struct Scheme {};
#else
struct Scheme : nscdd::CommunicationScheme<M> {
    void setup(Parts, nscdd::Communicator&) override {}
    std::size_t pack(nscdd::Subdomain<M>&, std::size_t) override { return 0; }
#ifndef NO_START
    void start() override {}
#endif
    void finish(Parts, nscdd::Communicator&) override {}
#ifdef ARGUMENTS
    explicit Scheme(int);
#endif
};
#endif
struct Mean {
    static constexpr const char* name = \"mean\";
#ifndef NO_WORK
    static constexpr nscdd::Work work = nscdd::Work::glue;
#endif
    void setup(const nscdd::Copies&) {}
    void operator()(const nscdd::Copies&) {}
};
void step(nscdd::Simulation<M>& simulation) {
    simulation.step(Moved{});
    simulation.step([](Parts, nscdd::Communicator&, nscdd::PhaseSeconds&) {
#ifndef NO_REPORT
        return nscdd::SolveReport{};
#endif
    });
    simulation.step(nscdd::by_nscdd<Scheme>({}));
    simulation.step(nscdd::by_nscdd<nscdd::Dcs<M, Mean>>({}));
}
")
call(text ${compile} -fsyntax-only ${WORK}/solver.cpp)
refused(solver.cpp NO_REPORT "Simulation::step: a solver is called with")
refused(solver.cpp MOVE_ONLY "Simulation::step: a solver is copied")
refused(solver.cpp NO_SCHEME "a scheme of gluing is a class derived from CommunicationScheme")
refused(solver.cpp NO_START "a scheme of gluing needs `setup`")
refused(solver.cpp ARGUMENTS "a scheme of gluing must be made without arguments")
refused(solver.cpp NO_WORK "what glues copies needs")
