#include "files/hdf5_driver.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

namespace nscdd::hdf5 {
namespace {

struct File : H5FD_t {
    int descriptor = -1;
    Disk* disk = nullptr;
    haddr_t end_of_addresses = 0, end_of_file = 0;
};

File& mine(H5FD_t* file) { return *static_cast<File*>(file); }
const File& mine(const H5FD_t* file) { return *static_cast<const File*>(file); }

// Opens the file, which is there already (FileSet).
H5FD_t* open_file(const char* name, unsigned, hid_t access, haddr_t) {
    const auto* disk = static_cast<Disk* const*>(H5Pget_driver_info(access));
    const int descriptor = disk ? ::open(name, O_RDWR | O_CLOEXEC) : -1;
    if (descriptor < 0) return nullptr;
    auto file = std::make_unique<File>();
    file->descriptor = descriptor;
    file->disk = *disk;
    const off_t size = ::lseek(descriptor, 0, SEEK_END);
    file->end_of_file = size > 0 ? static_cast<haddr_t>(size) : 0;
    return file.release();
}

herr_t close_file(H5FD_t* closed) {
    const std::unique_ptr<File> file(&mine(closed));
    if (::close(file->descriptor) != 0 && file->disk->error == 0) file->disk->error = errno;
    return 0;
}

herr_t query(const H5FD_t*, unsigned long* features) {
    *features = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
                H5FD_FEAT_AGGREGATE_SMALLDATA;
    return 0;
}

haddr_t end_of_addresses(const H5FD_t* file, H5FD_mem_t) { return mine(file).end_of_addresses; }
haddr_t end_of_file(const H5FD_t* file, H5FD_mem_t) { return mine(file).end_of_file; }
herr_t set_end_of_addresses(H5FD_t* file, H5FD_mem_t, haddr_t end) {
    mine(file).end_of_addresses = end;
    return 0;
}

// Reads zeros behind the end of the file, and where writing failed.
herr_t read(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t address, size_t size, void* buffer) {
    auto* to = static_cast<char*>(buffer);
    while (size > 0) {
        const ssize_t count = ::pread(mine(file).descriptor, to, size, static_cast<off_t>(address));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) break;
        to += count, size -= static_cast<size_t>(count), address += static_cast<haddr_t>(count);
    }
    std::memset(to, 0, size);
    return 0;
}

herr_t write(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t address, size_t size, const void* buffer) {
    File& to = mine(file);
    const auto* from = static_cast<const char*>(buffer);
    to.end_of_file = std::max<haddr_t>(to.end_of_file, address + size);
    to.disk->written.push_back({address, size});
    while (size > 0 && to.disk->error == 0) {
        const ssize_t count = ::pwrite(to.descriptor, from, size, static_cast<off_t>(address));
        if (count < 0 && errno != EINTR) to.disk->error = errno;
        if (count > 0) from += count, size -= static_cast<size_t>(count), address += static_cast<haddr_t>(count);
    }
    return 0;
}

herr_t truncate(H5FD_t* file, hid_t, hbool_t) {
    File& f = mine(file);
    if (f.end_of_addresses != f.end_of_file && f.disk->error == 0 &&
        ::ftruncate(f.descriptor, static_cast<off_t>(f.end_of_addresses)) != 0)
        f.disk->error = errno;
    f.end_of_file = f.end_of_addresses;
    return 0;
}

}  // namespace

hid_t forbearing_driver() {
    static const H5FD_class_t driver{.name = "nscdd",
                                     .maxaddr = HADDR_MAX / 4,  // of off_t
                                     .fc_degree = H5F_CLOSE_STRONG,
                                     .terminate = nullptr,
                                     .sb_size = nullptr,
                                     .sb_encode = nullptr,
                                     .sb_decode = nullptr,
                                     .fapl_size = sizeof(Disk*),
                                     .fapl_get = nullptr,
                                     .fapl_copy = nullptr,
                                     .fapl_free = nullptr,
                                     .dxpl_size = 0,
                                     .dxpl_copy = nullptr,
                                     .dxpl_free = nullptr,
                                     .open = open_file,
                                     .close = close_file,
                                     .cmp = nullptr,
                                     .query = query,
                                     .get_type_map = nullptr,
                                     .alloc = nullptr,
                                     .free = nullptr,
                                     .get_eoa = end_of_addresses,
                                     .set_eoa = set_end_of_addresses,
                                     .get_eof = end_of_file,
                                     .get_handle = nullptr,
                                     .read = read,
                                     .write = write,
                                     .flush = nullptr,
                                     .truncate = truncate,
                                     .lock = nullptr,
                                     .unlock = nullptr,
                                     .fl_map = H5FD_FLMAP_DICHOTOMY};
    static const hid_t id = H5FDregister(&driver);
    return id;
}

}  // namespace nscdd::hdf5
