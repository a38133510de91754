// Any bytes as a scene file; what is read goes into a simulation, which may refuse it too.
#include "fuzz.hpp"
#include "model/build_scene.hpp"
#include "nscdd/nscdd.hpp"

using namespace nscdd;

namespace {

template <int dim>
void build(const RunRequest& request) {
    using M = Model<dim, Coulomb>;
    InProcess comm(2);
    BuiltScene<M> built = build_scene<M>(request, comm);
    try {
        Simulation<M> simulation(comm, built.settings, built.grains);
        push_walls(request.scene, simulation);
        simulation.step(by_nscdd<Dcs<M>>({.check_every = 2, .max_iterations = 10}));
    } catch (const std::runtime_error&) {  // numbers that are no longer finite, overlaps
    } catch (const std::invalid_argument&) {
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::MemoryFile file;
    file.fill(data, size);
    fuzz::refuses_in_one_line([&] {
        RunRequest request;
        request.scene = read_scene(file.path());
        if (request.scene.grains.size() > 100) return;
        request.box.assign(static_cast<std::size_t>(request.scene.dimension), 2.0);
        request.scene.dimension == 2 ? build<2>(request) : build<3>(request);
    });
    return 0;
}
