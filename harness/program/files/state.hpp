// The state of a run at the end of a step: enough to go on from, to compare, and to look at.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "files/packing.hpp"

namespace nscdd {

// n grains, w walls, c contacts, m materials; all arrays in C order. It is a packing with more in it: read_packing
// reads it too. One process of many has some rows of grains and contacts, and all of the rest.
struct State {
    Packing packing;
    std::vector<double> velocity;   // (n, dim) [m/s]
    std::vector<double> spin;       // (n, 1) in 2D, (n, 3) in 3D [rad/s]
    std::vector<int> material;      // (n) index into the scene's materials
    std::vector<int> subdomain;     // (n)
    std::vector<int> multiplicity;  // (n) number of subdomains in which the grain has contacts

    struct Walls {
        std::vector<std::string> name;     // (w) in the scene
        std::vector<double> offset;        // (w) normal . x of the plane [m]
        std::vector<double> normal;        // (w, dim) into the sample
        std::vector<double> velocity;      // (w, dim) [m/s]
        std::vector<double> normal_speed;  // (w) of a wall that a force drives, to the last bit [m/s]
    } walls;

    struct Obstacles {
        std::vector<std::string> name;  // (o) in the scene
        std::vector<int> facets;        // (o) number of each; contacts number them behind the walls
    } obstacles;

    struct Materials {
        std::vector<std::string> name;  // (m) in the scene
        std::vector<double> density;    // (m)
    } materials;

    struct Contacts {
        std::vector<int> i;                  // (c) grain
        std::vector<int> j;                  // (c) grain, or wall -1-j where j < 0, or facet
        std::vector<double> impulse;         // (c, dim) on i, world axes [N s]
        std::vector<double> normal;          // (c, dim) from j to i
        std::vector<double> gap;             // (c) [m], negative where they overlap
        std::vector<int> subdomain;          // (c)
        std::vector<double> normal_impulse;  // (c) [N s]; without friction that of the solver, to the last bit
        std::vector<double> couple = {};     // (c, spins) on i [N m s], of a law with couples
        bool have_couples = false;           // told to a writer before rows come
    } contacts;

    // Where the scene repeats; all empty where it does not.
    struct Cell {
        std::vector<int> periodic;                               // (dim) 1 of axes along which it repeats
        std::vector<double> gradient;                            // (dim, dim) of the flow [1/s]
        std::vector<double> size, tilt;                          // (dim) [m], (dim, dim) [m]: nscdd::Cell
        std::vector<double> broad_phase_size, broad_phase_tilt;  // as they were at the last broad phase
        std::vector<double> stretch;                             // (dim, dim) of places since then
    } cell;

    // The last broad phase, nscdd::BroadPhaseState: with it a run goes on exactly.
    struct BroadPhase {
        std::string kind;               // of the partition: grid, bisection, metis
        std::vector<double> partition;  // its numbers
        double imbalance = 1;           // that it had when it was made, >= 1
        std::vector<double> x;          // (n, dim) centres then [m]
        std::vector<double> offset;     // (w) of the walls then [m]
        double skin = 0;                // [m], > 0
        int steps_since = 0;            // >= 0
        double time = 0;                // of the scene then, where it has obstacles [s]
    } broad_phase;

    // What has happened since the start of the scene, of scenes that ask for it; all empty in others.
    struct SoFar {
        std::vector<double> h;       // (1) the step, where the program chose it [s]
        std::vector<double> edges;   // (dim) of the box at the start [m], 0 where there is none
        std::vector<double> flowed;  // (dim, dim) gradients of the cell times the step, added up [1]

        static constexpr std::size_t amounts = 3;  // number, mass [kg] and kinetic energy [J] of grains
        std::vector<double> inserted, removed;     // grains, by [[insert]] and [[remove]] of the scene
        std::vector<double> came, left;            // (amounts) of all that entered and left the scene
    } so_far;
    bool has_fixed = false;  // says which grains are fixed: packing.fixed

    static constexpr std::int64_t most_steps =
        1'000'000'000'000'000;    // a double, as of JSON, holds them and those to come
    double time = 0;              // [s]
    std::int64_t step = 0;        // steps made
    std::int64_t steps_left = 0;  // that the run had still to make; 0 at its end
    std::string scene;            // its name

    int spins() const { return packing.dim == 3 ? 3 : 1; }
};

// Throws InputError naming file and dataset, as read_packing does; contacts must name existing grains and walls.
State read_state(const std::string& path, const Share& share = {});

// Writes a state by rows, so that nobody needs to have all of them. Throws OutputError.
class StateWriter {
  public:
    // For pictures a state has more, as ParaView reads it: the rows of its points, (n) in `paraview/vertex`, and in 2D
    // its velocities once more, (n, 3) in `paraview/velocity`.
    enum class For { going_on, pictures };

    // `head`: all of the state but its rows, of which so many will come.
    StateWriter(FileSet& files, const std::string& path, const State& head, std::size_t grains, std::size_t contacts,
                For use = For::pictures);

    // Rows of grains and contacts behind those that have come; the rest of `rows` is not looked at.
    void append(const State& rows);
    void save();

  private:
    hdf5::Writer file_;
    bool pictured_, flat_, couples_, fixed_ = false;
    int vertices_ = 0;  // that have come
};

// The .xdmf file beside a state for pictures, through which ParaView opens it.
void write_xdmf(FileSet& files, const std::string& state_path, const State& head, std::size_t grains);
std::string xdmf_beside(const std::string& state);  // "" of none

// Both files of a whole state. Throws OutputError; old files are then left as they were.
void write_state(const std::string& path, const State& state);

}  // namespace nscdd
