#include "model/live.hpp"

namespace nscdd {

RunFunction choose_model(const Scene& scene) {
    return scene.dimension == 2 ? choose_law<2>(scene.law) : choose_law<3>(scene.law);
}

std::unique_ptr<Live> make_live(RunRequest request, std::unique_ptr<Communicator> comm) {
    const MakeLive make =
        request.scene.dimension == 2 ? choose_live<2>(request.scene.law) : choose_live<3>(request.scene.law);
    return make(std::move(request), std::move(comm));
}

}  // namespace nscdd
