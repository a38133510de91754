// Surfaces as STL files have them: triangles, in binary or as text.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace nscdd {

using StlTriangle = std::array<Eigen::Vector3d, 3>;  // corners, in the file's unit of length

// The triangles of a file; its normals and colours are not looked at. Throws InputError, "file: problem" or
// "file:line: problem", for a file that cannot be read, is cut short, has no triangle, or a number that is not finite.
std::vector<StlTriangle> read_stl(const std::string& path);

}  // namespace nscdd
