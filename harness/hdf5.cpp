#include "hdf5.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <type_traits>

#include "replace_file.hpp"

namespace nscdd::hdf5 {
namespace {

template <class T>
hid_t native_type() {
    if constexpr (std::is_same_v<T, double>)
        return H5T_NATIVE_DOUBLE;
    else if constexpr (std::is_same_v<T, std::int64_t>)
        return H5T_NATIVE_INT64;
    else
        return H5T_NATIVE_INT;
}

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

// Number of values; the largest number there is when that is too small for it.
hsize_t count(const Shape& shape) {
    constexpr hsize_t most = std::numeric_limits<hsize_t>::max();
    if (std::find(shape.begin(), shape.end(), 0) != shape.end()) return 0;
    return std::accumulate(shape.begin(), shape.end(), hsize_t{1}, [](hsize_t product, hsize_t extent) {
        return extent > most / product ? most : product * extent;
    });
}

// Bytes that reading a dataset takes in memory are declared, not stored: what was never written reads as the fill
// value, and deflate shrinks by 1032 at most. May a file whose dataset is stored in so many bytes declare so many?
bool plausible(hsize_t declared, hsize_t stored) {
    constexpr hsize_t harmless = hsize_t{1} << 26;
    return declared <= harmless || declared / 2000 <= stored;
}

// Of the chunks that it is stored in; 0 where there are none.
hsize_t chunk_values(hid_t dataset, std::size_t rank) {
    const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
    if (H5Pget_layout(creation) != H5D_CHUNKED) return 0;
    Shape chunk(rank);
    return H5Pget_chunk(creation, static_cast<int>(rank), chunk.data()) < 0 ? 0 : count(chunk);
}

// Of fixed length, terminated: those of variable length are kept in a heap of the file, and the library crashes or
// never ends when that is damaged.
Handle string_type(std::size_t length) {
    Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(type, length + 1);
    H5Tset_cset(type, H5T_CSET_UTF8);
    return type;
}

Handle creating_groups() {
    Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    H5Pset_create_intermediate_group(links, 1);
    return links;
}

enum class Found { nothing, here, elsewhere };

// Also when a group on the way is missing. Links other than hard ones may lead to other files, soft ones by way of
// external ones, and are never followed: a packing could bring any file of its reader's into the results.
Found find(hid_t file, const std::string& object) {
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
bool stored_here(hid_t dataset) {
    const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
    return H5Pget_layout(creation) != H5D_VIRTUAL && H5Pget_external_count(creation) == 0;
}

// H5Lvisit: stops at the first link that leads elsewhere, or to a dataset that is stored elsewhere.
herr_t leads_elsewhere(hid_t group, const char* name, const H5L_info_t* info, void*) {
    if (info->type != H5L_TYPE_HARD) return 1;
    const Handle object(H5Oopen(group, name, H5P_DEFAULT), H5Oclose);
    return object.valid() && H5Iget_type(object) == H5I_DATASET && !stored_here(object) ? 1 : 0;
}

// The library would print its whole error stack; our one line replaces it.
void silence() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

hid_t open_for_reading(const std::string& path) {
    silence();
    require_regular_file(path);
    if (H5Fis_hdf5(path.c_str()) <= 0) throw InputError(fmt::format("{}: is not an HDF5 file", path));
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) throw InputError(fmt::format("{}: is a truncated or damaged HDF5 file", path));
    return file;
}

hid_t create_in_memory(const std::string& path) {
    silence();
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_fapl_core(access, 1 << 20, false);
    return H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);  // a name alone, no file
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
std::vector<T> Reader::read(const std::string& dataset, const Shape& expected) const {
    const Shape found = shape(dataset);
    if (found != expected)
        throw error(dataset, fmt::format("must have shape {}, found {}", to_string(expected), to_string(found)));

    const Handle handle = open(dataset);
    const Handle type(H5Dget_type(handle), H5Tclose);
    if (!converts<T>(type)) throw error(dataset, fmt::format("must hold {}", kind_name<T>()));

    require_stored(dataset, handle, found, std::max(sizeof(T), H5Tget_size(type)));

    std::vector<T> values(count(found));
    if (H5Dread(handle, native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
        throw error(dataset, "cannot be read: the file is damaged");
    if constexpr (std::is_same_v<T, double>) {
        const auto bad = std::find_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); });
        if (bad != values.end()) {
            const auto row_length = static_cast<std::ptrdiff_t>(found.size() > 1 ? found[1] : 1);
            throw error(dataset,
                        fmt::format("row {} is not finite, found {}", (bad - values.begin()) / row_length, *bad));
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

Writer::Writer(std::string path) : path_(std::move(path)), file_(create_in_memory(path_), H5Fclose) {
    if (!file_.valid()) throw error("the file");
}

OutputError Writer::error(const std::string& thing) const {
    return OutputError(fmt::format("{}: cannot write: the HDF5 library refused {}", path_, thing));
}

template <class T>
void Writer::write(const std::string& dataset, const std::vector<T>& values, const Shape& shape) {
    if (values.size() != count(shape))
        throw OutputError(fmt::format("{}: dataset '{}': {} values do not fill shape {}", path_, dataset, values.size(),
                                      to_string(shape)));
    const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
    const Handle links = creating_groups();
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_obj_track_times(creation, false);  // equal data give equal bytes
    if (values.size() * sizeof(T) >= 65536) {
        Shape chunk = shape;
        chunk[0] = std::min<hsize_t>(chunk[0], 16384);
        H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
        H5Pset_shuffle(creation);
        H5Pset_deflate(creation, 4);
    }
    const Handle handle(H5Dcreate2(file_, dataset.c_str(), native_type<T>(), space, links, creation, H5P_DEFAULT),
                        H5Dclose);
    if (!handle.valid() || H5Dwrite(handle, native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
        throw error(fmt::format("dataset '{}'", dataset));
}

void Writer::texts(const std::string& dataset, const std::vector<std::string>& values) {
    std::size_t longest = 0;
    for (const auto& value : values) longest = std::max(longest, value.size());
    std::string all;
    for (const auto& value : values) {
        all += value;
        all.resize(all.size() + longest + 1 - value.size());
    }
    const Handle type = string_type(longest);
    const hsize_t extent = values.size();
    const Handle space(H5Screate_simple(1, &extent, nullptr), H5Sclose);
    const Handle links = creating_groups();
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_obj_track_times(creation, false);  // equal data give equal bytes
    const Handle handle(H5Dcreate2(file_, dataset.c_str(), type, space, links, creation, H5P_DEFAULT), H5Dclose);
    if (!handle.valid() || H5Dwrite(handle, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) < 0)
        throw error(fmt::format("dataset '{}'", dataset));
}

void Writer::text(const std::string& dataset, const std::string& value) {
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);  // ASCII, as libfclib reads it
    H5Tset_size(type, value.size() + 1);
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    const Handle links = creating_groups();
    const Handle handle(H5Dcreate2(file_, dataset.c_str(), type, space, links, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
    if (!handle.valid() || H5Dwrite(handle, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value.c_str()) < 0)
        throw error(fmt::format("dataset '{}'", dataset));
}

void Writer::copy(const Reader& source, const std::string& group) {
    if (source.has(group) && H5Lvisit_by_name(source.file_, group.c_str(), H5_INDEX_NAME, H5_ITER_NATIVE,
                                              leads_elsewhere, nullptr, H5P_DEFAULT) != 0)
        throw source.error(group, "holds something of another file, which is not read");
    const Handle links = creating_groups();
    if (H5Ocopy(source.file_, group.c_str(), file_, group.c_str(), H5P_DEFAULT, links) < 0)
        throw error(fmt::format("a copy of group '{}'", group));
}

void Writer::write_attribute(const std::string& group, const std::string& name, hid_t type, const void* value) {
    if (group != "/" && find(file_, group) == Found::nothing) {
        const Handle links = creating_groups();
        const Handle made(H5Gcreate2(file_, group.c_str(), links, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    }
    if (H5Aexists_by_name(file_, group.c_str(), name.c_str(), H5P_DEFAULT) > 0)
        H5Adelete_by_name(file_, group.c_str(), name.c_str(), H5P_DEFAULT);
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    const Handle handle(
        H5Acreate_by_name(file_, group.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        H5Aclose);
    if (!handle.valid() || H5Awrite(handle, type, value) < 0) throw error(fmt::format("attribute '{}'", name));
}

void Writer::attribute(const std::string& name, double value, const std::string& group) {
    write_attribute(group, name, H5T_NATIVE_DOUBLE, &value);
}

void Writer::attribute(const std::string& name, std::int64_t value, const std::string& group) {
    write_attribute(group, name, H5T_NATIVE_INT64, &value);
}

void Writer::attribute(const std::string& name, const std::string& value, const std::string& group) {
    write_attribute(group, name, string_type(value.size()), value.c_str());
}

std::string Writer::save(FileSet& files) {
    H5Fflush(file_, H5F_SCOPE_GLOBAL);
    const ssize_t size = H5Fget_file_image(file_, nullptr, 0);
    if (size < 0) throw error("the file image");
    std::string image(static_cast<std::size_t>(size), '\0');
    if (H5Fget_file_image(file_, image.data(), image.size()) < 0) throw error("the file image");
    files.add(path_, image);
    return checksum(image);
}

void Writer::save() {
    FileSet files;
    save(files);
    files.commit();
}

template std::vector<double> Reader::read(const std::string&, const Shape&) const;
template std::vector<int> Reader::read(const std::string&, const Shape&) const;
template double Reader::attribute(const std::string&) const;
template std::int64_t Reader::attribute(const std::string&) const;
template std::string Reader::attribute(const std::string&) const;
template void Writer::write(const std::string&, const std::vector<double>&, const Shape&);
template void Writer::write(const std::string&, const std::vector<int>&, const Shape&);

}  // namespace nscdd::hdf5
