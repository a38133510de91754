#include "fix_nscdd.hpp"

#include <lammps/comm.h>
#include <lammps/domain.h>
#include <lammps/error.h>
#include <lammps/force.h>
#include <lammps/modify.h>
#include <lammps/update.h>

#include <cstring>

#include "bricks.hpp"

namespace nscdd {

FixNscdd::FixNscdd(LAMMPS_NS::LAMMPS* lammps, int count, char** words)
    : Fix(lammps, count, words),
      arguments_(read_arguments(lammps, count, words)),
      links_(*atom, groupbit, force->ftm2v) {
    const char* lack = !atom->sphere_flag       ? "atoms are of style sphere"
                       : !atom->tag_enable      ? "atoms have IDs"
                       : domain->dimension != 3 ? "the dimension is 3, disks are for the program nscdd"
                       : domain->triclinic != 0 ? "the box is not tilted"
                                                : nullptr;
    if (lack) error->all(FLERR, std::string("Fix nscdd: works where ") + lack);
    time_integrate = 1;
    scalar_flag = vector_flag = global_freq = 1;
    extscalar = extvector = 0;
    size_vector = 7;
    virial_global_flag = thermo_virial = 1;
}

int FixNscdd::setmask() { return LAMMPS_NS::FixConst::INITIAL_INTEGRATE | LAMMPS_NS::FixConst::PRE_NEIGHBOR; }

void FixNscdd::init() {
    for (int k = 0; k < modify->nfix; ++k)
        if (modify->fix[k] != this && std::strcmp(modify->fix[k]->style, style) == 0)
            error->all(FLERR, std::string("Fix nscdd: there are two, and one has all contacts"));
    if (update->whichflag == 2) error->all(FLERR, std::string("Fix nscdd: works without minimize"));
    if (std::strncmp(update->integrate_style, "respa", 5) == 0)
        error->all(FLERR, std::string("Fix nscdd: works without run_style respa"));
}

void FixNscdd::by_kernel(auto&& task) {
    std::string why;
    try {
        return task();
    } catch (const StepRefused& refused) {
        StepRefused::Refusal refusal = refused.refusal;
        refusal.step = static_cast<int>(update->ntimestep);
        std::vector<std::string> names = arguments_.wall_names;
        names.insert(names.end(), arguments_.obstacle_names.begin(), arguments_.obstacle_names.end());
        why = StepRefused::describe(refusal, names);
    } catch (const std::invalid_argument& wrong) {
        why = wrong.what();
    } catch (const std::logic_error& wrong) {  // of this rank alone
        error->one(FLERR, std::string("Fix nscdd: ") + wrong.what());
    } catch (const std::runtime_error& wrong) {
        why = wrong.what();
    }
    simulation_.reset();
    comm_.reset();  // LAMMPS ends MPI
    error->all(FLERR, "Fix nscdd: " + why);
}

Cell<FixNscdd::M> FixNscdd::cell() const {
    Cell<M> cell;
    for (int d = 0; d < 3; ++d) {
        cell.periodic[static_cast<std::size_t>(d)] = domain->periodicity[d] != 0;
        if (!domain->periodicity[d]) continue;
        cell.low[d] = domain->boxlo[d];
        cell.size[d] = domain->prd[d];
    }
    return cell;
}

bool FixNscdd::same_box() const {
    const Cell<M>&had = simulation_->settings().cell, now = cell();
    return had.periodic == now.periodic && had.low == now.low && had.size == now.size;
}

void FixNscdd::make_simulation() {
    SimulationSettings<M> settings = arguments_.settings;
    settings.h = update->dt;
    settings.start_time = time_;
    settings.cell = cell();
    for (Wall<M>& wall : settings.walls)
        if (wall.path) wall.offset += wall.normal.dot(wall.path(time_));
    // of a tree of cuts (balance rcb) LAMMPS tells only where a point is, not what is near it
    if (arguments_.bricks && comm->layout != LAMMPS_NS::Comm::LAYOUT_TILED)
        settings.partition = {.kind = "lammps",
                              .make = [this](const PartitionInput<M>&) { return Bricks(*domain, *comm); }};
    std::vector<PairImpulse<M>> impulses;
    if (simulation_)
        detail::visit_impulses(simulation_->parts()[0],
                               [&](const auto&, const PairImpulse<M>& impulse) { impulses.push_back(impulse); });
    simulation_.emplace(*comm_, std::move(settings), links_.grains(), impulses);
    if (!links_.renew(*simulation_)) throw std::runtime_error("atoms and grains are not the same");
}

void FixNscdd::take_atoms() {
    if (!comm_) {
        comm_.emplace(world);
        solve_ = comm_->size() == 1 ? by_nlgs<M>(arguments_.options, newton_where_stalled<M>())
                                    : by_nscdd<Dcs<M, ClosedForm>>(arguments_.options, newton_where_stalled<M>());
    }
    bool same = simulation_ && simulation_->settings().h == update->dt && same_box();
    if (same && !sorted_) same = links_.renew(*simulation_);
    if (!same || !links_.give(*simulation_)) make_simulation();
    sorted_ = true;
}

void FixNscdd::setup(int vflag) {
    by_kernel([&] {
        take_atoms();
        note_virial(vflag);
    });
}

void FixNscdd::initial_integrate(int vflag) {
    by_kernel([&] {
        take_atoms();
        report_ = simulation_->step(solve_);
        if (simulation_->broad_phase().steps_since() == 0) links_.renew(*simulation_);
        links_.take(*simulation_);
        note_virial(vflag);
    });
    time_ += update->dt;
    lost_ -= report_.energy.contacts();
    if (report_.solve.converged) return;
    if (++unconverged_ == 1 && comm->me == 0)
        error->warning(FLERR, std::string("Fix nscdd: a step has not converged; f_ID[7] counts such steps"));
}

// Of the mean contact forces of the step, with those at walls.
void FixNscdd::note_virial(int vflag) {
    v_init(vflag);
    if (!vflag_global) return;
    const auto tensor = measure(*simulation_).virial;
    if (comm->me > 0) return;
    constexpr int at[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    for (int k = 0; k < 6; ++k) virial[k] = 0.5 * (tensor(at[k][0], at[k][1]) + tensor(at[k][1], at[k][0]));
}

double FixNscdd::compute_scalar() { return report_.solve.residual; }

double FixNscdd::compute_vector(int index) {
    if (index == 5) return simulation_ ? measure(*simulation_).largest_overlap : 0;
    const double values[] = {double(report_.solve.iterations),
                             report_.solve.residual,
                             report_.contacts,
                             lost_,
                             double(report_.attempts),
                             0,
                             unconverged_};
    return values[index];
}

}  // namespace nscdd
