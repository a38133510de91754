// A run of one model whose caller makes the steps. Included by the generated run_model_*.cpp only.
#pragma once

#include <cstddef>

#include "model/live.hpp"
#include "model/recorder.hpp"
#include "model/simulation_exchange.hpp"
#include "model/simulation_stop.hpp"
#include "nscdd/step/observables.hpp"
#include "registry/schemes.hpp"

namespace nscdd {

template <class M>
class LiveModel final : public Live {
  public:
    LiveModel(RunRequest request, std::unique_ptr<Communicator> comm)
        : comm_(std::move(comm)), request_(std::move(request)), exchange_(request_.scene, request_.so_far) {
        BuiltScene<M> built = build_scene<M>(request_, *comm_);
        keep_automatic_step(request_, built);
        request_.packing = {};
        request_.from = {};
        const SolveOptions options = request_.scene.solver.options(sweeps(*request_.scheme));
        solve_ = choose_solver<M>(*request_.scheme, request_.interface, options).solve;
        simulation_.emplace(*comm_, std::move(built.settings), built.grains, built.impulses,
                            built.broad_phase ? &*built.broad_phase : nullptr);
        stop_.emplace(*simulation_, request_.scene, request_.so_far);
    }
    ~LiveModel() override { detach(false); }

    StepReport step() override {
        if (refused_) throw RefusedStep(*refused_);
        detach(true);
        exchange_.before_step(*simulation_, time(), steps() + 1);
        push_walls(request_.scene, *simulation_);
        StepReport report;
        try {
            report = simulation_->step(solve_);
        } catch (const StepRefused& refused) {
            StepRefused::Refusal why = refused.refusal;
            why.step += static_cast<int>(request_.start_step);
            refused_.emplace(StepRefused::describe(why, wall_names()), why);
            throw RefusedStep(*refused_);
        } catch (const std::runtime_error& error) {  // such as numbers that are no longer finite
            refused_.emplace(error.what(), StepRefused::Refusal{.step = static_cast<int>(steps()) + 1});
            throw RefusedStep(*refused_);
        }
        stopped_by_ = stop_->after(*simulation_, time());
        if (recorder_) recorder_->after(report, stopped_by_.has_value());
        return report;
    }

    void record(std::vector<std::string> series, std::vector<std::string> frames, int frame_every) override {
        if (recorder_) throw InputError("the simulation is being recorded: end that first");
        for (const std::string& path : series) SeriesWriter::check_name(path);
        for (const std::string& path : frames) check_frames_name(path);
        request_.outputs.series = std::move(series);
        request_.outputs.frames = std::move(frames);
        request_.outputs.frame_every = frame_every;
        auto files = std::make_unique<FileSet>();
        recorder_ = std::make_unique<Recorder<M>>(*simulation_, request_, *files);
        files_ = std::move(files);
    }
    void stop() override {
        if (!recorder_) return;
        const std::unique_ptr<FileSet> files = std::move(files_);
        const std::unique_ptr<Recorder<M>> recorder = std::move(recorder_);  // before the files, also where one fails
        recorder->save();
        write_on_first(*comm_, [&files] { files->commit(); });
    }
    void save(const std::string& path) const override {
        if (refused_) throw InputError("no state after a step that was refused: save before it");
        FileSet files;
        const State head = state_head(*simulation_, request_);
        write_state(*simulation_, head, files, path);
        write_on_first(*comm_, [&] {
            write_xdmf(files, path, head, simulation_->grain_count());
            files.commit();
        });
    }

    const RunRequest& request() const override { return request_; }
    Communicator& comm() const override { return *comm_; }
    std::size_t grain_count() const override { return simulation_->grain_count(); }
    std::int64_t steps() const override { return request_.start_step + simulation_->steps(); }
    std::string stopped_by() const override { return stopped_by_ ? stopped_by_->condition : ""; }
    double time() const override { return time_now(*simulation_, request_); }

    GrainRows grains() const override {
        const auto gathered = gather_grains(*simulation_);
        GrainRows rows{grain_rows(gathered), ids_of(gathered), {}};
        for (const auto& g : gathered) rows.masses.push_back(g.grain.mass);
        return rows;
    }
    State::Contacts contacts() const override { return gather_contact_rows(*simulation_); }

    std::vector<double> loads() const override {
        std::vector<double> loads;
        for (const auto& gathered : gather_grains(*simulation_))
            loads.insert(loads.end(), gathered.grain.load.data(), gathered.grain.load.data() + M::dof);
        return loads;
    }
    int load_size() const override { return M::dof; }
    void set_loads(const std::vector<double>& loads) override { set(&Grain<M>::load, loads); }
    void set_velocities(const std::vector<double>& velocities) override { set(&Grain<M>::velocity, velocities); }

    RecordsInPlace in_place(Records which) override {
        if (comm_->size() > 1) throw InputError("what several subdomains have is not in one place: take copies by id");
        const auto& part = simulation_->parts()[0];
        RecordsInPlace place;
        const auto of = [&place](const auto& records, const auto& kept, auto fields) {
            place = {records.data(), records.size(), sizeof(records[0]), {}, kept.memory};
            const typename std::decay_t<decltype(records)>::value_type like;  // there may be none
            fields(like, [&](const char* name, const auto& member, int numbers) {
                const auto at = reinterpret_cast<const std::byte*>(&member) - reinterpret_cast<const std::byte*>(&like);
                place.fields.push_back({name, static_cast<std::size_t>(at), numbers});
            });
        };
        if (which == Records::grains)
            of(part.grains, grains_, [](const Grain<M>& grain, auto field) {
                field("id", grain.id, 0);
                field("material", grain.material, 0);
                field("radius", grain.radius, 1);
                field("mass", grain.mass, 1);
                field("inertia", grain.inertia, 1);
                field("position", grain.position, M::dim);
                field("velocity", grain.velocity, M::dim);
                if constexpr (M::friction) field("spin", grain.velocity[M::dim], M::spins);
            });
        else
            of(which == Records::contacts ? part.problem.contacts : part.problem.wall_contacts,
               which == Records::contacts ? contacts_ : wall_contacts_, [](const Contact<M>& contact, auto field) {
                   field("i", contact.i, 0);
                   field("j", contact.j, 0);
                   field("normal", contact.normal, M::dim);
                   if constexpr (M::friction)
                       field("impulse", contact.r, M::dim);
                   else
                       field("normal_impulse", contact.r, 1);
                   if constexpr (M::rolling) field("couple", contact.r[M::dim], M::couples);
               });
        return place;
    }

    SeriesRow measures() const override {
        const Observables<M> seen = observe(*simulation_);
        const Measures<M>& m = seen.measures;
        const typename M::Vec box = box_edges<M>(simulation_->settings());
        const double volume = box.prod() > 0 ? box.prod() : NAN;
        SeriesRow row;
        const auto add = [&row](const char* name, hdf5::Shape shape, std::vector<double> values) {
            row.push_back({name, "", "", std::move(shape), {}, std::move(values)});
        };
        const auto list = [](const auto& v) { return std::vector<double>(v.data(), v.data() + v.size()); };
        const typename Measures<M>::Tensor stress = m.virial.transpose() / volume,  // to C order
            fabric = seen.fabric.transpose();
        std::vector<double> forces;
        for (const auto& force : seen.wall_force) forces.insert(forces.end(), force.data(), force.data() + M::dim);
        add("kinetic_energy", {}, {m.kinetic_energy});
        add("momentum", {M::dim}, list(m.momentum));
        add("angular_momentum", {Measures<M>::rotations}, list(m.angular_momentum));
        add("box", {M::dim}, list(box));
        add("stress", {M::dim, M::dim}, list(stress));
        add("solid_fraction", {}, {m.grains_volume / volume});
        add("wall_force", {seen.wall_force.size(), M::dim}, std::move(forces));
        add("fabric", {M::dim, M::dim}, list(fabric));
        add("contacts_carrying", {}, {m.contacts});
        add("coordination", {}, {m.coordination()});
        add("rattlers", {}, {seen.rattlers()});
        add("largest_overlap", {}, {std::max(0.0, m.largest_overlap)});
        return row;
    }

    LiveCell cell() const override {
        const Cell<M>& cell = simulation_->settings().cell;
        const auto rows = [](const typename M::Gradient& matrix) {
            const typename M::Gradient turned = matrix.transpose();  // to C order
            return std::vector<double>(turned.data(), turned.data() + turned.size());
        };
        return {{cell.periodic.begin(), cell.periodic.end()},
                {cell.size.data(), cell.size.data() + M::dim},
                rows(cell.tilt),
                rows(cell.gradient)};
    }
    std::size_t wall_count() const override { return simulation_->settings().walls.size(); }
    LiveWall wall(std::size_t w) const override {
        const Wall<M>& wall = simulation_->settings().walls.at(w);
        const typename M::Vec velocity = wall.velocity + wall.speed * wall.normal;
        return {request_.scene.walls[w].name,
                {wall.normal.data(), wall.normal.data() + M::dim},
                {velocity.data(), velocity.data() + M::dim},
                wall.offset,
                wall.driven ? wall.force : 0,
                wall.driven ? wall.mass : 0,
                wall.driven};
    }
    void set_wall_velocity(std::size_t w, const std::vector<double>& velocity) override {
        Wall<M>& wall = writable(w);
        if (wall.path) fail(w, "its motion is a function of time");
        if (velocity.size() != M::dim) fail(w, "velocity needs " + std::to_string(M::dim) + " numbers");
        const Eigen::Map<const typename M::Vec> v(velocity.data());
        if (!v.allFinite()) fail(w, "velocity must be finite");
        const double along = v.dot(wall.normal);
        if (wall.driven && std::abs(along) > 1e-9 * v.norm())
            fail(w, "velocity must be tangential: along the normal the wall is pushed");
        wall.velocity = v;
        if (wall.driven) wall.velocity -= along * wall.normal;
    }
    void set_wall_force(std::size_t w, double force) override {
        require_motion(w, WallMotion::Force, "force");
        if (!std::isfinite(force)) fail(w, "force must be finite");
        request_.scene.walls[w].force = writable(w).force = force;
    }
    void set_wall_pressure(std::size_t w, double pressure) override {
        require_motion(w, WallMotion::Pressure, "pressure");
        if (!std::isfinite(pressure)) fail(w, "pressure must be finite");
        request_.scene.walls[w].pressure = pressure;
    }

  private:
    std::vector<std::string> wall_names() const {
        std::vector<std::string> names;
        for (const auto& wall : request_.scene.walls) names.push_back(wall.name);
        return names;
    }
    Wall<M>& writable(std::size_t w) { return simulation_->walls()[w]; }
    [[noreturn]] void fail(std::size_t w, const std::string& problem) const {
        throw InputError("wall '" + request_.scene.walls[w].name + "': " + problem);
    }
    void require_motion(std::size_t w, WallMotion motion, const char* what) const {
        if (request_.scene.walls.at(w).motion != motion)
            fail(w, std::string("no ") + what + " drives it, give one when it is made");
    }

    static std::vector<int> ids_of(const std::vector<GatheredGrain<M>>& grains) {
        std::vector<int> ids;
        for (const auto& g : grains) ids.push_back(g.grain.id);
        return ids;
    }

    // The simulation is ours and not const. Between two steps it has no pointer into its lists of grains and contacts,
    // and takes loads and velocities as they are there.
    template <class Records>
    static Records& ours(const Records& records) {
        return const_cast<Records&>(records);
    }

    // Sets a member of all copies of all grains; `values` are (n, M::dof) by id.
    // Of fixed grains velocities stay 0.
    void set(typename M::Velocity Grain<M>::*member, const std::vector<double>& values) {
        if (values.size() != grain_count() * M::dof ||
            !std::ranges::all_of(values, [](double x) { return std::isfinite(x); }))
            throw InputError("loads and velocities must be finite, and as many as the grains");
        // Grains may have come and gone, so that ids are not rows.
        const std::vector<int> all = ids_of(gather_grains(*simulation_));
        const bool here = all.size() == grain_count();
        detach(true);
        for (std::size_t k = 0; k < simulation_->parts().size(); ++k)
            for (Grain<M>& grain : ours(simulation_->parts()[k].grains)) {
                if (grain.fixed() && member == &Grain<M>::velocity) continue;
                const auto row = here ? std::ranges::lower_bound(all, grain.id) - all.begin() : grain.id;
                if (row * M::dof >= static_cast<std::ptrdiff_t>(values.size()))
                    throw std::logic_error("over MPI grains that have come cannot be given loads or velocities");
                grain.*member = Eigen::Map<const typename M::Velocity>(&values[static_cast<std::size_t>(row * M::dof)]);
            }
    }

    // Lets those who look at grains or contacts keep the memory that they look at; the run goes on in a copy.
    void detach(bool goes_on) {
        if (!simulation_) return;
        const auto& part = simulation_->parts()[0];
        grains_.detach(part.grains, goes_on);
        contacts_.detach(part.problem.contacts, goes_on);
        wall_contacts_.detach(part.problem.wall_contacts, goes_on);
    }

    template <class Record>
    struct Kept {
        std::shared_ptr<std::vector<Record>> memory =
            std::make_shared<std::vector<Record>>();  // empty; who shares it looks

        void detach(const std::vector<Record>& records, bool goes_on) {
            if (memory.use_count() == 1) return;
            std::vector<Record> copy;
            if (goes_on) copy = records;
            memory->swap(ours(records));
            ours(records).swap(copy);
            memory = std::make_shared<std::vector<Record>>();
        }
    };

    std::unique_ptr<Communicator> comm_;
    RunRequest request_;
    AnyStepSolver<M> solve_;
    std::optional<Simulation<M>> simulation_;
    Kept<Grain<M>> grains_;
    Kept<Contact<M>> contacts_, wall_contacts_;
    Exchange<M> exchange_;
    std::optional<StopTest<M>> stop_;
    std::optional<Stopped> stopped_by_;
    std::unique_ptr<FileSet> files_;
    std::unique_ptr<Recorder<M>> recorder_;  // into files_
    std::optional<RefusedStep> refused_;
};

template <class M>
std::unique_ptr<Live> make_live_model(RunRequest request, std::unique_ptr<Communicator> comm) {
    return std::make_unique<LiveModel<M>>(std::move(request), std::move(comm));
}

}  // namespace nscdd
