// Frames of a run for ParaView: all of them in one HDF5 file, with one .xdmf beside it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "files/hdf5.hpp"

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

struct FrameHead {
    std::int64_t step = 0;
    double time = 0;  // [s]
    std::size_t grains = 0, contacts = 0;
};

// Writes frames so that whatever ends the process, the file and its .xdmf can be read: after each frame the file is
// closed and takes its place, while the set goes on with a copy. Throws OutputError.
class FrameWriter {
  public:
    FrameWriter(FileSet& files, const std::string& path, const std::string& scene);

    void begin(const FrameHead& head);
    void append(const FrameRows& rows);  // behind those that have come
    void end();                          // of the frame
    void save();                         // what the set is to commit

  private:
    std::string grid_of_grains(const FrameHead& head) const;
    std::string grid_of_contacts(const FrameHead& head) const;
    void add_xdmf();

    FileSet& files_;
    std::string path_;
    std::optional<hdf5::Writer> file_;  // open during a frame
    int points_ = 0, ends_ = 0;         // of the frame, that have come
    FrameHead frame_;
    std::size_t frames_ = 0, listed_ = 0;  // written; that the .xdmf has
    std::string grains_, contacts_;        // grids of the frames so far
};

}  // namespace nscdd
