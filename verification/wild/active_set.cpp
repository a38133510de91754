// Block principal pivoting within proximal steps [Portugal94, Judice94]: W is singular where contacts are redundant,
// and the proximal term makes each inner problem one with a single answer. Outer steps take its influence away.
#include "quadratic.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace wild {

namespace {

// min x.S x/2 + q.x, x >= 0, with ones on the diagonal of S.
class Pivoting {
  public:
    Pivoting(const Matrix& s, const Vector& q) : s_(s), absolute_(s.cwiseAbs()), q_(q), x(Vector::Zero(q.size())) {
        passive_.assign(static_cast<std::size_t>(q.size()), 0);
        for (Eigen::Index i = 0; i < q.size(); ++i) passive_[static_cast<std::size_t>(i)] = q[i] < 0;
    }

    // x becomes the minimum with proximal/2 |x - x_before|^2 added. False if that is not found.
    bool step(double proximal) {
        proximal_ = proximal;
        linear_ = q_ - proximal * x;
        const Vector start = x;
        return exchange_many() || exchange_one(start);
    }

  private:
    bool exchange_many() {
        std::size_t best = passive_.size() + 1;
        for (int tries = 10; tries > 0; --tries) {
            if (!solve(x)) return false;
            const Vector y = gradient(), round_off = noise();
            std::vector<std::size_t> wrong;
            for (std::size_t i = 0; i < passive_.size(); ++i) {
                const auto k = static_cast<Eigen::Index>(i);
                if (passive_[i] ? x[k] < 0 : y[k] < -round_off[k]) wrong.push_back(i);
            }
            if (wrong.empty()) return true;
            if (wrong.size() < best) best = wrong.size(), tries = 10;
            for (const std::size_t i : wrong) passive_[i] = !passive_[i];
        }
        return false;
    }

    bool exchange_one(const Vector& start) {
        x = start.cwiseMax(0);
        std::vector<char> blocked(passive_.size(), 0);  // round-off alone lets them close
        for (std::size_t i = 0; i < passive_.size(); ++i) passive_[i] = x[static_cast<Eigen::Index>(i)] > 0;
        for (std::size_t changes = 0; changes < 20 * passive_.size() + 100; ++changes) {
            Vector aim;
            if (!solve(aim)) return false;
            double part = 1;
            for (Eigen::Index k = 0; k < x.size(); ++k)
                if (aim[k] < 0) part = std::min(part, x[k] / (x[k] - aim[k]));
            if (part < 1) {
                for (std::size_t i = 0; i < passive_.size(); ++i) {
                    const auto k = static_cast<Eigen::Index>(i);
                    const double before = x[k];
                    x[k] += part * (aim[k] - before);
                    if (!(aim[k] < 0) || x[k] > 1e-14 * (before - aim[k])) continue;
                    passive_[i] = 0, x[k] = 0, blocked[i] = part == 0;
                }
                continue;
            }
            if ((aim - x).norm() > 1e-14 * x.norm()) std::ranges::fill(blocked, 0);
            x = aim;
            const Vector y = gradient(), round_off = noise();
            Eigen::Index add = -1;
            for (Eigen::Index k = 0; k < x.size(); ++k)
                if (const auto i = static_cast<std::size_t>(k); !passive_[i] && !blocked[i] && y[k] < -round_off[k])
                    if (add < 0 || y[k] < y[add]) add = k;
            if (add < 0) return true;
            passive_[static_cast<std::size_t>(add)] = 1;
        }
        return false;
    }

    Vector gradient() const { return s_ * x + proximal_ * x + linear_; }
    Vector noise() const { return 1e-14 * (absolute_ * x.cwiseAbs() + linear_.cwiseAbs()); }

    // The minimum with zeros where a contact is not passive. False once too many were asked for.
    bool solve(Vector& result) {
        if (++solves_ > most_solves) return false;
        std::vector<int> place(passive_.size(), -1);
        std::vector<Eigen::Index> members;
        for (std::size_t i = 0; i < passive_.size(); ++i)
            if (passive_[i]) {
                place[i] = static_cast<int>(members.size());
                members.push_back(static_cast<Eigen::Index>(i));
            }
        result = Vector::Zero(x.size());
        if (members.empty()) return true;
        std::vector<Eigen::Triplet<double>> entries;
        Vector right(static_cast<Eigen::Index>(members.size()));
        for (std::size_t k = 0; k < members.size(); ++k) {
            right[static_cast<Eigen::Index>(k)] = -linear_[members[k]];
            for (Matrix::InnerIterator it(s_, members[k]); it; ++it)
                if (const int row = place[static_cast<std::size_t>(it.row())]; row >= 0)
                    entries.emplace_back(row, static_cast<int>(k),
                                         it.value() + (it.row() == members[k] ? proximal_ : 0.0));
        }
        Matrix a(right.size(), right.size());
        a.setFromTriplets(entries.begin(), entries.end());
        Eigen::SimplicialLDLT<Matrix> factors(a);
        if (factors.info() != Eigen::Success) return false;
        Vector y = factors.solve(right);
        y += factors.solve(Vector(right - a * y));
        for (std::size_t k = 0; k < members.size(); ++k) result[members[k]] = y[static_cast<Eigen::Index>(k)];
        return true;
    }

    const Matrix& s_;
    Matrix absolute_;
    const Vector& q_;
    std::vector<char> passive_;  // contacts with an impulse
    Vector linear_;
    static constexpr int most_solves = 1000;  // minutes, where exchanges of one contact hardly get on
    int solves_ = 0;
    double proximal_ = 0;

  public:
    Vector x;
};

// Of one component. `floor`: energy below which nothing is asked to be exact.
Vector solve_component(const Matrix& w, const Vector& q, double floor, Answer& answer) {
    const Vector scale = w.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix s = scale.asDiagonal() * w * scale.asDiagonal();
    const Vector linear = scale.cwiseProduct(q);
    Pivoting pivoting(s, linear);
    double violation = 0, certificate = 0, last = std::numeric_limits<double>::infinity();
    bool room = true;
    for (int outer = 0; outer < 100; ++outer) {
        const Vector before = pivoting.x;
        if (!pivoting.step(outer < 50 ? 1e-12 : 1e-10)) {
            violation = std::numeric_limits<double>::infinity();
            break;
        }
        const Vector &x = pivoting.x, gradient = s * x + linear;
        const double energy = std::max({x.dot(s * x), floor, std::numeric_limits<double>::min()});
        const Vector excess = x.cwiseMin(gradient).cwiseAbs(), closing = (-gradient).cwiseMax(0);
        violation = excess.maxCoeff() / std::sqrt(energy);
        certificate = std::sqrt((x.dot(gradient.cwiseAbs()) + x.dot(closing)) / energy);
        if (violation <= 1e-10 && certificate <= 1e-4) break;
        // no room: impulses that grow along a self-stress which the gaps do not balance (Farkas)
        const Vector d = x - before;
        const double length = d.norm();
        room = outer < 3 || length < 0.5 * last || d.dot(s * d) > 1e-12 * length * length ||
               linear.dot(d) > -1e-6 * length * linear.norm();
        if (!room) break;
        last = length;
    }
    answer.violation = std::max(answer.violation, violation);
    answer.certificate = std::max(answer.certificate, certificate);
    answer.solved = answer.solved && violation <= 1e-9 && certificate <= 1e-2;
    answer.room = answer.room && room;
    return scale.cwiseProduct(pivoting.x);
}

}  // namespace

Answer solve(const Quadratic& problem) {
    Answer answer;
    answer.r = Vector::Zero(problem.bias.size());
    const Vector q = problem.w(problem.free);
    const Matrix w = problem.h.transpose() * problem.mass.cwiseInverse().asDiagonal() * problem.h;
    const Vector round_off = 1e-16 * problem.energies(problem.free);
    std::vector<std::vector<int>> members(static_cast<std::size_t>(problem.components));
    std::vector<int> place(problem.contact_component.size());
    for (std::size_t c = 0; c < place.size(); ++c) {
        auto& of = members[static_cast<std::size_t>(problem.contact_component[c])];
        place[c] = static_cast<int>(of.size());
        of.push_back(static_cast<int>(c));
    }
    for (std::size_t k = 0; k < members.size(); ++k) {
        const auto size = static_cast<Eigen::Index>(members[k].size());
        if (size == 0) continue;
        std::vector<Eigen::Triplet<double>> entries;
        Vector part(size);
        for (Eigen::Index c = 0; c < size; ++c) {
            const int contact = members[k][static_cast<std::size_t>(c)];
            part[c] = q[contact];
            for (Matrix::InnerIterator it(w, contact); it; ++it)
                entries.emplace_back(place[static_cast<std::size_t>(it.row())], c, it.value());
        }
        Matrix block(size, size);
        block.setFromTriplets(entries.begin(), entries.end());
        const Vector r = solve_component(block, part, round_off[static_cast<Eigen::Index>(k)], answer);
        for (Eigen::Index c = 0; c < size; ++c) answer.r[members[k][static_cast<std::size_t>(c)]] = r[c];
    }
    answer.v = problem.free + problem.mass.cwiseInverse().cwiseProduct(problem.h * answer.r);
    return answer;
}

}  // namespace wild
