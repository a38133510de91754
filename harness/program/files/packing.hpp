// A packing: grains in a box. What `nscdd pack` writes and every run starts from. One process of many has some of its
// rows.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "files/hdf5.hpp"

namespace nscdd {

// The rows that one of `parts` processes reads: a contiguous range, nearly equal in size.
struct Share {
    int part = 0, parts = 1;
    hsize_t dealt = 0;  // number of rows that are divided; 0: those of the file

    hdf5::Rows of(hsize_t rows) const;
};

struct Packing {
    int dim = 0;                 // 2: disks, 3: spheres
    std::vector<double> x;       // (n, dim) in C order, centres [m]
    std::vector<double> radius;  // (n) [m], > 0
    std::vector<double> box;     // (dim) [m], the sample fills [0, box]

    // What a file may have besides; empty where it does not.
    std::vector<double> velocity{};  // (n, dim) [m/s]
    std::vector<double> spin{};      // (n, 1) in 2D, (n, 3) in 3D [rad/s]
    std::vector<int> periodic{};     // (dim) 1 of axes along which the box repeats
    std::vector<double> tilt{};      // (dim, dim) [m] of that box, nscdd::Cell; a state has it
    std::vector<int> material{};     // (n) row of `materials`, or of the scene's materials where those are not named
    std::vector<std::string> materials{};  // names
    bool has_fixed = false;                // says which grains are fixed: fixed, on a process that has some
    std::vector<int> fixed{};              // (n) 1 of grains that nothing moves

    std::size_t before = 0, after = 0;  // rows of the file that are not here

    std::size_t size() const { return radius.size(); }
    std::size_t total() const { return before + size() + after; }
};

// Reads datasets x, radius and box of an HDF5 file and, where it has them, velocity, spin, periodic, material and
// materials/name.
// A state has these too. Throws InputError naming file and dataset: missing, damaged, wrong type or shape, not finite,
// not positive, empty.
Packing read_packing(const std::string& path, const Share& share = {});

// Writes the packing, attribute `dim`, and string attributes such as {"source", ...}, {"command", ...}.
// Throws OutputError; an old file is then left as it was.
void write_packing(const std::string& path, const Packing& packing,
                   const std::map<std::string, std::string>& attributes = {});

// The packing's part of a larger file: x, radius and box.
Packing read_packing(const hdf5::Reader& file, const Share& share);
void write_packing(hdf5::Writer& file, const Packing& packing);

}  // namespace nscdd
