// Ways to solve a step that --scheme names, a line each: solvers on one rank, and schemes of gluing.
#pragma once

#include "nscdd/reference.hpp"
#include "registry/choices.hpp"
#include "registry/factors.hpp"
#include "registry/offered.hpp"
#include "registry/registry.hpp"

namespace nscdd {

// The way to solve a step, and the name of what solves its interface problem.
template <class M>
struct ChosenSolver {
    AnyStepSolver<M> solve;
    std::string interface = "none";
};

namespace registry_detail {

// Models whose law the reference solvers know.
template <class M>
concept OnCone = detail::SolvedOnCone<typename M::Law>;

template <class Scheme>
ChosenSolver<typename Scheme::Model> glued_by(const SolveOptions& options, const char* interface) {
    using M = typename Scheme::Model;
    return {by_nscdd<Scheme>(options, newton_where_stalled<M>()), interface};
}

inline NewtonOptions newton_options(const SolveOptions& options) {
    NewtonOptions newton{.tolerance = options.tolerance, .bounds = options.bounds};
    newton.max_iterations = std::min(options.max_iterations, newton.max_iterations);  // a scene's is of sweeps
    return newton;
}

using Asked = std::optional<Interface>;

}  // namespace registry_detail

// make<M>(interface, options); interface: what --interface asks for, if anything.
inline constexpr std::tuple schemes{
    Offered{SchemeInfo{"nlgs", "sequential reference", false, true},
            []<class M>(registry_detail::Asked, const SolveOptions& o) {
                return ChosenSolver<M>{by_nlgs<M>(o, newton_where_stalled<M>())};
            }},
    Offered{SchemeInfo{"newton", "the same to high accuracy", false, false},
            []<registry_detail::OnCone M>(registry_detail::Asked, const SolveOptions& o) {
                return ChosenSolver<M>{by_newton<M, NewtonFactors>(registry_detail::newton_options(o))};
            }},
    Offered{SchemeInfo{"spg", "spectral projected gradient", false, false},
            []<registry_detail::OnCone M>(registry_detail::Asked, const SolveOptions& o) {
                return ChosenSolver<M>{by_gradient<M>(o, Descent::spectral)};
            }},
    Offered{SchemeInfo{"apgd", "accelerated projected gradient", false, false},
            []<registry_detail::OnCone M>(registry_detail::Asked, const SolveOptions& o) {
                return ChosenSolver<M>{by_gradient<M>(o, Descent::nesterov)};
            }},
    Offered{SchemeInfo{"ccs", "NSCDD, interface problem gathered and solved on rank 0", true, true},
            []<class M>(registry_detail::Asked interface, const SolveOptions& o) {
                return interface != Interface::closed_form
                           ? registry_detail::glued_by<Ccs<M, Cholmod>>(o, "factorised")
                           : registry_detail::glued_by<Ccs<M, ClosedForm>>(o, "closed-form");
            }},
    Offered{SchemeInfo{"dcs", "NSCDD, interface problem between neighbours", true, true},
            []<class M>(registry_detail::Asked interface, const SolveOptions& o) {
                // each rank factorises X of its own boundary, (10)
                return interface == Interface::factorised
                           ? registry_detail::glued_by<Dcs<M, Cholmod>>(o, "elementary")
                           : registry_detail::glued_by<Dcs<M, ClosedForm>>(o, "closed-form");
            }},
};

template <class M>
ChosenSolver<M> choose_solver(const std::string& scheme, std::optional<Interface> interface,
                              const SolveOptions& options) {
    return make_offered<M, ChosenSolver<M>>(schemes, scheme, interface, options);
}

}  // namespace nscdd
