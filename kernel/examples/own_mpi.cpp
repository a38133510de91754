// A program of your own over MPI, with a communicator of its own: nscdd neither starts nor ends MPI, and leaves the
// processes that it was not given alone.
//
//     mpirun -np 3 own_mpi
//
// The last process does something else; the others step a scene, each with its share of the grains. Checked: their
// grains are, to the last bit, those of as many subdomains in one process.
#include <cstdio>
#include <nscdd/comm/mpi.hpp>
#include <nscdd/nscdd.hpp>

using Model = nscdd::Model<3, nscdd::Coulomb>;

// By ascending id on the process that has rank 0 of `comm`, none elsewhere.
std::vector<nscdd::GatheredGrain<Model>> fall(nscdd::Communicator& comm, std::span<const nscdd::Grain<Model>> grains) {
    nscdd::SimulationSettings<Model> settings;
    settings.h = 1e-3;
    settings.gravity = {0, 0, -9.81};
    settings.materials.set(0, 0, {.friction = 0.3});
    settings.walls.emplace_back().normal = {0, 0, 1};
    nscdd::Simulation<Model> simulation(comm, settings, grains);
    const auto solve = nscdd::by_nscdd<nscdd::Dcs<Model>>({.tolerance = 1e-6});
    for (int step = 0; step < 20; ++step) simulation.step(solve);
    return nscdd::gather_grains(simulation);
}

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    int rank = 0, size = 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    const int steppers = size > 1 ? size - 1 : 1;

    std::vector<nscdd::Grain<Model>> all;
    for (int k = 0; k < 200; ++k)
        all.push_back(nscdd::make_grain<Model>(k, 0.5, 2500, {0.5 + k % 5, 0.5 + k / 5 % 5, 0.5 + k / 25}));

    MPI_Comm mine;
    MPI_Comm_split(MPI_COMM_WORLD, rank < steppers ? 0 : MPI_UNDEFINED, rank, &mine);
    int wrong = 0;
    if (mine != MPI_COMM_NULL) {
        std::vector<nscdd::Grain<Model>> share;  // any share will do: nscdd sends each grain where it belongs
        for (const auto& grain : all)
            if (grain.id % steppers == rank) share.push_back(grain);
        {
            nscdd::Mpi comm(mine);  // works on a duplicate; gone before MPI_Finalize
            const auto grains = fall(comm, share);
            if (rank == 0) {
                nscdd::InProcess subdomains(steppers);
                const auto expected = fall(subdomains, all);
                for (std::size_t g = 0; g < expected.size(); ++g)
                    wrong += grains[g].grain.position != expected[g].grain.position;
                std::printf("%d processes: %zu grains, %d of them not those of one process\n", steppers, grains.size(),
                            wrong);
            }
        }
        MPI_Comm_free(&mine);
    }
    MPI_Finalize();
    return wrong;
}
