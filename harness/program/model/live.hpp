// A run whose caller makes the steps: what the Python module holds. The model is chosen as the program chooses it, so a
// scene has the same numbers here to the last bit.
#pragma once

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "files/series.hpp"
#include "files/state.hpp"
#include "model/run_request.hpp"
#include "nscdd/step/refusals.hpp"
#include "nscdd/step/report.hpp"

namespace nscdd {

// A step that was refused, told with the names of the walls.
class RefusedStep : public std::runtime_error {
  public:
    RefusedStep(const std::string& told, StepRefused::Refusal why)
        : std::runtime_error(told), refusal(std::move(why)) {}
    StepRefused::Refusal refusal;
};

// A wall as it is between two steps; vectors are (dim).
struct LiveWall {
    std::string name;
    std::vector<double> normal, velocity;  // [m/s], prescribed and driven motion together
    double offset = 0;                     // normal . (any point of the plane) [m]
    double force = 0;                      // [N], mass [kg]; 0 unless it is driven
    double mass = 0;
    bool driven = false;
};

// A cell as it is between two steps; matrices in C order.
struct LiveCell {
    std::vector<int> periodic;                 // (dim) 1 of axes along which the scene repeats
    std::vector<double> size, tilt, gradient;  // (dim) [m], (dim, dim) [m], (dim, dim) [1/s]
};

// Rows of the grains by ascending id; on the process that hosts rank 0, none elsewhere.
struct GrainRows {
    State state;
    std::vector<int> ids;
    std::vector<double> masses;
};

// What one subdomain has, where the kernel keeps it and in its order: `count` records of `stride` bytes.
enum class Records { grains, contacts, wall_contacts };
struct RecordsInPlace {
    struct Field {
        const char* name;
        std::size_t offset;  // [bytes] within a record
        int numbers;         // doubles; 0: one int
    };
    const void* first = nullptr;
    std::size_t count = 0, stride = 0;
    std::vector<Field> fields;
    std::shared_ptr<void> owner;  // while it lives the memory keeps the records of now, whatever the run does
};

// All but the plain reads throw: InputError for what the caller cannot have, RefusedStep, and what Simulation throws.
class Live {
  public:
    virtual ~Live() = default;

    virtual StepReport step() = 0;
    // After each step from now on, until stop(): rows of series, and frames. Files take their places in stop().
    virtual void record(std::vector<std::string> series, std::vector<std::string> frames, int frame_every) = 0;
    virtual void stop() = 0;
    // The state, as `nscdd run --state` writes it.
    virtual void save(const std::string& path) const = 0;

    virtual const RunRequest& request() const = 0;
    virtual Communicator& comm() const = 0;
    virtual std::size_t grain_count() const = 0;
    virtual std::int64_t steps() const = 0;      // since the start of the scene
    virtual double time() const = 0;             // [s]
    virtual std::string stopped_by() const = 0;  // key of [stop] that the last step has met; "": none

    virtual GrainRows grains() const = 0;
    virtual int load_size() const = 0;              // numbers of a load: forces, then torques if grains turn
    virtual std::vector<double> loads() const = 0;  // (n, load_size) by id, constant [N, N m]
    // Both (n, load_size) by id; velocities [m/s] are followed by spins [rad/s].
    virtual void set_loads(const std::vector<double>& loads) = 0;
    virtual void set_velocities(const std::vector<double>& velocities) = 0;
    virtual State::Contacts contacts() const = 0;  // of the last step, by ids
    virtual RecordsInPlace in_place(Records) = 0;  // on one subdomain
    virtual SeriesRow measures() const = 0;        // sums over the scene

    virtual LiveCell cell() const = 0;
    virtual std::size_t wall_count() const = 0;
    virtual LiveWall wall(std::size_t w) const = 0;
    virtual void set_wall_velocity(std::size_t w, const std::vector<double>& velocity) = 0;
    virtual void set_wall_force(std::size_t w, double force) = 0;
    virtual void set_wall_pressure(std::size_t w, double pressure) = 0;
};

using MakeLive = std::unique_ptr<Live> (*)(RunRequest, std::unique_ptr<Communicator>);

// The run of the model that the scene needs. Collective.
std::unique_ptr<Live> make_live(RunRequest request, std::unique_ptr<Communicator> comm);

// That of the law which has this line in registry/laws.hpp; each is compiled by itself, run_model.cpp.in.
template <int dim, int law>
std::unique_ptr<Live> live_law(RunRequest request, std::unique_ptr<Communicator> comm);

}  // namespace nscdd
