// LAMMPS' own decomposition as a partition of the kernel: bricks, of one size or as `balance` has moved their faces.
#pragma once

#include <lammps/comm.h>
#include <lammps/domain.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "nscdd/compiled.hpp"

namespace nscdd {

class Bricks {
  public:
    using Vec = compiled::Spheres::Vec;

    Bricks(const LAMMPS_NS::Domain& domain, const LAMMPS_NS::Comm& comm) {
        const std::array splits{comm.xsplit, comm.ysplit, comm.zsplit};
        for (std::size_t d = 0; d < 3; ++d)
            for (int k = 1; k < comm.procgrid[d]; ++k)
                faces_[d].push_back(domain.boxlo[d] + splits[d][k] * domain.prd[d]);
        for (int i = 0; i < comm.procgrid[0]; ++i)
            for (int j = 0; j < comm.procgrid[1]; ++j)
                ranks_.insert(ranks_.end(), comm.grid2proc[i][j], comm.grid2proc[i][j] + comm.procgrid[2]);
    }

    int owner(const Vec& point) const { return rank({brick(point[0], 0), brick(point[1], 1), brick(point[2], 2)}); }
    void visit_owners(const Vec& point, double reach, auto&& visit) const {
        std::array<std::size_t, 3> first, last, at;
        for (std::size_t d = 0; d < 3; ++d) {
            const double x = point[static_cast<int>(d)];
            first[d] = brick(x - reach, d), last[d] = brick(x + reach, d);
        }
        for (at[0] = first[0]; at[0] <= last[0]; ++at[0])
            for (at[1] = first[1]; at[1] <= last[1]; ++at[1])
                for (at[2] = first[2]; at[2] <= last[2]; ++at[2]) visit(rank(at));
    }
    std::string name() const { return "bricks of LAMMPS"; }

  private:
    // Beyond the box is the outermost brick.
    std::size_t brick(double x, std::size_t d) const {
        return static_cast<std::size_t>(std::ranges::upper_bound(faces_[d], x) - faces_[d].begin());
    }
    int rank(const std::array<std::size_t, 3>& at) const {
        return ranks_[(at[0] * (faces_[1].size() + 1) + at[1]) * (faces_[2].size() + 1) + at[2]];
    }

    std::array<std::vector<double>, 3> faces_;  // between two bricks [m]
    std::vector<int> ranks_;                    // of the bricks, the last axis fastest
};

}  // namespace nscdd
