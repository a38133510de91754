#include <fmt/format.h>

#include <cmath>

#include "files/hdf5_detail.hpp"

namespace nscdd::hdf5 {
namespace {

// Reals may come from integers, integers from integers alone.
template <class T>
bool converts(hid_t type) {
    const H5T_class_t kind = H5Tget_class(type);
    return kind == H5T_INTEGER || (std::is_same_v<T, double> && kind == H5T_FLOAT);
}

template <class T>
const char* kind_name() {
    return std::is_same_v<T, double> ? "numbers" : "integers";
}

// A dataset declares how many bytes reading it takes, it need not store them: what was never written reads as the fill
// value, and deflate shrinks by 1032 at most. True if a dataset stored in `stored` bytes may declare `declared`.
bool plausible(hsize_t declared, hsize_t stored) {
    constexpr hsize_t harmless = hsize_t{1} << 26;
    return declared <= harmless || declared / 2000 <= stored;
}

// Number of values in a chunk of the dataset; 0 where it is not stored in chunks.
hsize_t chunk_values(hid_t dataset, std::size_t rank) {
    const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
    if (H5Pget_layout(creation) != H5D_CHUNKED) return 0;
    Shape chunk(rank);
    return H5Pget_chunk(creation, static_cast<int>(rank), chunk.data()) < 0 ? 0 : count(chunk);
}

hid_t open_for_reading(const std::string& path) {
    silence();
    require_regular_file(path);
    if (H5Fis_hdf5(path.c_str()) <= 0) throw InputError(fmt::format("{}: is not an HDF5 file", path));
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) throw InputError(fmt::format("{}: is a truncated or damaged HDF5 file", path));
    return file;
}

}  // namespace

std::string to_string(const Shape& shape) { return fmt::format("({})", fmt::join(shape, ", ")); }

Reader::Reader(const std::string& path) : path_(path), file_(open_for_reading(path), H5Fclose) {}

InputError Reader::error(const std::string& dataset, const std::string& problem) const {
    return InputError(fmt::format("{}: dataset '{}': {}", path_, dataset, problem));
}

InputError Reader::attribute_error(const std::string& name, const std::string& problem) const {
    return InputError(fmt::format("{}: attribute '{}': {}", path_, name, problem));
}

Handle Reader::open(const std::string& dataset) const {
    if (!has(dataset)) throw error(dataset, "is missing");
    Handle handle(H5Dopen2(file_, dataset.c_str(), H5P_DEFAULT), H5Dclose);
    if (!handle.valid()) throw error(dataset, "is missing");
    if (!stored_here(handle)) throw error(dataset, "is stored in another file, which is not read");
    return handle;
}

Handle Reader::open_attribute(const std::string& name) const {
    Handle handle(H5Aopen(file_, name.c_str(), H5P_DEFAULT), H5Aclose);
    if (!handle.valid()) throw attribute_error(name, "is missing");
    return handle;
}

bool Reader::has(const std::string& object) const {
    const Found found = find(file_, object);
    if (found == Found::elsewhere) throw error(object, "is a soft or external link, which is not followed");
    return found == Found::here;
}

Shape Reader::shape(const std::string& dataset) const {
    const Handle handle = open(dataset);
    const Handle space(H5Dget_space(handle), H5Sclose);
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank < 0) throw error(dataset, "cannot be read");
    Shape shape(static_cast<std::size_t>(rank));
    H5Sget_simple_extent_dims(space, shape.data(), nullptr);
    return shape;
}

void Reader::require_stored(const std::string& dataset, hid_t handle, const Shape& shape,
                            std::size_t bytes_a_value) const {
    const hsize_t stored = H5Dget_storage_size(handle), largest = std::numeric_limits<hsize_t>::max() / 65536;
    const hsize_t declared = std::max(count(shape), chunk_values(handle, shape.size()));
    if (declared > largest || !plausible(declared * bytes_a_value, stored))
        throw error(dataset, fmt::format("declares shape {}, but only {} bytes are stored", to_string(shape), stored));
}

std::vector<std::string> Reader::texts(const std::string& dataset, hsize_t expected) const {
    if (const Shape found = shape(dataset); found != Shape{expected})
        throw error(dataset, fmt::format("must have shape ({}), found {}", expected, to_string(found)));
    const Handle handle = open(dataset);
    const Handle type(H5Dget_type(handle), H5Tclose);
    const std::size_t size = H5Tget_size(type);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || size > 65536)
        throw error(dataset, "must hold strings of fixed length");
    require_stored(dataset, handle, {expected}, size);
    std::string all(expected * size, '\0');
    if (H5Dread(handle, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) < 0)
        throw error(dataset, "cannot be read: the file is damaged");
    std::vector<std::string> values;
    for (std::size_t at = 0; at < all.size(); at += size) {
        const std::string& value = values.emplace_back(all, at, size);
        values.back().resize(std::min(value.find('\0'), size));
    }
    return values;
}

template <class T>
std::vector<T> Reader::read(const std::string& dataset, const Shape& expected, Rows rows) const {
    const Shape found = shape(dataset);
    if (found != expected)
        throw error(dataset, fmt::format("must have shape {}, found {}", to_string(expected), to_string(found)));

    const Handle handle = open(dataset);
    const Handle type(H5Dget_type(handle), H5Tclose);
    if (!converts<T>(type)) throw error(dataset, fmt::format("must hold {}", kind_name<T>()));

    require_stored(dataset, handle, found, std::max(sizeof(T), H5Tget_size(type)));

    Shape first(found.size(), 0), extent = found;
    if (!found.empty()) {
        first[0] = std::min(rows.begin, found[0]);
        extent[0] = std::max(std::min(rows.end, found[0]), first[0]) - first[0];
    }
    std::vector<T> values(count(extent));
    const Handle memory(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose),
        space(H5Dget_space(handle), H5Sclose);
    if (!found.empty()) H5Sselect_hyperslab(space, H5S_SELECT_SET, first.data(), nullptr, extent.data(), nullptr);
    if (!values.empty() && H5Dread(handle, native_type<T>(), memory, space, H5P_DEFAULT, values.data()) < 0)
        throw error(dataset, "cannot be read: the file is damaged");
    if constexpr (std::is_same_v<T, double>) {
        const auto bad = std::find_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); });
        if (bad != values.end()) {
            const hsize_t row_length = found.size() > 1 ? found[1] : 1;
            const hsize_t row =
                (found.empty() ? 0 : first[0]) + static_cast<hsize_t>(bad - values.begin()) / row_length;
            throw error(dataset, fmt::format("row {} is not finite, found {}", row, *bad));
        }
    }
    return values;
}

template <class T>
T Reader::attribute(const std::string& name) const {
    const Handle handle = open_attribute(name);
    const Handle type(H5Aget_type(handle), H5Tclose);
    const Handle space(H5Aget_space(handle), H5Sclose);
    if (H5Sget_simple_extent_npoints(space) != 1) throw attribute_error(name, "must hold one value");

    if constexpr (std::is_same_v<T, std::string>) {
        const std::size_t size = H5Tget_size(type);
        if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || size > 65536)
            throw attribute_error(name, "must hold a string of fixed length");
        std::string value(size, '\0');
        if (H5Aread(handle, type, value.data()) < 0) throw attribute_error(name, "cannot be read");
        value.resize(std::min(value.find('\0'), size));
        return value;
    } else {
        T value{};
        if (!converts<T>(type)) throw attribute_error(name, fmt::format("must hold {}", kind_name<T>()));
        if (H5Aread(handle, native_type<T>(), &value) < 0) throw attribute_error(name, "cannot be read");
        if constexpr (std::is_same_v<T, double>)
            if (!std::isfinite(value)) throw attribute_error(name, fmt::format("must be finite, found {}", value));
        return value;
    }
}

template std::vector<double> Reader::read(const std::string&, const Shape&, Rows) const;
template std::vector<int> Reader::read(const std::string&, const Shape&, Rows) const;
template double Reader::attribute(const std::string&) const;
template std::int64_t Reader::attribute(const std::string&) const;
template std::string Reader::attribute(const std::string&) const;

}  // namespace nscdd::hdf5
