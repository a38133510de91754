// An entry of the registry: what the command line says of it, and how it is made for a model M.
#pragma once

#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "files/error.hpp"

namespace nscdd {

template <class Info, class Make>
struct Offered {
    Info info;
    Make make;  // make.operator()<M>(arguments...)
};
template <class Info, class Make>
Offered(Info, Make) -> Offered<Info, Make>;

template <class Info>
std::vector<Info> infos_of(const auto& offered) {
    return std::apply([](const auto&... entry) { return std::vector<Info>{entry.info...}; }, offered);
}

template <class Make, class M, class... Arguments>
concept MakesFor =
    requires(const Make& make, const Arguments&... arguments) { make.template operator()<M>(arguments...); };

// What M is, for a message.
template <class M>
std::string kind_of() {
    if constexpr (requires { M::Law::name; })
        return std::string("scenes of the contact law ") + M::Law::name;
    else if constexpr (requires { requires M::rolls; })
        return "problems with rolling resistance";
    else
        return "this problem";
}

// What the entry of this name makes for M of these arguments. Throws InputError where its `make` asks for another
// contact law.
template <class M, class Made, class... Arguments>
Made make_offered(const auto& offered, const std::string& name, const Arguments&... arguments) {
    Made made;
    const auto try_one = [&]<class Info, class Make>(const Offered<Info, Make>& entry) {
        if (name != entry.info.name) return false;
        if constexpr (MakesFor<Make, M, Arguments...>)
            made = entry.make.template operator()<M>(arguments...);
        else
            throw InputError(name + " does not solve " + kind_of<M>());
        return true;
    };
    if (!std::apply([&](const auto&... entry) { return (try_one(entry) || ...); }, offered))
        throw std::logic_error(name + " is not offered");
    return made;
}

}  // namespace nscdd
