#include "model/run_request.hpp"

namespace nscdd {

RunFunction choose_model(const Scene& scene) {
    return scene.dimension == 2 ? choose_law<2>(scene.law) : choose_law<3>(scene.law);
}

}  // namespace nscdd
