// Contact laws that a scene may name by its key `law`, a line each.
#pragma once

#include <array>
#include <concepts>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "nscdd/core/cohesive.hpp"
#include "nscdd/core/rolling.hpp"

namespace nscdd {

template <class Pairing>
struct LawKey {
    const char* name;  // of [[pair]], beside `restitution`
    double Pairing::*value;
};

template <class L, std::size_t N>
struct OfferedLaw {
    using Law = L;
    const char* name;
    std::array<LawKey<typename L::Pairing>, N> keys;  // optional, >= 0
};
// The kernel asks no name of a law, messages of the program do.
template <class L>
concept NamedLaw = requires {
    { L::name } -> std::convertible_to<std::string>;
};

template <class L, class... Keys>
constexpr OfferedLaw<L, sizeof...(Keys)> offer_law(const char* name, Keys... keys) {
    static_assert(NamedLaw<L>, "a law that scenes may name needs `static constexpr const char* name`, for messages");
    return {name, {keys...}};
}

inline constexpr std::tuple laws{
    offer_law<Frictionless>("frictionless"),
    offer_law<Coulomb>("coulomb", LawKey<Coulomb::Pairing>{"friction", &Coulomb::Pairing::friction}),
    offer_law<Cohesive>("cohesive", LawKey<Cohesive::Pairing>{"friction", &Cohesive::Pairing::friction},
                        LawKey<Cohesive::Pairing>{"cohesion", &Cohesive::Pairing::cohesion},
                        LawKey<Cohesive::Pairing>{"range", &Cohesive::Pairing::range}),
    offer_law<Rolling>("rolling", LawKey<Rolling::Pairing>{"friction", &Rolling::Pairing::friction},
                       LawKey<Rolling::Pairing>{"rolling", &Rolling::Pairing::rolling},
                       LawKey<Rolling::Pairing>{"twisting", &Rolling::Pairing::twisting}),
};

inline constexpr int law_count = std::tuple_size_v<decltype(laws)>;
template <int law>  // by its line
using LawOf = typename std::tuple_element_t<std::size_t{law}, std::remove_const_t<decltype(laws)>>::Law;

// visit.operator()<L>(law) for the one that the scene names.
void visit_law(const std::string& name, auto&& visit) {
    const auto try_one = [&]<class L, std::size_t N>(const OfferedLaw<L, N>& law) {
        if (name != law.name) return false;
        visit(law);
        return true;
    };
    if (!std::apply([&](const auto&... law) { return (try_one(law) || ...); }, laws))
        throw std::logic_error(name + " is not offered");
}

inline std::vector<std::string> law_names() {
    return std::apply([](const auto&... law) { return std::vector<std::string>{law.name...}; }, laws);
}

// Names of the laws that have this key of [[pair]].
inline std::vector<std::string> laws_with_key(std::string_view key) {
    std::vector<std::string> names;
    const auto look = [&](const auto& law) {
        for (const auto& one : law.keys)
            if (one.name == key) names.emplace_back(law.name);
    };
    std::apply([&](const auto&... law) { (look(law), ...); }, laws);
    return names;
}

inline bool law_has_friction(const std::string& name) {
    bool friction = false;
    visit_law(name, [&]<class L, std::size_t N>(const OfferedLaw<L, N>&) { friction = L::friction; });
    return friction;
}

// Of a law that the scene need not have named: keys that it lacks are 0.
template <class L>
typename L::Pairing make_pairing(double restitution, const std::map<std::string, double>& coefficients) {
    typename L::Pairing pairing;
    pairing.restitution = restitution;
    const auto fill = [&]<class Other, std::size_t N>(const OfferedLaw<Other, N>& law) {
        if constexpr (std::same_as<Other, L>)
            for (const auto& key : law.keys)
                if (const auto found = coefficients.find(key.name); found != coefficients.end())
                    pairing.*key.value = found->second;
    };
    std::apply([&](const auto&... law) { (fill(law), ...); }, laws);
    return pairing;
}

// What is wrong with the coefficients of a pair; null: nothing.
inline const char* pairing_fault(const std::string& law, double restitution,
                                 const std::map<std::string, double>& coefficients) {
    const char* fault = nullptr;
    visit_law(law, [&]<class L, std::size_t N>(const OfferedLaw<L, N>&) {
        fault = make_pairing<L>(restitution, coefficients).fault();
    });
    return fault;
}

}  // namespace nscdd
