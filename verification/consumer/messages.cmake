# cmake -DINCLUDE=kernel/include -DCXX=... -DWORK=... "-DSYSTEM=dir;..." -P messages.cmake
#
# What the compiler says of a partition, a contact law, a solver, a scheme or a gluing that lacks something, of gravity in
# another dimension, and of C++17: a sentence. Nothing is compiled but syntax. SYSTEM: directories of Eigen.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/call.cmake)
set(compile ${CXX} -std=c++20 -I${INCLUDE})
foreach(directory IN LISTS SYSTEM)
    list(APPEND compile -isystem ${directory})
endforeach()

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

# refused(FILE SENTENCE...): our sentences among the errors of the file are these, and no other.
function(refused file)
    execute_process(COMMAND ${compile} -fsyntax-only ${WORK}/${file} RESULT_VARIABLE result ERROR_VARIABLE text)
    string(REGEX MATCHALL "static assertion failed[^\n]*|static_assert failed[^\n]*" said "${text}")
    list(LENGTH said count)
    list(LENGTH ARGN expected)
    set(good TRUE)
    foreach(sentence IN LISTS ARGN)
        if(NOT text MATCHES "${sentence}")
            set(good FALSE)
        endif()
    endforeach()
    if(result EQUAL 0 OR NOT count EQUAL expected OR NOT good)
        message(SEND_ERROR "${file}: expected these sentences alone: ${ARGN}\n${text}")
    endif()
endfunction()

# lacking(NAME HEADERS LACK...): NAME.cpp has NAME.inc once, whole; NAME-refused.cpp has it once for each macro LACK, in a
# namespace of that name. One file for all: what they include is parsed once.
function(lacking name headers)
    file(WRITE ${WORK}/${name}.cpp "${headers}#include \"${name}.inc\"\n")
    set(text "${headers}")
    foreach(lack IN LISTS ARGN)
        string(APPEND text "#define ${lack}\nnamespace n_${lack} {\n#include \"${name}.inc\"\n}\n#undef ${lack}\n")
    endforeach()
    file(WRITE ${WORK}/${name}-refused.cpp "${text}")
endfunction()

# A partition that lacks something
file(WRITE ${WORK}/partition.inc "using M = nscdd::Model<2, nscdd::Frictionless>;
struct Whole {
    int owner(const M::Vec&) const { return 0; }
    void visit_owners(const M::Vec&, double, auto&& visit) const { visit(0); }
#ifndef UNNAMED
    const char* name() const { return \"whole\"; }
#endif
};
nscdd::Partition<M> partition = Whole{};
")
lacking(partition "#include <nscdd/partition/partition.hpp>\n" UNNAMED)
call(text ${compile} -fsyntax-only ${WORK}/partition.cpp)
refused(partition-refused.cpp "nscdd: a partition needs `std::string name\\(\\) const`")

# A contact law that lacks something, one after the other. It needs no name.
file(WRITE ${WORK}/law.inc "struct Law {
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
    using Pairing = nscdd::Coulomb::Pairing;
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
set(lacks NO_FRICTION NO_CONSTANT NO_STRUCT NO_EQUALITY NO_COEFFICIENTS NO_FAULT NO_PACKET NO_EXCESS NO_LIMIT)
lacking(law "#include <nscdd/core/model.hpp>\n" ${lacks})
call(text ${compile} -fsyntax-only ${WORK}/law.cpp)
refused(law-refused.cpp "contact law: needs `static constexpr bool friction`, a constant" "contact law: needs `static constexpr bool friction`, a constant"
        "contact law: needs `struct Coefficients` with defaults and operator==" "contact law: needs `struct Coefficients` with defaults and operator=="
        "contact law[^\n]*`static Coefficients coefficients" "contact law[^\n]*`static const char. fault" "contact law[^\n]*must be templates"
        "contact law[^\n]*`normal.x, k.` and `excess.x, k.`" "contact law[^\n]*`limit.normal, k.`")

# A solver that returns no report, one that cannot be copied, what is no scheme of gluing, and what glues nothing
file(WRITE ${WORK}/solver.inc "using M = nscdd::Model<2, nscdd::Frictionless>;
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
lacking(solver "#include <memory>\n#include <nscdd/decompose/dcs.hpp>\n#include <nscdd/step/by_nscdd.hpp>\n"
        NO_REPORT MOVE_ONLY NO_SCHEME NO_START ARGUMENTS NO_WORK)
call(text ${compile} -fsyntax-only ${WORK}/solver.cpp)
refused(solver-refused.cpp "Simulation::step: a solver is called with" "Simulation::step: a solver is copied"
        "a scheme of gluing is a class derived from CommunicationScheme" "a scheme of gluing needs `setup`"
        "a scheme of gluing must be made without arguments" "what glues copies needs")

# Gravity of another dimension
file(WRITE ${WORK}/gravity.inc "using M = nscdd::Model<3, nscdd::Coulomb>;
void set(nscdd::SimulationSettings<M>& settings) {
#ifdef OF_DISKS
    settings.gravity = {0, -9.81};
#else
    settings.gravity = {0, 0, -9.81};
    settings.gravity = -9.81 * M::Vec::UnitZ();
#endif
}
")
lacking(gravity "#include <nscdd/step/settings.hpp>\n" OF_DISKS)
call(text ${compile} -fsyntax-only ${WORK}/gravity.cpp)
refused(gravity-refused.cpp "nscdd: gravity is {0, -9.81} in 2D and {0, 0, -9.81} in 3D")
