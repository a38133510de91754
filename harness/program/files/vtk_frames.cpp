// Frames as VTK's files: FRAMES.pvd, FRAMES.contacts.pvd and FRAMES.walls.pvd list the times; poly data is in FRAMES/.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "files/error.hpp"
#include "files/frames.hpp"
#include "files/vtp.hpp"

namespace nscdd {
namespace {

constexpr std::array parts{"grains", "contacts", "walls"};

class VtkFrames final : public FrameWriter {
  public:
    VtkFrames(FileSet& files, const std::string& path) : files_(files), collections_(frame_collections(path).value()) {
        folder_ = std::filesystem::path(path).replace_extension();
        std::error_code why;
        std::filesystem::create_directories(folder_, why);
        if (why) throw OutputError(fmt::format("{}: cannot make the folder: {}", folder_.string(), why.message()));
    }

    void begin(const FrameHead& head) override {
        frame_ = head;
        grains_ = ends_ = 0;
        declare_grains();
        declare_contacts();
        open(0, head.grains, {head.grains, 0, 0});
        open(1, 2 * head.contacts, {0, head.contacts, 0});
        write_walls();
    }

    void append(const FrameRows& rows) override {
        Vtp& grains = vtp_[0];
        std::vector<int> ids(rows.radius.size()), ends(rows.radius.size());
        for (std::size_t k = 0; k < ids.size(); ++k) ids[k] = grains_++, ends[k] = grains_;
        for (const auto& [section, name] : {std::pair{"PointData", "id"}, {"Verts", "connectivity"}})
            grains.put(section, name, ids);
        grains.put("Verts", "offsets", ends);
        grains.put("Points", "x", rows.x);
        grains.put("PointData", "radius", rows.radius);
        grains.put("PointData", "velocity", rows.velocity);
        grains.put("PointData", "spin", rows.spin);
        grains.put("PointData", "subdomain", rows.subdomain);
        grains.put("PointData", "multiplicity", rows.multiplicity);
        append_contacts(rows.contacts);
    }

    void end() override {
        for (std::size_t k = 0; k < parts.size(); ++k) {
            vtp_[k].end();
            files_.place(name(k));
            listed_[k] += fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n", frame_.time,
                                      (folder_.filename() / file(k)).string());
        }
        ++frames_;
        // the lists are written whole: with every frame, many would take ever longer
        if (frames_ < 100 || frames_ >= written_ + written_ / 100) {
            add_collections();
            for (const std::string& collection : collections_) files_.place(collection);
        }
    }

    void save() override { add_collections(); }

  private:
    std::string file(std::size_t part) const { return fmt::format("{}-{:010}.vtp", parts[part], frame_.step); }
    std::string name(std::size_t part) const { return (folder_ / file(part)).string(); }
    void open(std::size_t part, std::size_t points, std::vector<std::size_t> cells) {
        vtp_[part].begin(files_.begin(name(part)), name(part), points, std::move(cells));
    }

    void declare_grains() {
        Vtp& vtp = vtp_[0];
        const std::size_t n = frame_.grains;
        vtp.declare("Points", "x", false, 3, n);
        for (const char* offsets : {"connectivity", "offsets"}) vtp.declare("Verts", offsets, true, 1, n);
        vtp.declare("PointData", "radius", false, 1, n);
        for (const char* vector : {"velocity", "spin"}) vtp.declare("PointData", vector, false, 3, n);
        for (const char* number : {"id", "subdomain", "multiplicity"}) vtp.declare("PointData", number, true, 1, n);
    }

    // Along a contact all is the same: arrays of points are what filters such as Tube read.
    void declare_contacts() {
        Vtp& vtp = vtp_[1];
        const std::size_t c = frame_.contacts;
        vtp.declare("Points", "x", false, 3, 2 * c);
        vtp.declare("Lines", "connectivity", true, 1, 2 * c);
        vtp.declare("Lines", "offsets", true, 1, c);
        for (const char* number : {"normal_force", "radius"}) vtp.declare("PointData", number, false, 1, 2 * c);
        for (const char* number : {"normal_force", "gap"}) vtp.declare("CellData", number, false, 1, c);
        vtp.declare("CellData", "force", false, 3, c);
        vtp.declare("CellData", "grains", true, 2, c);
        vtp.declare("CellData", "subdomain", true, 1, c);
    }

    void append_contacts(const FrameRows::Contacts& rows) {
        Vtp& vtp = vtp_[1];
        std::vector<int> points, offsets;
        std::vector<double> force, radius;
        for (const double f : rows.normal_force) {
            points.insert(points.end(), {ends_, ends_ + 1});
            offsets.push_back(ends_ += 2);
            // an area that grows with the force, the widest half as wide as the smallest grain
            const double share = frame_.largest_force > 0 ? std::abs(f) / frame_.largest_force : 0;
            force.insert(force.end(), 2, f);
            radius.insert(radius.end(), 2, 0.5 * frame_.least_radius * std::sqrt(share));
        }
        vtp.put("Points", "x", rows.ends);
        vtp.put("Lines", "connectivity", points);
        vtp.put("Lines", "offsets", offsets);
        vtp.put("PointData", "normal_force", force);
        vtp.put("PointData", "radius", radius);
        vtp.put("CellData", "normal_force", rows.normal_force);
        vtp.put("CellData", "gap", rows.gap);
        vtp.put("CellData", "force", rows.force);
        vtp.put("CellData", "grains", rows.grains);
        vtp.put("CellData", "subdomain", rows.subdomain);
    }

    void write_walls() {
        Vtp& vtp = vtp_[2];
        std::vector<double> x;
        std::vector<int> walls;  // in the order of cells: all lines come first
        struct Cells {
            std::vector<int> points, offsets;
        } lines, polygons;
        for (const bool polygon : {false, true})
            for (const FrameShape& shape : frame_.shapes) {
                if ((shape.corners.size() > 2) != polygon) continue;
                Cells& cells = polygon ? polygons : lines;
                for (const auto& corner : shape.corners) {
                    cells.points.push_back(static_cast<int>(x.size() / 3));
                    x.insert(x.end(), corner.begin(), corner.end());
                }
                cells.offsets.push_back(static_cast<int>(cells.points.size()));
                walls.push_back(shape.wall);
            }
        vtp.declare("Points", "x", false, 3, x.size() / 3);
        vtp.declare("CellData", "wall", true, 1, walls.size());
        for (const auto& [section, cells] : {std::pair{"Lines", &lines}, {"Polys", &polygons}}) {
            vtp.declare(section, "connectivity", true, 1, cells->points.size());
            vtp.declare(section, "offsets", true, 1, cells->offsets.size());
        }
        open(2, x.size() / 3, {0, lines.offsets.size(), polygons.offsets.size()});
        vtp.put("Points", "x", x);
        vtp.put("CellData", "wall", walls);
        for (const auto& [section, cells] : {std::pair{"Lines", &lines}, {"Polys", &polygons}}) {
            vtp.put(section, "connectivity", cells->points);
            vtp.put(section, "offsets", cells->offsets);
        }
    }

    void add_collections() {
        for (std::size_t k = 0; k < parts.size(); ++k)
            files_.add(collections_[k],
                       fmt::format("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
                                   "byte_order=\"LittleEndian\">\n<Collection>\n{}</Collection>\n</VTKFile>\n",
                                   listed_[k]));
        written_ = frames_;
    }

    FileSet& files_;
    std::array<std::string, 3> collections_;
    std::filesystem::path folder_;
    std::array<Vtp, 3> vtp_;
    FrameHead frame_;
    int grains_ = 0, ends_ = 0;             // of the frame, that have come
    std::size_t frames_ = 0, written_ = 0;  // complete; that the collections have
    std::array<std::string, 3> listed_;     // entries of the collections so far
};

}  // namespace

std::unique_ptr<FrameWriter> make_vtk_frames(FileSet& files, const std::string& path) {
    return std::make_unique<VtkFrames>(files, path);
}

}  // namespace nscdd
