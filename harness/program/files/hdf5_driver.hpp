// A file driver of HDF5 that reports a failed write to its user alone, never to the library. The library does not
// outlive a full disk: where chunks cannot be written, 1.10.8 crashes when the process ends.
#pragma once

#include <hdf5.h>

#include <vector>

#include "files/replace_file.hpp"

namespace nscdd::hdf5 {

// What the driver tells its user of a file.
struct Disk {
    int error = 0;  // errno of the first write that failed, after which nothing more is written
    std::vector<ByteRange> written;
};

// For H5Pset_driver and H5Fcreate or H5Fopen, with the address of a Disk* as its information: that Disk must live until
// the file is closed.
hid_t forbearing_driver();

}  // namespace nscdd::hdf5
