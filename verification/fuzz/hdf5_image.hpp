// HDF5 files built from a fuzzer's bytes: each dataset of a format as it should be, or missing, or of another rank,
// shape, type or layout, with any values. The container itself is always sound: what the HDF5 library makes of damaged
// ones is its own affair: 1.10.8 crashed or hung on 6 of 8,000 states with a few bytes changed, all in texts of
// variable length, which we no longer write or read.
#pragma once

#include <fuzzer/FuzzedDataProvider.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "files/hdf5.hpp"
#include "fuzz.hpp"

namespace nscdd::fuzz {

class Hdf5Image {
  public:
    explicit Hdf5Image(FuzzedDataProvider& bytes) : bytes_(bytes) {
        H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
        const hdf5::Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
        H5Pset_fapl_core(access, 1 << 16, false);
        file_ = H5Fcreate("image", H5F_ACC_TRUNC, H5P_DEFAULT, access);
    }
    ~Hdf5Image() { H5Fclose(file_); }
    Hdf5Image(const Hdf5Image&) = delete;
    Hdf5Image& operator=(const Hdf5Image&) = delete;

    // The dataset with these values, unless the fuzzer has other plans. Where it has no bytes left it has none.
    void dataset(const std::string& name, hdf5::Shape shape, std::vector<double> values, bool integers) {
        const int plan = bytes_.ConsumeIntegralInRange(0, 15);
        if (plan == 1) return;
        if (plan == 8 || plan == 9) return link(name, plan == 8);
        if (plan == 2) shape.resize(bytes_.ConsumeIntegralInRange<std::size_t>(0, 4), 1);
        if (plan == 2 || plan == 3)
            for (auto& extent : shape) extent = any_extent();
        if (plan == 4 || plan == 5)
            for (auto& value : values) value = any_value(integers);
        if (plan == 6 && !values.empty())
            values[bytes_.ConsumeIntegralInRange<std::size_t>(0, values.size() - 1)] = any_value(integers);
        write(name, shape, values, plan == 7 ? any_type() : integers ? H5T_NATIVE_INT : H5T_NATIVE_DOUBLE);
    }

    void attribute(const std::string& name, double value, hid_t type) {
        const int plan = bytes_.ConsumeIntegralInRange(0, 7);
        if (plan == 1) return;
        const hsize_t two = 2;
        const hdf5::Handle space(plan == 2 ? H5Screate_simple(1, &two, nullptr) : H5Screate(H5S_SCALAR), H5Sclose);
        if (plan == 3) value = any_value(false);
        put(H5Acreate2(file_, name.c_str(), plan == 4 ? any_type() : type, space, H5P_DEFAULT, H5P_DEFAULT),
            {value, value}, H5Awrite, H5Aclose);
    }

    void text_attribute(const std::string& name) {
        if (bytes_.ConsumeIntegralInRange(0, 7) == 1) return attribute(name, 1, H5T_NATIVE_INT);
        const std::string text = bytes_.ConsumeRandomLengthString(20);
        const hdf5::Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
        H5Tset_size(type, bytes_.ConsumeIntegralInRange(0, 7) == 1 ? H5T_VARIABLE : text.size() + 1);
        const hdf5::Handle space(H5Screate(H5S_SCALAR), H5Sclose);
        const hdf5::Handle made(H5Acreate2(file_, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
        const char* start = text.c_str();
        if (made.valid()) H5Awrite(made, type, H5Tis_variable_str(type) > 0 ? static_cast<const void*>(&start) : start);
    }

    // A list of texts of some length, fixed unless the fuzzer has other plans.
    void texts(const std::string& name, hsize_t count) {
        const int plan = bytes_.ConsumeIntegralInRange(0, 7);
        if (plan == 1) return dataset(name, {count}, std::vector<double>(count, 1), true);
        if (plan == 2) count = any_extent();
        const std::string all = bytes_.ConsumeRandomLengthString(20);
        const hdf5::Handle type(H5Tcopy(H5T_C_S1), H5Tclose), links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
        H5Tset_size(type, plan == 3 ? H5T_VARIABLE : bytes_.ConsumeIntegralInRange<std::size_t>(1, 10));
        H5Pset_create_intermediate_group(links, 1);
        const hdf5::Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose);
        const hdf5::Handle made(H5Dcreate2(file_, name.c_str(), type, space, links, H5P_DEFAULT, H5P_DEFAULT),
                                H5Dclose);
        if (!made.valid() || plan == 3 || count * H5Tget_size(type) > all.size()) return;
        H5Dwrite(made, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data());
    }

    void save(const MemoryFile& to) const {
        H5Fflush(file_, H5F_SCOPE_GLOBAL);
        std::string image(static_cast<std::size_t>(H5Fget_file_image(file_, nullptr, 0)), '\0');
        H5Fget_file_image(file_, image.data(), image.size());
        to.fill(image.data(), image.size());
    }

  private:
    hsize_t any_extent() {
        constexpr hsize_t extents[]{
            0, 1, 2, 3, 4, 5, 6, 9, 12, 100, 1 << 20, 1u << 31, hsize_t{1} << 32, hsize_t{1} << 60};
        return bytes_.PickValueInArray(extents);
    }
    double any_value(bool integer) {
        if (integer)
            return bytes_.ConsumeBool() ? bytes_.ConsumeIntegral<std::int32_t>()
                                        : bytes_.ConsumeIntegralInRange(-3, 12);
        if (bytes_.ConsumeBool()) return bytes_.ConsumeFloatingPoint<double>();
        constexpr double values[]{0, -0.0, 1, -1, 0.5, 1e-300, 1e300, -1e300, 1e-8, HUGE_VAL, -HUGE_VAL, NAN};
        return bytes_.PickValueInArray(values);
    }
    hid_t any_type() {
        const hid_t types[]{H5T_NATIVE_FLOAT, H5T_NATIVE_SCHAR, H5T_STD_I64BE, H5T_NATIVE_UINT64,
                            H5T_C_S1,         H5T_STD_REF_OBJ,  H5T_NATIVE_B8, H5T_NATIVE_LDOUBLE};
        return types[bytes_.ConsumeIntegralInRange<std::size_t>(0, std::size(types) - 1)];
    }

    void write(const std::string& name, const hdf5::Shape& shape, const std::vector<double>& values, hid_t type) {
        const hdf5::Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose),
            creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
        H5Pset_create_intermediate_group(links, 1);
        hsize_t count = 1;
        for (const hsize_t extent : shape) count *= std::min<hsize_t>(extent, 1 << 20);
        const bool stored_elsewhere = count <= 100 && bytes_.ConsumeIntegralInRange(0, 15) == 1;
        if (stored_elsewhere) H5Pset_external(creation, "/dev/zero", 0, H5F_UNLIMITED);
        const bool sparse = count > 10000, chunked = sparse || bytes_.ConsumeIntegralInRange(0, 7) == 1;
        if (chunked && !stored_elsewhere && !shape.empty()) {
            hdf5::Shape chunk(shape.size(), 1);
            for (std::size_t d = 0; d < shape.size(); ++d)
                chunk[d] = std::clamp<hsize_t>(bytes_.ConsumeIntegralInRange<hsize_t>(0, 1 << 20), 1,
                                               std::max<hsize_t>(shape[d], 1));
            H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
            if (bytes_.ConsumeBool()) H5Pset_deflate(creation, 4);
        }
        const hdf5::Handle space(shape.empty()
                                     ? H5Screate(H5S_SCALAR)
                                     : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr),
                                 H5Sclose);
        const hid_t made = H5Dcreate2(file_, name.c_str(), type, space, links, creation, H5P_DEFAULT);
        if (sparse || stored_elsewhere) {  // declared, never written
            if (made >= 0) H5Dclose(made);
            return;
        }
        std::vector<double> filled = values;
        filled.resize(count, 1);
        put(
            made, std::move(filled),
            [](hid_t id, hid_t memory, const void* from) {
                return H5Dwrite(id, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, from);
            },
            H5Dclose);
    }

    // To what no reader may follow.
    void link(const std::string& name, bool soft) const {
        const hdf5::Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
        H5Pset_create_intermediate_group(links, 1);
        if (soft)
            H5Lcreate_soft("/x", file_, name.c_str(), links, H5P_DEFAULT);
        else
            H5Lcreate_external("/dev/zero", "/x", file_, name.c_str(), links, H5P_DEFAULT);
    }

    static void put(hid_t id, const std::vector<double>& values, auto&& write, herr_t (*close)(hid_t)) {
        if (id < 0) return;
        write(id, H5T_NATIVE_DOUBLE, values.data());  // refused for types that no number becomes: left as created
        close(id);
    }

    FuzzedDataProvider& bytes_;
    hid_t file_;
};

}  // namespace nscdd::fuzz
