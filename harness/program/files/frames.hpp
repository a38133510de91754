// Frames of a run: grains, contacts and walls of some steps, as HDF5 for scripts or as VTK's files for ParaView.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "files/replace_file.hpp"

namespace nscdd {

// Some rows of a frame, or all: n grains, c contacts; in 2D the third component of vectors is 0. Arrays in C order.
struct FrameRows {
    std::vector<double> x;          // (n, 3) centres [m]
    std::vector<double> radius;     // (n) [m]
    std::vector<double> velocity;   // (n, 3) [m/s]
    std::vector<double> spin;       // (n, 3) [rad/s]
    std::vector<int> subdomain;     // (n)
    std::vector<int> multiplicity;  // (n) number of subdomains in which the grain has contacts

    struct Contacts {
        std::vector<double> ends;          // (2c, 3) centre of i, then centre of j or its foot on the wall [m]
        std::vector<int> grains;           // (c, 2) ids i and j; j < 0: wall -1-j
        std::vector<double> force;         // (c, 3) on i, mean of the step [N]
        std::vector<double> normal_force;  // (c) [N]
        std::vector<double> gap;           // (c) [m], negative where they overlap
        std::vector<int> subdomain;        // (c)
    } contacts;
};

// A part of a wall that is drawn, or an edge of the cell: two ends, or the corners of a polygon.
struct FrameShape {
    int wall = 0;  // -1: of the cell
    std::vector<std::array<double, 3>> corners;
};

struct FrameHead {
    std::int64_t step = 0;
    double time = 0;  // [s]
    std::size_t grains = 0, contacts = 0;
    double largest_force = 0;  // of all contacts, along the normal [N]
    double least_radius = 0;   // of the scene [m]
    std::vector<FrameShape> shapes;
};

// Writes frames one by one, so that whatever ends the process, those that are complete can be read.
class FrameWriter {
  public:
    virtual ~FrameWriter() = default;
    virtual void begin(const FrameHead& head) = 0;
    virtual void append(const FrameRows& rows) = 0;  // behind those that have come
    virtual void end() = 0;                          // of the frame
    virtual void save() = 0;                         // what the set is to commit
};

// Throws InputError unless the name ends in .pvd, .h5 or .hdf5.
void check_frames_name(const std::string& path);

// By the ending of the name: .pvd for VTK's files, else HDF5. Each member of the writer throws OutputError.
std::unique_ptr<FrameWriter> make_frame_writer(FileSet& files, const std::string& path, const std::string& scene);

// Names of the files that lead ParaView to the frames: grains, contacts, walls. None of frames in HDF5.
std::optional<std::array<std::string, 3>> frame_collections(const std::string& path);

// The writer of VTK's files.
std::unique_ptr<FrameWriter> make_vtk_frames(FileSet& files, const std::string& path);

}  // namespace nscdd
