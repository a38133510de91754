#include "files/replace_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <optional>

#include "files/error.hpp"
#include "files/say.hpp"

namespace nscdd {
namespace {

namespace fs = std::filesystem;

// Owns a file descriptor.
class Descriptor {
  public:
    explicit Descriptor(int number) : number_(number) {}
    ~Descriptor() {
        if (number_ >= 0) ::close(number_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    operator int() const { return number_; }
    int close() {  // errors of a full disk may be reported only now
        const int number = number_;
        number_ = -1;
        return ::close(number);
    }

  private:
    int number_;
};

// Why a file cannot be written; a caller puts the path before it.
struct Refused {
    std::string why;
};

[[noreturn]] void refuse(int error) { throw Refused{std::strerror(error)}; }

const char* kind(mode_t mode) {
    return S_ISDIR(mode)                    ? "a folder"
           : S_ISFIFO(mode)                 ? "a FIFO"
           : S_ISSOCK(mode)                 ? "a socket"
           : S_ISCHR(mode) || S_ISBLK(mode) ? "a device"
                                            : "something else";
}

std::optional<struct stat> status(const std::string& path) {
    struct stat found {};
    if (::stat(path.c_str(), &found) == 0) return found;
    if (errno != ENOENT) refuse(errno);
    return {};
}

// The file that the bytes go to: symbolic links are followed.
std::string target_of(const std::string& path) {
    if (const auto found = status(path)) {
        if (!S_ISREG(found->st_mode))
            throw Refused{fmt::format("is {}, only regular files are replaced", kind(found->st_mode))};
        return fs::canonical(path).string();
    }
    if (fs::is_symlink(path)) throw Refused{"is a symbolic link to nothing"};
    const auto folder = fs::absolute(path).parent_path();
    if (!fs::is_directory(folder)) throw Refused{fmt::format("the folder {} does not exist", folder.string())};
    return (fs::canonical(folder) / fs::path(path).filename()).string();
}

// A new file beside `target`, of a name that nobody else has.
Descriptor open_part(const std::string& target, std::string& part) {
    for (int k = 0;; ++k) {
        part = fmt::format("{}.{}-{}.part", target, ::getpid(), k);
        const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0) return Descriptor(descriptor);
        if (errno != EEXIST || k == 1000) refuse(errno);
    }
}

// `old`, which is the file as it was placed last, under a new name beside it. False where it is not there any more, is
// another file, has been written on, or cannot have two names on this disk.
bool link_part(const std::string& old, const struct stat& placed, std::string& part) {
    for (int k = 0;; ++k) {
        part = fmt::format("{}.{}-{}.part", old, ::getpid(), k);
        if (::link(old.c_str(), part.c_str()) == 0) break;
        if (errno != EEXIST || k == 1000) return false;
    }
    const auto found = status(part);
    if (found && found->st_dev == placed.st_dev && found->st_ino == placed.st_ino && found->st_size == placed.st_size &&
        found->st_mtim.tv_sec == placed.st_mtim.tv_sec && found->st_mtim.tv_nsec == placed.st_mtim.tv_nsec)
        return true;
    ::unlink(part.c_str());
    return false;
}

// Whether the file has another name or somebody has it open: they keep what it is. The system gives a lease to the only
// one who has. Where its file system knows no leases, the lock tells that the HDF5 library takes, a moment after it has
// opened a file.
bool kept_by_others(const std::string& path) {
    const Descriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
    struct stat found {};
    if (file < 0 || ::fstat(file, &found) != 0 || found.st_nlink != 1) return true;
    ::fcntl(file, F_SETSIG, SIGURG);  // ignored; SIGIO, sent where the file is opened during the lease, would end us
    if (::fcntl(file, F_SETLEASE, F_WRLCK) == 0) return false;
    return errno == EAGAIN || (::flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK);
}

// Makes these bytes, and the size, of a file those of another.
void copy_ranges(const std::string& from, const std::string& to, const std::vector<ByteRange>& ranges) {
    Descriptor source(::open(from.c_str(), O_RDONLY | O_CLOEXEC)), target(::open(to.c_str(), O_WRONLY | O_CLOEXEC));
    struct stat found {};
    if (source < 0 || target < 0 || ::fstat(source, &found) != 0 || ::ftruncate(target, found.st_size) != 0)
        refuse(errno);
    std::string block(1 << 16, '\0');
    for (auto [begin, size] : ranges)
        while (size > 0) {
            const ssize_t count =
                ::pread(source, block.data(), std::min<std::size_t>(size, block.size()), static_cast<off_t>(begin));
            if (count < 0) refuse(errno);
            if (count == 0) break;  // beyond the end, which was cut off
            for (ssize_t done = 0; done < count;) {
                const ssize_t put = ::pwrite(target, block.data() + done, static_cast<std::size_t>(count - done),
                                             static_cast<off_t>(begin) + done);
                if (put < 0 && errno != EINTR) refuse(errno);
                if (put > 0) done += put;
            }
            begin += static_cast<std::uint64_t>(count), size -= static_cast<std::uint64_t>(count);
        }
    if (target.close() != 0) refuse(errno);
}

// Owner and mode of the file that is there.
void keep_mode(const Descriptor& file, const std::string& target) {
    const auto old = status(target);
    if (!old) return;
    const bool same_owner = ::fchown(file, old->st_uid, old->st_gid) == 0;  // root alone may give files away
    if (::fchmod(file, old->st_mode & (same_owner ? 07777 : 0777)) != 0) refuse(errno);
}

void write_all(const Descriptor& file, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(file, bytes.data(), bytes.size());
        if (written < 0 && errno != EINTR) refuse(errno);
        if (written > 0) bytes.remove_prefix(static_cast<std::size_t>(written));
    }
}

class Checksum {
  public:
    void add(std::string_view bytes) {
        for (const unsigned char byte : bytes) hash_ = (hash_ ^ byte) * 0x100000001b3;
    }
    std::string text() const { return fmt::format("{:016x}", hash_); }

  private:
    std::uint64_t hash_ = 0xcbf29ce484222325;
};

void visit_blocks(const std::string& path, const auto& visit) {
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    for (std::string block(1 << 16, '\0');;) {
        const ssize_t count = file < 0 ? -1 : ::read(file, block.data(), block.size());
        if (count < 0) throw InputError(fmt::format("{}: cannot read: {}", path, std::strerror(errno)));
        if (count == 0) return;
        visit(std::string_view(block).substr(0, static_cast<std::size_t>(count)));
    }
}

void check_output(const NamedFile& output) {
    const std::string target = target_of(*output.path);
    if (status(target) && ::access(target.c_str(), W_OK) != 0) refuse(errno);
    std::string part;
    Descriptor made = open_part(target, part);  // fails where a folder or disk does not allow the file
    ::unlink(part.c_str());
    struct statvfs disk {};
    if (::fstatvfs(made, &disk) != 0) return;
    if (const std::uint64_t free = std::uint64_t{disk.f_bavail} * disk.f_frsize; free < output.bytes)
        say(stderr, "nscdd: warning: {}: {:.3g} MB are free, the file may take {:.3g} MB\n", one_line(*output.path),
            1e-6 * static_cast<double>(free), 1e-6 * static_cast<double>(output.bytes));
}

}  // namespace

void FileSet::add(const std::string& path, std::string_view bytes) {
    make(path, [bytes](const Descriptor& file) { write_all(file, bytes); });
}

std::string FileSet::begin(const std::string& path) {
    make(path, [](const Descriptor&) {});
    return parts_.back().part;
}

void FileSet::make(const std::string& path, const auto& fill) {
    try {
        const std::string target = target_of(path);
        std::string part;
        Descriptor file = open_part(target, part);
        parts_.push_back({path, target, part});
        keep_mode(file, target);
        fill(file);
        if (file.close() != 0) refuse(errno);
    } catch (const Refused& refused) {
        throw OutputError(fmt::format("{}: cannot write: {}", path, refused.why));
    } catch (const fs::filesystem_error& error) {
        throw OutputError(fmt::format("{}: cannot write: {}", path, error.code().message()));
    }
}

bool FileSet::has(const std::string& path) const {
    return std::ranges::find(parts_, path, &Part::path) != parts_.end();
}

const FileSet::Part& FileSet::find(const std::string& path) const {
    const auto part = std::ranges::find(parts_, path, &Part::path);
    if (part == parts_.end()) throw std::logic_error("FileSet: " + path + " is not of the set");
    return *part;
}

const std::string& FileSet::part(const std::string& path) const { return find(path).part; }

std::string FileSet::checksum(const std::string& path) const { return checksum_of_file(part(path)); }

void FileSet::place(const std::string& path, const std::vector<ByteRange>* written) {
    Part& part = parts_[static_cast<std::size_t>(&find(path) - parts_.data())];
    try {
        const std::string whole = part.part;
        const auto found = status(whole);
        if (!found) refuse(ENOENT);
        std::string before;  // what was placed last time lacks only what was written since
        bool lags = written && part.placed && link_part(part.target, *part.placed, before);
        if (std::rename(whole.c_str(), part.target.c_str()) != 0) {
            const int error = errno;
            if (lags) ::unlink(before.c_str());
            refuse(error);
        }
        if (lags && kept_by_others(before)) {
            ::unlink(before.c_str());
            lags = false;
        }
        if (!written) {
            parts_.erase(parts_.begin() + (&part - parts_.data()));
            return;
        }
        part.placed = found;
        if (lags)
            part.part = before;
        else
            keep_mode(open_part(part.target, part.part), part.target);
        copy_ranges(part.target, part.part,
                    lags ? *written : std::vector<ByteRange>{{0, static_cast<std::uint64_t>(found->st_size)}});
    } catch (const Refused& refused) {
        throw OutputError(fmt::format("{}: cannot write: {}", path, refused.why));
    }
}

void FileSet::commit() {
    const auto fail = [](const Part& part) {
        throw OutputError(fmt::format("{}: cannot write: {}", part.path, std::strerror(errno)));
    };
    for (const Part& part : parts_) {
        const Descriptor file(::open(part.part.c_str(), O_RDONLY | O_CLOEXEC));
        if (file < 0 || ::fsync(file) != 0) fail(part);
    }
    for (Part& part : parts_) {
        if (std::rename(part.part.c_str(), part.target.c_str()) != 0) fail(part);
        part.part.clear();
    }
    parts_.clear();
}

FileSet::~FileSet() {
    for (const Part& part : parts_)
        if (!part.part.empty()) ::unlink(part.part.c_str());
}

void replace_file(const std::string& path, std::string_view bytes) {
    FileSet files;
    files.add(path, bytes);
    files.commit();
}

std::string checksum(std::string_view bytes) {
    Checksum sum;
    sum.add(bytes);
    return sum.text();
}

std::string checksum_of_file(const std::string& path) {
    Checksum sum;
    visit_blocks(path, [&sum](std::string_view block) { sum.add(block); });
    return sum.text();
}

bool same_file(const std::string& a, const std::string& b) {
    struct stat x {
    }, y{};
    if (::stat(a.c_str(), &x) == 0 && ::stat(b.c_str(), &y) == 0) return x.st_dev == y.st_dev && x.st_ino == y.st_ino;
    std::error_code ignored;
    return fs::weakly_canonical(fs::absolute(a), ignored) == fs::weakly_canonical(fs::absolute(b), ignored);
}

void check_outputs(const std::vector<NamedFile>& outputs, const std::vector<NamedFile>& inputs) {
    for (auto output = outputs.begin(); output != outputs.end(); ++output) {
        if (!output->path) continue;
        const auto must_differ = [&](const NamedFile& other) {
            if (other.path && same_file(*output->path, *other.path))
                throw InputError(fmt::format("{}: {} is the same file as {}", *output->path, output->name, other.name));
        };
        for (const NamedFile& input : inputs) must_differ(input);
        for (auto other = outputs.begin(); other != output; ++other) must_differ(*other);
        try {
            check_output(*output);
        } catch (const Refused& refused) {
            throw InputError(fmt::format("{}: cannot write: {}", *output->path, refused.why));
        } catch (const fs::filesystem_error& error) {
            throw InputError(fmt::format("{}: cannot write: {}", *output->path, error.code().message()));
        }
    }
}

void require_regular_file(const std::string& path) {
    struct stat found {};
    if (::stat(path.c_str(), &found) != 0)
        throw InputError(fmt::format("{}: cannot open: {}", path, std::strerror(errno)));
    if (!S_ISREG(found.st_mode)) throw InputError(fmt::format("{}: is {}, not a file", path, kind(found.st_mode)));
    if (::access(path.c_str(), R_OK) != 0)
        throw InputError(fmt::format("{}: cannot open: {}", path, std::strerror(errno)));
}

std::string read_file(const std::string& path) {
    require_regular_file(path);
    std::string bytes;
    visit_blocks(path, [&bytes](std::string_view block) { bytes.append(block); });
    return bytes;
}

}  // namespace nscdd
