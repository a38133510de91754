#include "commands/libraries.hpp"

#include <H5public.h>
#include <SuiteSparse_config.h>
#include <fmt/format.h>
#include <metis.h>

#include <Eigen/Core>

#include "commands/launch.hpp"

namespace nscdd {

std::map<std::string, std::string> libraries() {
    const auto version = [](int a, int b, int c) { return fmt::format("{}.{}.{}", a, b, c); };
    return {{"eigen", version(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
            {"hdf5", version(H5_VERS_MAJOR, H5_VERS_MINOR, H5_VERS_RELEASE)},
            {"metis", version(METIS_VER_MAJOR, METIS_VER_MINOR, METIS_VER_SUBMINOR)},
            {"mpi", mpi_library()},
            {"suitesparse", version(SUITESPARSE_MAIN_VERSION, SUITESPARSE_SUB_VERSION, SUITESPARSE_SUBSUB_VERSION)}};
}

}  // namespace nscdd
