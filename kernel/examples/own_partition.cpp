// Your own partition: space is cut in two again and again, each time so that both halves have as many contacts.
//
// Disks lie in one corner of a large box, where equal cells would leave most ranks idle. Checked: every rank gets work,
// the busiest at most 1.3 times the mean, and the step is that of sequential NLGS.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nscdd/nscdd.hpp>

using Model = nscdd::Model<2, nscdd::Coulomb>;
using Vec = Model::Vec;

// The cuts of a binary tree, level by level: the ranks begin to begin + count - 1 share a cell.
struct Halves {
    struct Cut {
        int axis;
        double at;
    };
    int ranks;              // a power of two
    std::vector<Cut> cuts;  // ranks - 1 of them; those below cut c are 2 c + 1 and 2 c + 2

    // The three functions that make it a partition.
    int owner(const Vec& x) const {
        std::size_t c = 0;
        while (c < cuts.size()) c = 2 * c + 1 + (x[cuts[c].axis] >= cuts[c].at);
        return static_cast<int>(c - cuts.size());
    }
    void visit_owners(const Vec& x, double reach, auto&& visit) const { descend(0, x, reach, visit); }
    std::string name() const { return "halves"; }

    void descend(std::size_t c, const Vec& x, double reach, auto&& visit) const {
        if (c >= cuts.size()) return visit(static_cast<int>(c - cuts.size()));
        if (x[cuts[c].axis] - reach < cuts[c].at) descend(2 * c + 1, x, reach, visit);
        if (x[cuts[c].axis] + reach >= cuts[c].at) descend(2 * c + 2, x, reach, visit);
    }
    void cut(std::size_t c, std::vector<Vec> points) {
        if (c >= cuts.size()) return;
        Vec low = Vec::Constant(1e300), high = -low;
        for (const Vec& x : points) low = low.cwiseMin(x), high = high.cwiseMax(x);
        const int axis = !points.empty() && high[1] - low[1] > high[0] - low[0];
        const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
        std::nth_element(points.begin(), middle, points.end(),
                         [axis](const Vec& a, const Vec& b) { return a[axis] < b[axis]; });
        cuts[c] = {axis, points.empty() ? 0 : (*middle)[axis]};
        cut(2 * c + 1, {points.begin(), middle});
        cut(2 * c + 2, {middle, points.end()});
    }
};

// Of the contacts that all ranks have at the moment; before there are any, of the grains.
nscdd::Partition<Model> halves(const nscdd::PartitionInput<Model>& scene) {
    std::vector<nscdd::Communicator::Outbox> out(scene.parts.size());
    double contacts = 0;
    for (const auto& part : scene.parts) contacts += static_cast<double>(part.pairs.size());
    contacts = nscdd::reduce(scene.comm, 1, [&](std::size_t k) { return nscdd::Buffer{k == 0 ? contacts : 0}; })[0];
    for (std::size_t k = 0; k < out.size(); ++k) {
        nscdd::Buffer mine;
        const auto put = [&](const Vec& x) { mine.insert(mine.end(), x.begin(), x.end()); };
        const auto& part = scene.parts[k];
        for (const auto& pair : part.pairs) put(part.grains[static_cast<std::size_t>(pair.i)].position);
        for (std::size_t g = 0; contacts == 0 && g < part.grains.size(); ++g) put(part.grains[g].position);
        for (int rank = 0; rank < scene.comm.size(); ++rank) out[k][rank] = mine;
    }
    const nscdd::Buffer all = scene.comm.route(out)[0];  // the same on every rank
    std::vector<Vec> points;
    for (std::size_t p = 0; p < all.size(); p += 2) points.emplace_back(all[p], all[p + 1]);
    Halves partition{scene.comm.size(), std::vector<Halves::Cut>(static_cast<std::size_t>(scene.comm.size()) - 1)};
    partition.cut(0, std::move(points));
    return partition;
}

int main() {
    std::vector<nscdd::Grain<Model>> grains;
    for (int k = 0; k < 400; ++k) grains.push_back(nscdd::make_grain<Model>(k, 0.5, 1, {0.5 + k % 20, 0.5 + k / 20}));
    grains.push_back(nscdd::make_grain<Model>(400, 0.5, 1, {500, 0.5}));  // far away, so that the box is large
    nscdd::SimulationSettings<Model> settings;
    settings.h = 1e-3;
    settings.gravity = {0, -9.81};
    settings.materials.set(0, 0, {.friction = 0.3});
    settings.walls.resize(3);
    settings.walls[0].normal = {0, 1};
    settings.walls[1].normal = {1, 0};
    settings.walls[2].normal = {-1, 0};
    settings.walls[2].offset = -1000;

    const nscdd::SolveOptions options = nscdd::SolveOptions{.tolerance = 1e-8}.accelerated();
    nscdd::InProcess one(1), eight(8);
    nscdd::Simulation<Model> alone(one, settings, grains);
    settings.partition = {.kind = "halves", .make = halves};
    nscdd::Simulation<Model> shared(eight, settings, grains);
    double difference = 0;
    for (int step = 0; step < 12; ++step) {  // the partition is made anew once contacts are known
        if (!alone.step(nscdd::by_nlgs<Model>(options)).solve.converged) return 1;
        if (!shared.step(nscdd::by_nscdd<nscdd::Dcs<Model>>(options)).solve.converged) return 1;
    }
    const auto a = nscdd::gather_grains(alone), b = nscdd::gather_grains(shared);
    for (std::size_t g = 0; g < a.size(); ++g)
        difference = std::max(difference, (a[g].grain.velocity - b[g].grain.velocity).norm());
    std::size_t total = 0, most = 0, least = grains.size() * 4;
    for (const auto& part : shared.parts()) {
        total += part.pairs.size();
        most = std::max(most, part.pairs.size());
        least = std::min(least, part.pairs.size());
    }
    const double imbalance = 8.0 * static_cast<double>(most) / static_cast<double>(total);
    std::printf("busiest rank %.2f of the mean, idlest %zu of %zu pairs; velocities differ by %.1e m/s\n", imbalance,
                least, total, difference);
    return imbalance < 1.3 && least > 0 && difference < 1e-5 ? 0 : 1;
}
