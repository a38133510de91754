// The step without friction as what it is: the velocities nearest to the free ones, in the norm of M, with w >= 0.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

namespace wild {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::SparseMatrix<double>;

// min |V - free|_M^2 / 2 with w = H^T V + bias >= 0. A component: bodies joined by contacts, a driven wall is a body.
struct Quadratic {
    Vector mass, free;                // of each degree of freedom
    Matrix h;                         // degrees of freedom x contacts, along the normals
    Vector bias;                      // of each contact, with what walls are prescribed
    std::vector<Eigen::Index> begin;  // first degree of freedom of each body, then their number; the first has its mass
    std::vector<int> component;       // of each degree of freedom; -1 where nothing touches
    std::vector<int> contact_component;  // of each contact
    int components = 0;

    Vector w(const Vector& v) const { return h.transpose() * v + bias; }
    // |v|_M^2 of each component.
    Vector energies(const Vector& v) const {
        Vector sum = Vector::Zero(components);
        for (Eigen::Index d = 0; d < v.size(); ++d)
            if (const int c = component[static_cast<std::size_t>(d)]; c >= 0) sum[c] += mass[d] * v[d] * v[d];
        return sum;
    }
};

struct Answer {
    Vector v, r;
    bool solved = true;      // the conditions of optimality hold to 1e-9
    bool room = true;        // false: no velocities satisfy w >= 0
    double violation = 0;    // of the conditions, over |V* - free|_M of the component
    double certificate = 0;  // bound of |V - V*|_M over |V* - free|_M of the component
};

// By an active-set method, independent of the kernel.
Answer solve(const Quadratic& problem);

}  // namespace wild
