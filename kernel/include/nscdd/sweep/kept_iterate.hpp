#pragma once

#include "nscdd/law/iterate.hpp"
#include "nscdd/sweep/load_batches.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// An iterate that the fast sweep keeps in its own layout, and puts in order only when it is asked for.
template <class M>
class KeptIterate {
    using Group = BatchGroup<M>;

  public:
    void forget() { there_ = false; }

    /// The iterate as the layout has it: a fifth of a sweep.
    void take(const ContactProblem<M>& problem, const BodyStore<M>& rows, const Group& walls, const Group& grains) {
        there_ = true;
        rows_ = rows.data;
        iterate_.speeds.clear();
        for (const WallBody<M>& wall : problem.walls) iterate_.speeds.push_back(wall.speed);
        const auto copy = [](const Group& group, std::vector<double>& to) {
            to.clear();
            for (std::size_t k = 0; k < group.count; ++k)
                to.insert(to.end(), group.impulses(k), group.impulses(k) + Group::impulse);
        };
        copy(walls, wall_impulses_);
        copy(grains, impulses_);
    }
    /// What was taken last, null if it was forgotten. rows, walls, grains: those that it was taken from.
    const detail::Iterate<M>* read(const ContactProblem<M>& problem, const BodyStore<M>& rows, const Group& walls,
                                   const Group& grains) {
        if (!there_) return nullptr;
        iterate_.velocities.clear();
        for (std::size_t g = 0; g < problem.bodies.size(); ++g) iterate_.velocities.push_back(rows.velocity(g, rows_));
        iterate_.impulses.resize(problem.contact_count());
        const auto put_after = [this](std::size_t first) {
            return [this, first](const Contact<M>&, std::size_t number, const typename M::Impulse& r) {
                iterate_.impulses[first + number] = r;
            };
        };
        const auto of = [](const std::vector<double>& impulses) {
            return [&impulses](std::size_t batch) { return impulses.data() + batch * Group::impulse; };
        };
        read_impulses(walls, problem.wall_contacts, of(wall_impulses_), put_after(0));
        read_impulses(grains, problem.contacts, of(impulses_), put_after(problem.wall_contacts.size()));
        return &iterate_;
    }

  private:
    bool there_ = false;
    detail::Iterate<M> iterate_;  ///< as read() has made it
    AlignedDoubles rows_;
    std::vector<double> wall_impulses_, impulses_;  ///< batch by batch
};

}}}  // namespace nscdd::NSCDD_ABI::detail
