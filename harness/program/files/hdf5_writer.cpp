#include <fmt/format.h>

#include <cstring>

#include "files/hdf5_detail.hpp"

namespace nscdd::hdf5 {
namespace {

// Strings of fixed length, terminated: strings of variable length are kept in a heap of the file, and the library
// crashes or never ends when that is damaged.
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

// H5Lvisit: stops at the first link that leads elsewhere, or to a dataset that is stored elsewhere.
herr_t leads_elsewhere(hid_t group, const char* name, const H5L_info_t* info, void*) {
    if (info->type != H5L_TYPE_HARD) return 1;
    const Handle object(H5Oopen(group, name, H5P_DEFAULT), H5Oclose);
    return object.valid() && H5Iget_type(object) == H5I_DATASET && !stored_here(object) ? 1 : 0;
}

// there: whether the file has something, which stays.
hid_t open(const std::string& part, Disk& disk, bool there) {
    silence();
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    Disk* const told = &disk;
    H5Pset_driver(access, forbearing_driver(), &told);
    return there ? H5Fopen(part.c_str(), H5F_ACC_RDWR, access)
                 : H5Fcreate(part.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
}

}  // namespace

Writer::Writer(std::string path)
    : path_(std::move(path)), commits_(true), file_(open(own_.begin(path_), disk_, false), H5Fclose) {
    if (!file_.valid()) throw error("the file");
}

Writer::Writer(FileSet& files, std::string path)
    : path_(std::move(path)),
      commits_(false),
      file_(files.has(path_) ? open(files.part(path_), disk_, true) : open(files.begin(path_), disk_, false),
            H5Fclose) {
    if (!file_.valid()) throw error("the file");
}

OutputError Writer::error(const std::string& thing) const {
    return OutputError(fmt::format("{}: cannot write: the HDF5 library refused {}", path_, thing));
}

void Writer::check_disk() const {
    if (disk_.error != 0) throw OutputError(fmt::format("{}: cannot write: {}", path_, std::strerror(disk_.error)));
}

template <class T>
void Writer::write(const std::string& dataset, const std::vector<T>& values, const Shape& shape) {
    if (values.size() != count(shape))
        throw OutputError(fmt::format("{}: dataset '{}': {} values do not fill shape {}", path_, dataset, values.size(),
                                      to_string(shape)));
    declare<T>(dataset, shape);
    append(dataset, values);
}

template <class T>
void Writer::declare(const std::string& dataset, const Shape& shape) {
    const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
    const Handle links = creating_groups();
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_obj_track_times(creation, false);  // equal data give equal bytes
    if (count(shape) * sizeof(T) >= 65536) {
        Shape chunk = shape;
        chunk[0] = std::min<hsize_t>(chunk[0], 16384);
        H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
        H5Pset_shuffle(creation);
        H5Pset_deflate(creation, 4);
    }
    Handle handle(H5Dcreate2(file_, dataset.c_str(), native_type<T>(), space, links, creation, H5P_DEFAULT), H5Dclose);
    if (!handle.valid()) throw error(fmt::format("dataset '{}'", dataset));
    if (count(shape) > 0) growing_.emplace(dataset, Growing{std::move(handle), shape});
}

template <class T>
void Writer::append(const std::string& dataset, const std::vector<T>& values) {
    if (values.empty()) return;
    const auto at = growing_.find(dataset);
    const auto refuse = [&] {
        throw OutputError(fmt::format("{}: dataset '{}': {} values are no rows of it, or more than were declared",
                                      path_, dataset, values.size()));
    };
    if (at == growing_.end()) refuse();
    Growing& growing = at->second;
    const hsize_t row = count(growing.shape) / growing.shape[0];
    Shape extent = growing.shape, first(extent.size(), 0);
    extent[0] = values.size() / row;
    first[0] = growing.rows;
    if (values.size() % row != 0 || extent[0] > growing.shape[0] - growing.rows) refuse();
    const Handle memory(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose),
        space(H5Dget_space(growing.dataset), H5Sclose);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, first.data(), nullptr, extent.data(), nullptr);
    if (H5Dwrite(growing.dataset, native_type<T>(), memory, space, H5P_DEFAULT, values.data()) < 0)
        throw error(fmt::format("dataset '{}'", dataset));
    growing.rows += extent[0];
    if (growing.rows == growing.shape[0]) growing_.erase(at);
    check_disk();
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

void Writer::save() {
    if (!growing_.empty()) {
        const auto& [dataset, growing] = *growing_.begin();
        throw OutputError(fmt::format("{}: dataset '{}': {} of {} rows were written", path_, dataset, growing.rows,
                                      growing.shape[0]));
    }
    const bool closed = file_.close() >= 0;
    check_disk();
    if (!closed) throw error("the file");
    if (commits_) own_.commit();
}

template void Writer::write(const std::string&, const std::vector<double>&, const Shape&);
template void Writer::write(const std::string&, const std::vector<int>&, const Shape&);
template void Writer::declare<double>(const std::string&, const Shape&);
template void Writer::declare<int>(const std::string&, const Shape&);
template void Writer::append(const std::string&, const std::vector<double>&);
template void Writer::append(const std::string&, const std::vector<int>&);

}  // namespace nscdd::hdf5
