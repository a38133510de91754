// What reading and writing of HDF5 share. Included by hdf5.cpp and hdf5_writer.cpp only.
#pragma once

#include <algorithm>
#include <numeric>
#include <type_traits>

#include "files/hdf5.hpp"

namespace nscdd::hdf5 {

template <class T>
hid_t native_type() {
    if constexpr (std::is_same_v<T, double>)
        return H5T_NATIVE_DOUBLE;
    else if constexpr (std::is_same_v<T, std::int64_t>)
        return H5T_NATIVE_INT64;
    else
        return H5T_NATIVE_INT;
}

// Number of values; the largest number there is when that is too small for it.
inline hsize_t count(const Shape& shape) {
    constexpr hsize_t most = std::numeric_limits<hsize_t>::max();
    if (std::find(shape.begin(), shape.end(), 0) != shape.end()) return 0;
    return std::accumulate(shape.begin(), shape.end(), hsize_t{1}, [](hsize_t product, hsize_t extent) {
        return extent > most / product ? most : product * extent;
    });
}

enum class Found { nothing, here, elsewhere };

// Where an object is; `nothing` also when a group on its way is missing. Links other than hard ones may lead to other
// files, soft ones by way of external ones, and are never followed: a packing could bring any file of its reader's into
// the results.
inline Found find(hid_t file, const std::string& object) {
    for (std::size_t slash = object.find('/', 1);; slash = object.find('/', slash + 1)) {
        const std::string name = object.substr(0, slash);
        H5L_info_t info{};
        if (H5Lexists(file, name.c_str(), H5P_DEFAULT) <= 0) return Found::nothing;
        if (H5Lget_info(file, name.c_str(), &info, H5P_DEFAULT) < 0 || info.type != H5L_TYPE_HARD)
            return Found::elsewhere;
        if (slash == std::string::npos) return Found::here;
    }
}

// Whether the values of a dataset are in the file itself.
inline bool stored_here(hid_t dataset) {
    const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
    return H5Pget_layout(creation) != H5D_VIRTUAL && H5Pget_external_count(creation) == 0;
}

// The library would print its whole error stack; our one line replaces it.
inline void silence() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

}  // namespace nscdd::hdf5
