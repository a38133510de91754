// A thin layer over the HDF5 C library: datasets, whole or by rows, and attributes, with errors that name file and
// dataset.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "files/error.hpp"
#include "files/hdf5_driver.hpp"
#include "files/replace_file.hpp"

namespace nscdd::hdf5 {

using Shape = std::vector<hsize_t>;

std::string to_string(const Shape& shape);  // "(5000, 3)"

// Rows of a dataset from `begin` up to but without `end`; by default all that it has.
struct Rows {
    hsize_t begin = 0, end = std::numeric_limits<hsize_t>::max();
};

// Owns an HDF5 identifier and closes it with the function that fits its kind.
class Handle {
  public:
    using Close = herr_t (*)(hid_t);

    Handle(hid_t id, Close how) : id_(id), close_(how) {}
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
    Handle& operator=(Handle&&) = delete;
    ~Handle() {
        if (id_ >= 0) close_(id_);
    }

    operator hid_t() const { return id_; }
    bool valid() const { return id_ >= 0; }
    herr_t close() { return id_ >= 0 ? close_(std::exchange(id_, H5I_INVALID_HID)) : 0; }

  private:
    hid_t id_;
    Close close_;
};

class Reader {
  public:
    // Throws InputError for a file that is missing, unreadable, not a regular one, not HDF5, damaged or truncated.
    explicit Reader(const std::string& path);

    // Whether there is a group or dataset of that name, "group/name". Throws InputError for a soft or external link.
    bool has(const std::string& object) const;

    // Extents of a dataset. Throws InputError when there is no such dataset.
    Shape shape(const std::string& dataset) const;

    // Values of some rows in C order, T = double (from any real or integer type; must be finite) or int (from
    // integers). `expected`: the shape of the whole dataset. Throws InputError when the dataset is missing, unreadable,
    // of another type or shape, or stored in another file: external storage, virtual datasets.
    template <class T>
    std::vector<T> read(const std::string& dataset, const Shape& expected, Rows rows = {}) const;

    // A list of texts of fixed length. Throws InputError as `read` does.
    std::vector<std::string> texts(const std::string& dataset, hsize_t expected) const;

    // Root attribute, T = double (finite), std::int64_t or std::string. Throws InputError as `read` does.
    template <class T>
    T attribute(const std::string& name) const;

    // "<file>: dataset '<dataset>': <problem>", for checks of the values themselves.
    InputError error(const std::string& dataset, const std::string& problem) const;

  private:
    friend class Writer;

    Handle open(const std::string& dataset) const;
    void require_stored(const std::string& dataset, hid_t handle, const Shape& shape, std::size_t bytes_a_value) const;
    Handle open_attribute(const std::string& name) const;
    InputError attribute_error(const std::string& name, const std::string& problem) const;

    std::string path_;
    Handle file_;
};

// Writes to a file beside its place, which it takes when the set is committed.
class Writer {
  public:
    // Throws OutputError. Without `files` the writer has a set of its own, which save() commits. A file that the set
    // has already is written on.
    explicit Writer(std::string path);
    Writer(FileSet& files, std::string path);
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;

    // Values in C order, T = double or int; datasets from 64 KiB are chunked and deflated. "group/name" makes the
    // group.
    template <class T>
    void write(const std::string& dataset, const std::vector<T>& values, const Shape& shape);

    // A dataset in pieces: declare() its shape, then append() rows, each time behind those that it has.
    template <class T>
    void declare(const std::string& dataset, const Shape& shape);
    template <class T>
    void append(const std::string& dataset, const std::vector<T>& values);

    // A list of texts, null-terminated, of one fixed length.
    void texts(const std::string& dataset, const std::vector<std::string>& values);

    // Scalar string of fixed length, null-terminated.
    void text(const std::string& dataset, const std::string& value);

    // A group of another file, with all that is in it. Throws InputError for links and datasets that lead out of that
    // file.
    void copy(const Reader& source, const std::string& group);

    // Sets an attribute of the root or of a group, which is made if there is none. An attribute of that name is
    // replaced.
    void attribute(const std::string& name, double value, const std::string& group = "/");
    void attribute(const std::string& name, std::int64_t value, const std::string& group = "/");
    void attribute(const std::string& name, const std::string& value, const std::string& group = "/");

    // Throws OutputError, also where a dataset lacks rows; an old file is then left as it was.
    void save();
    const std::vector<ByteRange>& written() const { return disk_.written; }  // by this writer

  private:
    struct Growing {
        Handle dataset;
        Shape shape;
        hsize_t rows = 0;  // written
    };

    OutputError error(const std::string& thing) const;
    void check_disk() const;
    void write_attribute(const std::string& group, const std::string& name, hid_t type, const void* value);

    std::string path_;
    FileSet own_;
    Disk disk_;
    bool commits_;
    Handle file_;
    std::map<std::string, Growing> growing_;
};

}  // namespace nscdd::hdf5
