#include "model/live.hpp"
#include "registry/laws.hpp"

namespace nscdd {
namespace {

struct OfLaw {
    RunFunction run = nullptr;
    MakeLive live = nullptr;
};

template <int dim, int... law>
OfLaw of_law(const std::string& name, std::integer_sequence<int, law...>) {
    OfLaw found;
    ((name == std::get<law>(laws).name ? void(found = {run_law<dim, law>, live_law<dim, law>}) : void()), ...);
    return found;
}

OfLaw of_law(const Scene& scene) {
    constexpr auto all = std::make_integer_sequence<int, law_count>{};
    return scene.dimension == 2 ? of_law<2>(scene.law, all) : of_law<3>(scene.law, all);
}

}  // namespace

RunFunction choose_model(const Scene& scene) { return of_law(scene).run; }

std::unique_ptr<Live> make_live(RunRequest request, std::unique_ptr<Communicator> comm) {
    const MakeLive make = of_law(request.scene).live;
    return make(std::move(request), std::move(comm));
}

}  // namespace nscdd
