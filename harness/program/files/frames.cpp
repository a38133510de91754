#include "files/frames.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "files/hdf5.hpp"

namespace nscdd {
namespace {

std::string group(const FrameHead& head) { return fmt::format("step_{:010}", head.step); }

// All frames in one HDF5 file. After each frame the file is closed and takes its place, while the set goes on with a
// copy.
class Hdf5Frames final : public FrameWriter {
  public:
    Hdf5Frames(FileSet& files, const std::string& path, const std::string& scene)
        : files_(files), path_(path), file_(std::in_place, files, path) {
        file_->attribute("scene", scene);
        file_->save();
    }

    void begin(const FrameHead& head) override {
        file_.emplace(files_, path_);
        frame_ = head;
        grains_ = 0;
        const std::string at = group(head);
        const hsize_t n = head.grains, c = head.contacts;
        file_->attribute("step", head.step, at);
        file_->attribute("time", head.time, at);
        for (const char* name : {"x", "velocity", "spin"}) file_->declare<double>(at + "/grains/" + name, {n, 3});
        file_->declare<double>(at + "/grains/radius", {n});
        for (const char* name : {"id", "subdomain", "multiplicity"}) file_->declare<int>(at + "/grains/" + name, {n});
        file_->declare<double>(at + "/contacts/ends", {2 * c, 3});
        file_->declare<int>(at + "/contacts/grains", {c, 2});
        file_->declare<double>(at + "/contacts/force", {c, 3});
        for (const char* name : {"normal_force", "gap"}) file_->declare<double>(at + "/contacts/" + name, {c});
        file_->declare<int>(at + "/contacts/subdomain", {c});
        write_shapes(at + "/walls/");
    }

    void append(const FrameRows& rows) override {
        const std::string grains = group(frame_) + "/grains/", contacts = group(frame_) + "/contacts/";
        std::vector<int> ids(rows.radius.size());
        for (int& id : ids) id = grains_++;
        file_->append(grains + "id", ids);
        file_->append(grains + "x", rows.x);
        file_->append(grains + "radius", rows.radius);
        file_->append(grains + "velocity", rows.velocity);
        file_->append(grains + "spin", rows.spin);
        file_->append(grains + "subdomain", rows.subdomain);
        file_->append(grains + "multiplicity", rows.multiplicity);
        file_->append(contacts + "ends", rows.contacts.ends);
        file_->append(contacts + "grains", rows.contacts.grains);
        file_->append(contacts + "force", rows.contacts.force);
        file_->append(contacts + "normal_force", rows.contacts.normal_force);
        file_->append(contacts + "gap", rows.contacts.gap);
        file_->append(contacts + "subdomain", rows.contacts.subdomain);
    }

    void end() override {
        file_->save();
        files_.place(path_, &file_->written());
    }

    void save() override {}

  private:
    void write_shapes(const std::string& at) {
        std::vector<double> points;
        std::vector<int> corners, walls;
        for (const FrameShape& shape : frame_.shapes) {
            for (const auto& corner : shape.corners) points.insert(points.end(), corner.begin(), corner.end());
            corners.push_back(static_cast<int>(shape.corners.size()));
            walls.push_back(shape.wall);
        }
        file_->write(at + "points", points, {points.size() / 3, 3});
        file_->write(at + "corners", corners, {corners.size()});
        file_->write(at + "wall", walls, {walls.size()});
    }

    FileSet& files_;
    std::string path_;
    std::optional<hdf5::Writer> file_;  // open during a frame
    FrameHead frame_;
    int grains_ = 0;  // of the frame, that have come
};

}  // namespace

void check_frames_name(const std::string& path) {
    const auto ending = std::filesystem::path(path).extension();
    if (ending != ".pvd" && ending != ".h5" && ending != ".hdf5")
        throw InputError(fmt::format("--frames {}: expected a name that ends in .pvd, .h5 or .hdf5", path));
}

std::optional<std::array<std::string, 3>> frame_collections(const std::string& path) {
    const std::filesystem::path name(path);
    if (name.extension() != ".pvd") return std::nullopt;
    const auto beside = [&](const char* what) { return std::filesystem::path(name).replace_extension(what).string(); };
    return std::array{path, beside(".contacts.pvd"), beside(".walls.pvd")};
}

std::unique_ptr<FrameWriter> make_frame_writer(FileSet& files, const std::string& path, const std::string& scene) {
    if (!frame_collections(path)) return std::make_unique<Hdf5Frames>(files, path, scene);
    return make_vtk_frames(files, path);
}

}  // namespace nscdd
