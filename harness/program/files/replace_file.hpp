// The one way in which the harness writes files.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace nscdd {

// Some bytes of a file.
struct ByteRange {
    std::uint64_t begin, size;
};

// Files that take their places together. Each is written beside its place under a name that no other process uses,
// PATH.*.part; commit() renames them all. A reader meets the old file or the whole new one, and where one file cannot
// be written no old one is replaced. A symbolic link stays, the file that it leads to is replaced. New files have the
// mode that the umask gives, others keep theirs.
class FileSet {
  public:
    FileSet() = default;
    ~FileSet();  // removes what was not committed
    FileSet(const FileSet&) = delete;
    FileSet& operator=(const FileSet&) = delete;

    // Each throws OutputError.
    void add(const std::string& path, std::string_view bytes);
    // Makes the file beside its place, empty, for the caller to write and close before commit(); returns its name.
    std::string begin(const std::string& path);
    bool has(const std::string& path) const;
    const std::string& part(const std::string& path) const;  // the name that begin() returned, or the copy's
    std::string checksum(const std::string& path) const;     // of a file of the set as it is now
    // The file takes its place now, whole, before the others and without waiting for the disk. Where it is written on,
    // the set keeps a copy beside it: `written` has what was written since the file was begun or placed.
    void place(const std::string& path, const std::vector<ByteRange>* written = nullptr);
    // What has been written is on the disk before the first file takes its place.
    void commit();

  private:
    struct Part {
        std::string path, target, part;
        std::optional<struct stat> placed = {};  // as it was when it took its place
    };
    const Part& find(const std::string& path) const;
    void make(const std::string& path, const auto& fill);

    std::vector<Part> parts_;
};

// Replaces one file, as a FileSet of it does.
void replace_file(const std::string& path, std::string_view bytes);

// Tells files apart: FNV-1a of 64 bits, as 16 hexadecimal digits.
std::string checksum(std::string_view bytes);
std::string checksum_of_file(const std::string& path);  // throws InputError

// Whether two names are of one file, which need not exist yet.
bool same_file(const std::string& a, const std::string& b);

// A file that a command may have, and how the command line names it. `bytes`: about what it will take.
struct NamedFile {
    std::string name;
    std::optional<std::string> path;
    std::uint64_t bytes = 0;
};

// To be called before long work. Throws InputError unless every output can be written: it is a regular file or nothing
// yet, in a folder where files can be made, and neither an input nor another output. Too little space is a warning.
void check_outputs(const std::vector<NamedFile>& outputs, const std::vector<NamedFile>& inputs);

// The whole file. Throws InputError for one that is missing or not a regular file: a FIFO would be waited for.
std::string read_file(const std::string& path);

// Throws InputError as read_file() does.
void require_regular_file(const std::string& path);

}  // namespace nscdd
