#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "nscdd/comm/reduce.hpp"
#include "nscdd/iterate/options.hpp"
#include "nscdd/law/distance.hpp"
#include "nscdd/subdomain/subdomain.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// Adds up the changes asked of a body over all its copies. Collective: one message to each neighbour.
template <class M>
void add_asked(std::span<const Subdomain<M>> parts, Communicator& comm, std::span<DistanceSums<M>> sums) {
    if (comm.size() == 1) return;
    constexpr std::size_t width = Asked<M>::numbers;
    const auto channel = comm.open(links_between(parts, width));
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t l = 0; l < parts[k].neighbours.size(); ++l) {
            double* to = channel->send(k, l).data();
            for (const int grain : parts[k].linked[l])
                each_member(sums[k].asked[static_cast<std::size_t>(grain)].summed(),
                            [&to](std::span<double> x) { to = std::copy(x.begin(), x.end(), to); });
        }
    channel->start();
    channel->finish();
    for (std::size_t k = 0; k < parts.size(); ++k)
        for (std::size_t l = 0; l < parts[k].neighbours.size(); ++l) {
            const double* from = channel->recv(k, l).data();
            for (const int grain : parts[k].linked[l])
                each_member(sums[k].asked[static_cast<std::size_t>(grain)].summed(), [&from](std::span<double> x) {
                    for (double& number : x) number += *from++;
                });
        }
}

/// Components that reach across subdomains. Grains and driven walls with copies join the parts that each subdomain
/// sees.
template <class M>
class JoinedComponents {
  public:
    /// Finds the components of problems as they are solved. Collective: one message to each neighbour, a gathering of
    /// the pairs of components that meet, and a reduction of the shapes of those that do.
    JoinedComponents(std::span<const Subdomain<M>> parts, Communicator& comm, std::span<DistanceSums<M>> sums)
        : shapes_(parts.size()), joined_(parts.size()), estimates_(parts.size()) {
        comm.each_rank([&](std::size_t k) {
            shapes_[k] = sums[k].shapes(parts[k].problem);
            joined_[k].assign(shapes_[k].size(), -1);
            estimates_[k].resize(shapes_[k].size());
        });
        if (comm.size() == 1) return;
        number_joined(parts, all_meetings(parts, comm, sums));
        if (count_ > 0) reduce_shapes(comm);
    }

    /// The estimate of the scene, with the same bits on every rank. `sums` are added up. Collective.
    DistanceEstimate estimate(Communicator& comm, std::span<const DistanceSums<M>> sums,
                              const ResidualParts& residual) {
        // of each joined component, and of the scene; then what each rank has for itself
        constexpr std::size_t width = std::tuple_size_v<decltype(ComponentSums{}.summed())>;
        const std::span<const double> all = nscdd::reduce(comm, (count_ + 1) * width, [&](std::size_t k) {
            std::vector<ComponentSums> totals(count_ + 1);
            DistanceEstimate own;
            for (std::size_t c = 0; c < shapes_[k].size(); ++c) {
                const ComponentSums& mine = sums[k].components[c];
                totals[count_] += mine;
                if (joined_[k][c] >= 0) {
                    totals[static_cast<std::size_t>(joined_[k][c])] += mine;
                    continue;
                }
                estimates_[k][c] = {};
                estimates_[k][c].note(mine, shapes_[k][c].mass, shapes_[k][c].length(), residual);
                own.note(estimates_[k][c]);
            }
            return rows_of(totals, own);
        });
        std::vector<ComponentSums> totals(count_ + 1);
        DistanceEstimate estimate;
        read_rows(all, totals, estimate);
        for (std::size_t c = 0; c < count_; ++c) {
            joined_estimates_[c] = {};
            joined_estimates_[c].note(totals[c], joined_shapes_[c].mass, joined_shapes_[c].length(), residual);
            estimate.note(joined_estimates_[c]);
        }
        estimate.note_scene(totals[count_], residual);
        return estimate;
    }

    /// Number of the component with this label on the k-th hosted rank among those that reach across subdomains, or -1.
    int number(std::size_t k, std::size_t label) const { return joined_[k][label]; }
    /// Whole shape of the component.
    const ComponentShape<M>& shape(std::size_t k, std::size_t label) const {
        return number(k, label) < 0 ? shapes_[k][label] : joined_shapes_[static_cast<std::size_t>(number(k, label))];
    }
    /// Last estimate of the component.
    const DistanceEstimate& estimate(std::size_t k, std::size_t label) const {
        return number(k, label) < 0 ? estimates_[k][label]
                                    : joined_estimates_[static_cast<std::size_t>(number(k, label))];
    }

  private:
    static void append(const Buffer& numbers, Buffer& out) { out.insert(out.end(), numbers.begin(), numbers.end()); }
    /// Names a component of a subdomain by one number, 2^31 its rank and its label. Walls have a rank of their own.
    static double name(int rank, int label) { return static_cast<double>(std::int64_t{rank} << 31 | label); }

    /// Pairs of names that are one component, of all ranks, one after the other.
    static Buffer all_meetings(std::span<const Subdomain<M>> parts, Communicator& comm,
                               std::span<DistanceSums<M>> sums) {
        const auto channel = comm.open(links_between(parts, 1));
        const auto label = [&](std::size_t k, int grain) {
            return sums[k].labels(parts[k].problem).of_body(static_cast<std::size_t>(grain));
        };
        comm.each_rank([&](std::size_t k) {
            for (std::size_t l = 0; l < parts[k].neighbours.size(); ++l)
                std::transform(parts[k].linked[l].begin(), parts[k].linked[l].end(), channel->send(k, l).begin(),
                               [&](int grain) { return double(label(k, grain)); });
        });
        channel->start();
        channel->finish();
        std::vector<Buffer> mine(parts.size());
        comm.each_rank([&](std::size_t k) {
            std::vector<std::pair<double, double>> pairs;
            for (std::size_t l = 0; l < parts[k].neighbours.size(); ++l) {
                if (parts[k].neighbours[l] < parts[k].rank) continue;  // which names the pair
                for (std::size_t n = 0; n < parts[k].linked[l].size(); ++n) {
                    const int own = label(k, parts[k].linked[l][n]), other = static_cast<int>(channel->recv(k, l)[n]);
                    if (own >= 0 && other >= 0)
                        pairs.emplace_back(name(parts[k].rank, own), name(parts[k].neighbours[l], other));
                }
            }
            const auto& labels = sums[k].labels(parts[k].problem);
            for (std::size_t w = 0; w < parts[k].problem.walls.size(); ++w)
                if (labels.of_wall(w) >= 0)
                    pairs.emplace_back(name(parts[k].rank, labels.of_wall(w)), name(comm.size(), static_cast<int>(w)));
            std::sort(pairs.begin(), pairs.end());
            pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
            for (const auto& [a, b] : pairs) append({a, b}, mine[k]);
        });
        const double most =
            nscdd::reduce(comm, 0, [&mine](std::size_t k) { return Buffer{double(mine[k].size())}; })[0];
        for (Buffer& pairs : mine) pairs.resize(static_cast<std::size_t>(most), -1.0);
        const std::span<const double> all = comm.all_gather(mine);
        return {all.begin(), all.end()};
    }

    /// Numbers the components that reach across, in the order of their least names.
    void number_joined(std::span<const Subdomain<M>> parts, const Buffer& meetings) {
        Buffer names;
        for (const double x : meetings)
            if (x >= 0) names.push_back(x);
        std::sort(names.begin(), names.end());
        names.erase(std::unique(names.begin(), names.end()), names.end());
        const auto place = [&names](double x) {
            const auto at = std::lower_bound(names.begin(), names.end(), x);
            return at != names.end() && *at == x ? static_cast<int>(at - names.begin()) : -1;
        };
        UnionFind sets(names.size());
        for (std::size_t p = 0; p + 1 < meetings.size(); p += 2)
            if (meetings[p] >= 0) sets.join(place(meetings[p]), place(meetings[p + 1]));
        std::vector<int> number(names.size(), -1);
        for (std::size_t n = 0; n < names.size(); ++n)
            if (sets.find(static_cast<int>(n)) == static_cast<int>(n)) number[n] = static_cast<int>(count_++);
        for (std::size_t k = 0; k < parts.size(); ++k)
            for (std::size_t c = 0; c < joined_[k].size(); ++c)
                if (const int at = place(name(parts[k].rank, static_cast<int>(c))); at >= 0)
                    joined_[k][c] = number[static_cast<std::size_t>(sets.find(at))];
    }

    /// Puts members as a reduction takes them: first all that are summed, then all of which the largest counts.
    template <class T, class... Last>
    static Buffer rows_of(std::vector<T>& rows, Last&... last) {
        Buffer out;
        const auto put = [&out](std::span<double> x) { out.insert(out.end(), x.begin(), x.end()); };
        for (T& row : rows) each_member(row.summed(), put);
        for (T& row : rows) each_member(row.largest(), put);
        (each_member(last.largest(), put), ...);
        return out;
    }
    template <class T, class... Last>
    static void read_rows(std::span<const double> all, std::vector<T>& rows, Last&... last) {  // inverse of rows_of()
        auto take = [from = all.data()](std::span<double> x) mutable {
            for (double& number : x) number = *from++;
        };
        for (T& row : rows) each_member(row.summed(), std::ref(take));
        for (T& row : rows) each_member(row.largest(), std::ref(take));
        (each_member(last.largest(), std::ref(take)), ...);
    }

    void reduce_shapes(Communicator& comm) {
        std::size_t summed = 0;
        each_member(ComponentShape<M>{}.summed(), [&summed](std::span<double> x) { summed += x.size(); });
        const std::span<const double> all = nscdd::reduce(comm, count_ * summed, [&](std::size_t k) {
            std::vector<ComponentShape<M>> own(count_);
            for (std::size_t c = 0; c < shapes_[k].size(); ++c)
                if (joined_[k][c] >= 0) own[static_cast<std::size_t>(joined_[k][c])].merge(shapes_[k][c]);
            return rows_of(own);
        });
        joined_shapes_.resize(count_);
        joined_estimates_.resize(count_);
        read_rows(all, joined_shapes_);
    }

    std::vector<std::vector<ComponentShape<M>>> shapes_;  ///< by hosted rank and label
    std::vector<std::vector<int>> joined_;  ///< by hosted rank and label: number of the joined component, or -1
    std::vector<std::vector<DistanceEstimate>> estimates_;  ///< by rank and label, of those not joined
    std::size_t count_ = 0;                                 ///< number of joined components
    std::vector<ComponentShape<M>> joined_shapes_;          ///< by number
    std::vector<DistanceEstimate> joined_estimates_;        ///< by number
};

/// Solves the components that are far from an answer, where sweeps get nowhere. hand_over() of hand_over.hpp does it by
/// Newton's method. With null none are solved.
template <class M>
using HandOver = HandedOver (*)(std::span<Subdomain<M>> parts, Communicator& comm, std::span<DistanceSums<M>> sums,
                                JoinedComponents<M>& joined, const ResidualParts& residual,
                                const SolveOptions& options);

template <class M>
void check_hand_over(const SolveOptions& options, HandOver<M> hand_over) {
    if (SolvedOnCone<typename M::Law> && options.max_newton_contacts > 0 && !hand_over)
        throw std::invalid_argument(
            "max_newton_contacts needs nscdd/reference.hpp and newton_where_stalled<M>() beside the options");
}

}}}  // namespace nscdd::NSCDD_ABI::detail
