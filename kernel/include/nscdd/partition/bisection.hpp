#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/partition/partition.hpp"
#include "nscdd/partition/weights.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

namespace detail {

/// Recursive coordinate bisection. Space is cut across its longest side so that both halves have their share of the
/// candidates. Each half is cut again, until there is one piece for each rank.
template <class M>
class Bisection {
  public:
    using Vec = typename M::Vec;
    /// A cut. Points with x[axis] < at are on the first side, which has half of the ranks, rounded down.
    struct Cut {
        int axis = 0;   ///< 0 to dim-1
        double at = 0;  ///< place of the cut on the axis [m]
    };

    /// Takes the cuts of the tree: each comes before those of its first side, these before those of the other. There is
    /// one fewer than ranks. Throws std::invalid_argument for another number of them, an axis out of range, or a place
    /// that is not finite.
    Bisection(std::vector<Cut> cuts, int ranks) : cuts_(std::move(cuts)), ranks_(ranks) {
        if (ranks < 1 || cuts_.size() + 1 != static_cast<std::size_t>(ranks))
            throw std::invalid_argument("a bisection has one cut fewer than ranks (" + std::to_string(ranks) + ")");
        for (const Cut& cut : cuts_)
            if (cut.axis < 0 || cut.axis >= M::dim || !std::isfinite(cut.at))
                throw std::invalid_argument("a cut of a bisection is not valid");
    }

    /// Rank whose piece the point is in.
    int owner(const Vec& point) const {
        int first = 0;
        std::size_t node = 0;
        for (int count = ranks_; count > 1;) {
            const int low = count / 2;
            if (point[cuts_[node].axis] < cuts_[node].at) {
                ++node, count = low;
            } else {
                node += static_cast<std::size_t>(low), first += low, count -= low;
            }
        }
        return first;
    }

    /// Calls visit(rank) once for each rank whose piece comes within `reach` [m] (per axis) of the point, ascending.
    void visit_owners(const Vec& point, double reach, auto&& visit) const {
        visit_below(0, 0, ranks_, point, reach, visit);
    }

    std::string name() const { return "bisection into " + std::to_string(ranks_); }  ///< name, with the number of ranks
    /// Axis and place [m] of each cut, for Partitioner::restore.
    Buffer numbers() const {
        Buffer out;
        for (const Cut& cut : cuts_) out.insert(out.end(), {double(cut.axis), cut.at});
        return out;
    }

  private:
    void visit_below(std::size_t node, int first, int count, const Vec& point, double reach, auto&& visit) const {
        if (count == 1) return visit(first);
        const Cut& cut = cuts_[node];
        const int low = count / 2;
        if (point[cut.axis] - reach < cut.at) visit_below(node + 1, first, low, point, reach, visit);
        if (!(point[cut.axis] + reach < cut.at))
            visit_below(node + static_cast<std::size_t>(low), first + low, count - low, point, reach, visit);
    }

    std::vector<Cut> cuts_;
    int ranks_;
};

/// Cuts all pieces of a level together. A process has its own points alone, and counts those of all its ranks as one:
/// so memory grows with the pieces, not with pieces times ranks. One reduction counts the points of all processes in
/// each slice of a piece.
template <class M>
class Bisector {
  public:
    using Vec = typename M::Vec;

    explicit Bisector(const PartitionInput<M>& scene) : comm_(scene.comm), points_(scene.parts.size()) {
        const std::vector<Subdomain<M>>& parts = scene.parts;
        const bool candidates = detail::any_candidates(parts, comm_);
        for (std::size_t k = 0; k < parts.size(); ++k) {
            const auto add = [&](const Vec& x) { points_[k].push_back({x, 0}); };
            if (candidates)
                detail::visit_candidates(parts[k], [&](const Vec& midpoint, const Vec&, const Vec&) { add(midpoint); });
            else
                for (std::size_t g = 0; g < parts[k].grains.size(); ++g)
                    if (parts[k].primary(g)) add(parts[k].grains[g].position);
        }
        cuts_.resize(static_cast<std::size_t>(comm_.size()) - 1);
        if (comm_.size() > 1) pieces_.push_back({0, comm_.size(), scene.box.low, scene.box.high});
    }

    Bisection<M> bisect() {
        while (!pieces_.empty()) {
            shrink_to_points();
            for (int round = 1; round <= rounds; ++round) narrow(round == rounds);
            split();
        }
        return Bisection<M>(std::move(cuts_), comm_.size());
    }

  private:
    static constexpr int slices = 16, rounds = 4;  ///< a cut is good to 16^-4 of its piece

    struct Point {
        Vec x;
        int piece;  ///< number of the piece that it is in; -1: it has its rank
    };
    struct Piece {
        std::size_t node;  ///< of its cut
        int count;         ///< ranks
        Vec low, high;
        int axis = 0;
        double from = 0, to = 0;  ///< the cut is between them

        double place(int border) const { return border < slices ? from + (to - from) * border / slices : to; }
        int slice(double x) const {  // of from <= x < to
            const double at = (x - from) / (to - from) * slices;
            int slice = at > 0 ? (std::min)(static_cast<int>(at), slices - 1) : 0;
            // else round-off could choose a slice whose borders do not enclose x
            while (slice > 0 && x < place(slice)) --slice;
            while (x >= place(slice + 1)) ++slice;
            return slice;
        }
    };

    /// Shrinks each piece to the box of its points, along whose longest side it is cut. Pieces without points keep
    /// their box.
    void shrink_to_points() {
        constexpr double none = -std::numeric_limits<double>::infinity();
        constexpr std::size_t size = 2 * M::dim;
        std::vector<Buffer> mine(points_.size());
        mine[0].assign(pieces_.size() * size, none);
        visit_points([&](std::size_t piece, const Vec& x) {
            for (std::size_t d = 0; d < M::dim; ++d) {
                // minus the lowest coordinate, because reduce() takes the largest
                double& low = mine[0][piece * size + d];
                double& high = mine[0][piece * size + M::dim + d];
                low = (std::max)(low, -x[static_cast<int>(d)]);
                high = (std::max)(high, x[static_cast<int>(d)]);
            }
        });
        const std::span<const double> most = comm_.reduce(mine, 0);
        for (std::size_t p = 0; p < pieces_.size(); ++p) {
            Piece& piece = pieces_[p];
            const double* box = &most[p * size];
            if (box[0] > none) {
                piece.low = -Eigen::Map<const Vec>(box);
                piece.high = Eigen::Map<const Vec>(box + M::dim);
            }
            (piece.high - piece.low).maxCoeff(&piece.axis);
            piece.from = piece.low[piece.axis];
            piece.to = std::nextafter(piece.high[piece.axis], -none);
        }
    }

    /// Narrows from and to to the slice at which the first side has its share; `last`: to the better border of that
    /// slice.
    void narrow(bool last) {
        constexpr std::size_t size = slices + 2;  // points below, in each slice, above
        std::vector<Buffer> mine(points_.size());
        mine[0].assign(pieces_.size() * size, 0.0);
        visit_points([&](std::size_t p, const Vec& point) {
            const Piece& piece = pieces_[p];
            const double x = point[piece.axis];
            const int at = x < piece.from ? 0 : x < piece.to ? 1 + piece.slice(x) : slices + 1;
            ++mine[0][p * size + static_cast<std::size_t>(at)];
        });
        const std::span<const double> counts = comm_.reduce(mine, pieces_.size() * size);
        for (std::size_t p = 0; p < pieces_.size(); ++p) {
            Piece& piece = pieces_[p];
            const auto count = counts.begin() + static_cast<std::ptrdiff_t>(p * size);
            const double all = std::accumulate(count, count + size, 0.0),
                         share = static_cast<double>(piece.count / 2) / piece.count;
            if (all == 0) {
                piece.from = piece.to = piece.from + share * (piece.to - piece.from);
                continue;
            }
            double before = count[0];
            int slice = 0;
            while (slice + 1 < slices && before + count[slice + 1] < share * all) before += count[++slice];
            const double after = before + count[slice + 1];
            const double from = piece.place(slice), to = piece.place(slice + 1);
            piece.from = last && after - share * all < share * all - before ? to : from;
            piece.to = last ? piece.from : to;
        }
    }

    void split() {
        std::vector<Piece> halves;
        std::vector<std::array<int, 2>> half_of(pieces_.size(), {-1, -1});
        for (std::size_t p = 0; p < pieces_.size(); ++p) {
            const Piece& piece = pieces_[p];
            cuts_[piece.node] = {piece.axis, piece.from};
            const int low = piece.count / 2;
            for (const int side : {0, 1}) {
                Piece half = piece;
                (side == 0 ? half.high : half.low)[piece.axis] = piece.from;
                half.node += static_cast<std::size_t>(side == 0 ? 1 : low);
                half.count = side == 0 ? low : piece.count - low;
                if (half.count == 1) continue;
                half_of[p][static_cast<std::size_t>(side)] = static_cast<int>(halves.size());
                halves.push_back(half);
            }
        }
        for (auto& points : points_)
            for (Point& point : points)
                if (point.piece >= 0) {
                    const Piece& piece = pieces_[static_cast<std::size_t>(point.piece)];
                    point.piece = half_of[static_cast<std::size_t>(point.piece)][point.x[piece.axis] >= piece.from];
                }
        pieces_.swap(halves);
    }

    /// Calls visit(piece, point) for the points in pieces still to be cut.
    void visit_points(auto&& visit) const {
        for (const auto& points : points_)
            for (const Point& point : points)
                if (point.piece >= 0) visit(static_cast<std::size_t>(point.piece), point.x);
    }

    Communicator& comm_;
    std::vector<std::vector<Point>> points_;  ///< per hosted rank
    std::vector<Piece> pieces_;               ///< of this level
    std::vector<typename Bisection<M>::Cut> cuts_;
};

}  // namespace detail

/// Deals out the candidates of the last broad phase, or the grains before the first one. For `imbalance` see
/// Partitioner.
template <class M>
Partitioner<M> by_bisection(double imbalance = detail::default_imbalance) {
    const auto make = [](const PartitionInput<M>& scene) { return detail::Bisector<M>(scene).bisect(); };
    const auto restore = [](std::span<const double> numbers, int ranks) -> std::optional<Partition<M>> {
        std::vector<typename detail::Bisection<M>::Cut> cuts;
        if (numbers.size() != 2 * static_cast<std::size_t>(ranks - 1)) return {};
        for (std::size_t k = 0; k < numbers.size(); k += 2) {
            if (!(numbers[k] >= 0 && numbers[k] < M::dim) || !std::isfinite(numbers[k + 1])) return {};
            cuts.push_back({static_cast<int>(numbers[k]), numbers[k + 1]});
        }
        return detail::Bisection<M>(std::move(cuts), ranks);
    };
    return {.kind = "bisection", .make = make, .restore = restore, .imbalance = imbalance};
}

}}  // namespace nscdd::NSCDD_ABI
