// A packing: grains in a box, without motion. What `nscdd pack` writes and every run starts from.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hdf5.hpp"

namespace nscdd {

struct Packing {
    int dim = 0;                 // 2: disks, 3: spheres
    std::vector<double> x;       // (n, dim) in C order, centres [m]
    std::vector<double> radius;  // (n) [m], > 0
    std::vector<double> box;     // (dim) [m], the sample fills [0, box]

    std::size_t size() const { return radius.size(); }
};

// Reads datasets x, radius and box of an HDF5 file; others, such as those of a state, are ignored.
// Throws InputError naming file and dataset: missing, damaged, wrong type or shape, not finite, not positive, empty.
Packing read_packing(const std::string& path);

// Writes the packing, attribute `dim`, and string attributes such as {"source", ...}, {"command", ...}.
// Throws OutputError; an old file is then left as it was.
void write_packing(const std::string& path, const Packing& packing,
                   const std::map<std::string, std::string>& attributes = {});

// The packing's part of a larger file.
Packing read_packing(const hdf5::Reader& file);
void write_packing(hdf5::Writer& file, const Packing& packing);

}  // namespace nscdd
