#include "arguments.hpp"

#include <lammps/atom.h>
#include <lammps/error.h>
#include <lammps/utils.h>

#include <cstring>
#include <numbers>
#include <stdexcept>

namespace nscdd {
namespace {

using M = FixArguments::M;
using Vec = M::Vec;

// Words one after the other. Errors are LAMMPS' own, in one line.
class Words {
  public:
    Words(LAMMPS_NS::LAMMPS* lmp, int count, char** words) : lmp_(lmp), count_(count), words_(words) {}

    bool more() const { return at_ < count_; }
    std::string next() {
        if (!more()) refuse("`" + keyword_ + "` lacks a value");
        return words_[at_++];
    }
    void next_keyword() {
        keyword_.clear();
        keyword_ = next();
    }
    const std::string& keyword() const { return keyword_; }
    double number() { return LAMMPS_NS::utils::numeric(FLERR, next().c_str(), false, lmp_); }
    int whole() { return LAMMPS_NS::utils::inumeric(FLERR, next().c_str(), false, lmp_); }
    int axis() {
        const std::string word = next();
        if (word.size() != 1 || word[0] < 'x' || word[0] > 'z') refuse("`" + word + "` is none of x, y, z");
        return word[0] - 'x';
    }
    // Atom types such as 2, * or 1*3, from 1 on.
    std::pair<int, int> types() {
        std::pair<int, int> range;
        LAMMPS_NS::utils::bounds(FLERR, next(), 1, lmp_->atom->ntypes, range.first, range.second, lmp_->error);
        return range;
    }
    [[noreturn]] void refuse(const std::string& why) const { lmp_->error->all(FLERR, "Fix nscdd: " + why); }

  private:
    LAMMPS_NS::LAMMPS* lmp_;
    int count_, at_ = 3;
    char** words_;
    std::string keyword_;
};

class Reader {
  public:
    Reader(LAMMPS_NS::LAMMPS* lmp, int count, char** words) : lmp_(lmp), words_(lmp, count, words) {
        read_.options.max_newton_contacts = 2000;
        read_.options = read_.options.accelerated();
        read_.settings.materials = Materials<M>(lmp->atom->ntypes + 1);
        read_.settings.materials.set(0, 0, {});  // no friction unless the input says so
        read_.settings.may_be_empty = true;
        read_.settings.partition = by_bisection<M>();  // the program's
    }

    FixArguments all() {
        while (words_.more()) {
            words_.next_keyword();
            if (!about_contacts() && !about_walls() && !about_solver())
                words_.refuse("unknown keyword `" + words_.keyword() + "`");
        }
        detail::check_options(read_.options);
        return std::move(read_);
    }

  private:
    bool is(const char* keyword) const { return words_.keyword() == keyword; }

    // Materials a to b, with c to d, from 0 on.
    void set(std::pair<int, int> ab, std::pair<int, int> cd, auto&& change) {
        for (int a = ab.first; a <= ab.second; ++a)
            for (int c = cd.first; c <= cd.second; ++c) {
                Coulomb::Pairing pairing = read_.settings.materials(a, c);
                change(pairing);
                read_.settings.materials.set(a, c, pairing);
            }
    }
    std::pair<int, int> types() {
        const auto [first, last] = words_.types();
        return {first - 1, last - 1};
    }

    bool about_contacts() {
        const int walls = read_.wall_material();
        const std::pair all{0, walls};
        if (is("friction") || is("restitution")) {
            const auto member = is("friction") ? &Coulomb::Pairing::friction : &Coulomb::Pairing::restitution;
            const double value = words_.number();
            set(all, all, [=](Coulomb::Pairing& p) { p.*member = value; });
        } else if (is("coeff") || is("wall_coeff")) {
            const std::pair<int, int> first = types(), second = is("coeff") ? types() : std::pair(walls, walls);
            const double friction = words_.number(), restitution = words_.number();
            set(first, second, [=](Coulomb::Pairing& p) { p = {friction, restitution}; });
        } else if (is("gravity")) {
            const double size = words_.number();
            if (words_.next() != "vector") words_.refuse("gravity takes: magnitude vector x y z");
            Vec way;
            for (int d = 0; d < 3; ++d) way[d] = words_.number();
            if (!(way.norm() > 0)) words_.refuse("gravity has no direction");
            read_.settings.gravity = size * way.normalized();
        } else {
            return false;
        }
        return true;
    }

    bool about_walls() {
        if (is("wall")) {
            first_wall_ = read_.settings.walls.size(), first_obstacle_ = read_.settings.obstacles.size();
            add_wall(words_.next());
        } else if (is("region")) {
            add_region(lmp_, words_.next(), read_);
            first_wall_ = read_.settings.walls.size(), first_obstacle_ = read_.settings.obstacles.size();
        } else if (is("wiggle")) {
            const int axis = words_.axis();
            const double amplitude = words_.number(), period = words_.number();
            if (!(period > 0)) words_.refuse("the period of wiggle must be positive");
            // amplitude (1 - cos(2 pi t / period)), as LAMMPS has it
            follow(oscillation<M>(amplitude * Vec::Unit(axis), 1 / period, -0.5 * std::numbers::pi));
        } else if (is("shear")) {
            const int axis = words_.axis();
            for (const Wall<M>& wall : std::span(read_.settings.walls).subspan(first_wall_))
                if (wall.normal[axis] != 0) words_.refuse("shear moves a plane along itself");
            follow(steady<M>(words_.number() * Vec::Unit(axis)));
        } else {
            return false;
        }
        return true;
    }
    void add_wall(const std::string& style) {
        const auto axis = std::string("xyz").find(style[0]);
        const std::string shape = style.substr(1);
        if (axis > 2 || (shape != "plane" && shape != "cylinder"))
            words_.refuse("wall `" + style + "` is none of xplane, yplane, zplane, xcylinder, ycylinder, zcylinder");
        const int d = static_cast<int>(axis);
        if (shape == "cylinder") return read_.add_cylinder(style, Vec::Zero(), d, words_.number());
        for (const double side : {1.0, -1.0}) {
            const std::string place = words_.next();
            if (place == "NULL") continue;
            const double offset = LAMMPS_NS::utils::numeric(FLERR, place.c_str(), false, lmp_);
            read_.add_plane(style + (side > 0 ? " lo" : " hi"), side * Vec::Unit(d), side * offset);
        }
    }
    // Of the walls of the last `wall`.
    void follow(const detail::Path<M>& path) {
        const auto walls = std::span(read_.settings.walls).subspan(first_wall_);
        const auto obstacles = std::span(read_.settings.obstacles).subspan(first_obstacle_);
        if (walls.empty() && obstacles.empty()) words_.refuse("`" + words_.keyword() + "` stands behind a `wall`");
        for (auto& wall : walls) wall.path = path;
        for (auto& obstacle : obstacles) obstacle.path = path;
    }

    bool about_solver() {
        bool found = true;
        if (is("theta")) {
            read_.settings.theta = words_.number();
        } else if (is("largest_overlap")) {
            read_.settings.largest_overlap = words_.number();
        } else if (is("subdomains")) {
            const std::string kind = words_.next();
            if (kind != "lammps" && kind != "bisection") words_.refuse("subdomains are `lammps` or `bisection`");
            read_.bricks = kind == "lammps";
        } else {
            found = false;
            detail::visit_options(read_.options, [&](const detail::OptionInfo& info, auto& value) {
                if (!is(info.name)) return;
                if constexpr (std::is_same_v<decltype(value), int&>)
                    value = words_.whole();
                else
                    value = words_.number();
                found = true;
            });
        }
        return found;
    }

    LAMMPS_NS::LAMMPS* lmp_;
    Words words_;
    FixArguments read_;
    std::size_t first_wall_ = 0, first_obstacle_ = 0;  // of the last `wall`
};

}  // namespace

void FixArguments::add_plane(const std::string& name, const Vec& normal, double offset) {
    Wall<M>& wall = settings.walls.emplace_back();
    wall.material = wall_material();
    wall.normal = normal;
    wall.offset = offset;
    wall_names.push_back(name);
}

void FixArguments::add_cylinder(const std::string& name, const Vec& centre, int axis, double radius) {
    Obstacle<M>& obstacle = settings.obstacles.emplace_back();
    obstacle.material = wall_material();
    obstacle.surface = make_surface<M>(Cylinder<M>{.centre = centre, .axis = Vec::Unit(axis), .radius = radius});
    obstacle_names.push_back(name);
}

FixArguments read_arguments(LAMMPS_NS::LAMMPS* lmp, int count, char** words) {
    try {
        return Reader(lmp, count, words).all();
    } catch (const std::invalid_argument& wrong) {  // of the kernel, the same on every rank
        lmp->error->all(FLERR, std::string("Fix nscdd: ") + wrong.what());
    }
}

}  // namespace nscdd
