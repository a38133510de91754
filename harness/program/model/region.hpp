// A part of space that a scene names: a box or a half-space.
#pragma once

#include <Eigen/Core>

#include "files/toml_table.hpp"

namespace nscdd {

struct Region {
    Eigen::VectorXd low, high;        // corners of a box [m]; empty for a half-space
    Eigen::VectorXd normal, through;  // the half-space behind the plane, as a wall with this normal has it [m]

    bool is_box() const { return low.size() > 0; }
    // Of the centre of a grain.
    template <class Vec>
    bool contains(const Vec& x) const {
        if (!is_box()) return normal.dot(x - through) < 0;
        return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
    }
};

// Throws InputError as TomlTable does. The keys are low and high, or normal and through.
Region read_region(TomlTable& table, int dimension);
// The keys low and high alone.
Region read_box(TomlTable& table, int dimension);

}  // namespace nscdd
