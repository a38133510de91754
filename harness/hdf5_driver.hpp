// A file driver of HDF5 that reports a failed write to its user alone, never to the library. The library does not
// outlive a full disk: where chunks cannot be written, 1.10.8 crashes when the process ends.
#pragma once

#include <hdf5.h>

namespace nscdd::hdf5 {

// For H5Pset_driver and H5Fcreate, with the address of an int* as its information: that int becomes the errno of the
// first write that fails, after which nothing more is written. It must live until the file is closed.
hid_t forbearing_driver();

}  // namespace nscdd::hdf5
