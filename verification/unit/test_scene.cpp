// Scenes as TOML: everything a good one says arrives, everything wrong in a bad one is named with its line.
#include <string>
#include <vector>

#include "../catch.hpp"
#include "model/scene.hpp"
#include "scratch.hpp"

using namespace nscdd;
using nscdd::test::complaint;
using nscdd::test::Scratch;

namespace {

// Line numbers of the bad cases below count in this text.
const std::string good = R"(name = "triaxial"
dimension = 3
gravity = [0, 0, -9.81]
[packing]
file = "spheres.h5"
material = "glass"
[[grain]]
position = [1, 2, 3]
radius = 0.5
material = "glass"
[[material]]
name = "glass"
density = 2500.0
[[material]]
name = "plate"
density = 7800
[[pair]]
materials = ["plate", "glass"]
friction = 0.3
restitution = 0.1
[[wall]]
name = "left"
side = "x-"
material = "plate"
motion = "fixed"
[[wall]]
name = "slope"
normal = [0.6, 0, 0.8]
through = [0, 0, 1]
material = "plate"
motion = "force"
force = 10
mass = 2
velocity = [0, 1, 0]
[step]
h = 1e-3
count = 50
[solver]
tolerance = 1e-6
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

// The complaint about `text`, without the folder.
std::string complaint_about(const Scratch& scratch, const std::string& text) {
    const std::string path = scratch.write("bad.toml", text);
    const std::string line = complaint<InputError>([&] { read_scene(path); });
    const auto folder = path.size() - std::string("bad.toml").size();
    return line.starts_with(path) ? line.substr(folder) : line;
}

}  // namespace

TEST_CASE("a scene is read whole", "[scene]") {
    const Scratch scratch;
    const Scene scene = read_scene(scratch.write("good.toml", good));

    CHECK(scene.name == "triaxial");
    CHECK(scene.dimension == 3);
    CHECK(scene.gravity == Eigen::Vector3d(0, 0, -9.81));
    CHECK(scene.packing_file == scratch.path("spheres.h5"));
    CHECK(scene.packing_material == 0);

    REQUIRE(scene.materials.size() == 2);
    CHECK(scene.materials[1].name == "plate");
    CHECK(scene.materials[1].density == 7800);
    REQUIRE(scene.pairs.size() == 1);
    CHECK(scene.pairs[0].a == 0);
    CHECK(scene.pairs[0].b == 1);
    CHECK(scene.pairs[0].coefficients.at("friction") == 0.3);
    CHECK(scene.pairs[0].restitution == 0.1);

    REQUIRE(scene.grains.size() == 1);
    CHECK(scene.grains[0].position == Eigen::Vector3d(1, 2, 3));
    CHECK(scene.grains[0].spin == Eigen::Vector3d::Zero());
    CHECK(scene.grains[0].radius == 0.5);

    REQUIRE(scene.walls.size() == 2);
    const SceneWall &left = scene.walls[0], &slope = scene.walls[1];
    CHECK(left.normal == Eigen::Vector3d(1, 0, 0));
    CHECK(left.motion == WallMotion::Fixed);
    CHECK(wall_point(scene, left, {2, 2, 2}) == Eigen::Vector3d::Zero());
    CHECK(slope.motion == WallMotion::Force);
    CHECK(slope.force == 10);
    CHECK(slope.mass == 2.0);
    CHECK(slope.velocity == Eigen::Vector3d(0, 1, 0));
    CHECK(wall_point(scene, slope, {}) == Eigen::Vector3d(0, 0, 1));

    CHECK(scene.step.h == 1e-3);
    CHECK(scene.step.count == 50);
    CHECK(scene.step.theta == 0.5);
    CHECK(scene.step.broad_phase_every == 10);
    CHECK_FALSE(scene.solver.method);
    CHECK(scene.solver.given.size() == 1);
    CHECK(scene.solver.given.at("tolerance") == 1e-6);
}

TEST_CASE("options of the solver follow from the method, and from what is given", "[scene]") {
    const Scratch scratch;
    const auto settings = [&](const std::string& text) {
        return read_scene(scratch.write("own.toml", replaced(good, "tolerance = 1e-6", text))).solver;
    };
    CHECK(settings("sweeps = 2").options(true).window == 2);
    CHECK(settings("sweeps = 2").options(true).sweeps == 2);
    CHECK(settings("sweeps = 2").options(true).max_newton_contacts == 2000);
    CHECK(settings("sweeps = 2").options(false).sweeps == 1);  // a solver that does not sweep
    CHECK(settings("max_distance = 0.2").options(false).bounds.max_distance == 0.2);
    CHECK(settings("method = \"paper\"").options(true).window == 0);
    CHECK(settings("method = \"paper\"").options(true).max_newton_contacts == 0);
    CHECK(settings("method = \"paper\"\nwindow = 3").options(true).window == 3);

    SolveSettings later = settings("max_distance = 0.2\nrelaxation = 1.5");
    later.override_by(settings("max_distance = 0.1"));
    CHECK(later.options(true).bounds.max_distance == 0.1);
    CHECK(later.options(true).relaxation == 1.5);
}

TEST_CASE("names of earlier programs are read", "[scene]") {
    const Scratch scratch;
    const std::string earlier =
        "velocity_error = 0.2\nenergy_made = 2e-3\npenetration = 3e-3\ngap_error = 4e-3\ndistance = 0.5\n"
        "newton_contacts = 6";
    const SolveOptions options =
        read_scene(scratch.write("own.toml", replaced(good, "tolerance = 1e-6", earlier))).solver.options(true);
    CHECK(options.bounds.max_velocity_error == 0.2);
    CHECK(options.bounds.max_energy_gain == 2e-3);
    CHECK(options.bounds.max_penetration == 3e-3);
    CHECK(options.bounds.max_gap_error == 4e-3);
    CHECK(options.bounds.max_distance == 0.5);
    CHECK(options.max_newton_contacts == 6);
    CHECK(read_scene(scratch.write("own.toml", replaced(good, "count = 50", "count = 50\nrough_every = 3")))
              .step.broad_phase_every == 3);
}

TEST_CASE("a scene has the law that it names, else no friction where nothing needs it", "[scene]") {
    const Scratch scratch;
    const auto law = [&](const std::string& text) { return read_scene(scratch.write("law.toml", text)).law; };
    CHECK(law(good) == "coulomb");
    const std::string smooth = replaced(good, "friction = 0.3\n", "");
    const std::string turning = replaced(smooth, "radius = 0.5", "radius = 0.5\nspin = [0, 0, 1]");
    CHECK(law(smooth) == "frictionless");
    CHECK(law(turning) == "coulomb");
    CHECK(law("law = \"coulomb\"\n" + smooth) == "coulomb");
    CHECK(law("law = \"frictionless\"\n" + smooth) == "frictionless");
    CHECK(complaint<InputError>([&] { law("law = \"frictionless\"\n" + turning); }).find("unknown key 'spin'") !=
          std::string::npos);
}

TEST_CASE("a 2D scene has one spin, given bare or as an array", "[scene]") {
    const Scratch scratch;
    const std::string text = R"(name = "disk"
dimension = 2
material = [{name = "a", density = 1}]
step = {h = 0.1, count = 1}
[[grain]]
position = [0, 0]
radius = 1
spin = 3
torque = [4]
material = "a"
[[wall]]
name = "top"
side = "y+"
material = "a"
motion = "velocity"
velocity = [0, -1]
)";
    const Scene scene = read_scene(scratch.write("disk.toml", text));
    CHECK(!scene.packing_file);
    CHECK(scene.grains[0].spin == Eigen::VectorXd::Constant(1, 3));
    CHECK(scene.grains[0].torque == Eigen::VectorXd::Constant(1, 4));
    CHECK(scene.walls[0].normal == Eigen::Vector2d(0, -1));
    CHECK(wall_point(scene, scene.walls[0], {2, 5}) == Eigen::Vector2d(0, 5));
    CHECK_THROWS_WITH(wall_point(scene, scene.walls[0], {}),
                      Catch::Contains("wall 'top': side 'y+' needs the box of a 2D packing, found none"));
}

TEST_CASE("a bad scene is refused in one line that names the place", "[scene][bad-input]") {
    struct Bad {
        std::string from, to, line;
    };
    const std::vector<Bad> cases{
        // syntax
        {"name = \"triaxial\"", "name = ", "bad.toml:1: Error while parsing"},
        {"count = 50\n", "count = f\n", "bad.toml:37: Error while parsing boolean: expected 'false', saw 'f?'"},
        {"radius = 0.5", "radius = 0.5\nradius = 0.6", "bad.toml:10: Error while parsing"},
        // the whole file
        {"name = \"triaxial\"\n", "", "bad.toml:1: name is missing"},
        {"\"triaxial\"", "\"\"", "bad.toml:1: name must not be empty"},
        {"\"triaxial\"", "\"a\\u001bb\"", "bad.toml:1: name must have no control characters"},
        {"\"triaxial\"", "\"a\\u009bb\"", "bad.toml:1: name must have no control characters"},
        {"dimension = 3", "a.b.c.d.e.f.g.h.i.j = 3", "bad.toml:2: a key has more than 8 dots"},
        {"[step]", "[a . b.'='.d.\"#\".f.g.h.i.j]", "bad.toml:35: a key has more than 8 dots"},
        {"[step]", "[\"a.b.c.d.e.f.g.h.i.j\"]", "bad.toml:35: unknown key 'a.b.c.d.e.f.g.h.i.j' (known here: name, "},
        {"[step]", "[steps]", "bad.toml:35: unknown key 'steps' (known here: name, "},
        {"dimension = 3", "x = {y = \"\"\"it's \\\" \"\"\"\"\", a.b.c.d.e.f.g.h.i.j = 3}",
         "bad.toml:2: a key has more than 8 dots"},
        {"dimension = 3", "dimension = 4", "bad.toml:2: dimension must be 2 or 3, found 4"},
        {"dimension = 3", "dimension = 1", "bad.toml:2: dimension must be >= 2, found 1"},
        {"dimension = 3", "dimension = 3.0", "bad.toml:2: dimension must be an integer, found 3"},
        {"gravity = [0, 0, -9.81]", "gravity = [0, -9.81]", "bad.toml:3: gravity must be 3 numbers, found 2"},
        {"-9.81]", "nan]", "bad.toml:3: gravity[2] must be finite, found nan"},
        {"-9.81]", "'x']", "bad.toml:3: gravity[2] must be a number, found 'x'"},
        {"gravity", "grains",
         "bad.toml:3: unknown key 'grains': it is of a specification, of which `nscdd pack` makes a packing"},
        {"gravity", "gravitiy", "bad.toml:3: unknown key 'gravitiy' (known here: name, dimension, gravity, "},
        {"[step]\nh = 1e-3\ncount = 50", "", "bad.toml:1: no [step]"},
        {"[step]", "[[step]]", "bad.toml:35: step must be a table, [step], found an array"},
        {"[[grain]]", "[grain]", "bad.toml:7: grain must be tables, [[grain]]"},
        // packing and grains
        {"file = \"spheres.h5\"\n", "", "bad.toml:4: packing: file is missing"},
        {"material = \"glass\"", "material = \"gold\"", "bad.toml:6: packing: material 'gold' is not a [[material]]"},
        {"radius = 0.5", "radius = -0.5", "bad.toml:9: [[grain]] 0: radius must be > 0, found -0.5"},
        {"radius = 0.5", "radius = inf", "bad.toml:9: [[grain]] 0: radius must be finite, found inf"},
        {"radius = 0.5", "radius = 9007199254740993",
         "bad.toml:9: [[grain]] 0: radius must be a number that a double holds, found 9007199254740993"},
        {"radius = 0.5", "radius = true", "bad.toml:9: [[grain]] 0: radius must be a number, found true"},
        {"radius = 0.5", "raduis = 0.5", "bad.toml:9: [[grain]] 0: unknown key 'raduis' (did you mean 'radius'?)"},
        {"radius = 0.5", "radius = 1\nspin = 1", "bad.toml:10: [[grain]] 0: spin must be 3 numbers, found 1"},
        {"radius = 0.5", "radius = 1\ncolor = 1",
         "bad.toml:10: [[grain]] 0: unknown key 'color' (known here: fixed, position, "},
        // materials and pairs
        {"density = 2500.0", "density = 0", "bad.toml:13: material 'glass': density must be > 0, found 0"},
        {"name = \"plate\"", "name = \"glass\"", "bad.toml:15: material 'glass': name is given twice"},
        {"name = \"plate\"", "name = 3", "bad.toml:15: [[material]] 1: name must be a string, found 3"},
        {"friction = 0.3", "friction = -0.3", "bad.toml:19: pair 'plate'-'glass': friction must be >= 0, found -0.3"},
        {"dimension = 3", "dimension = 3\nlaw = \"glue\"",
         "bad.toml:3: law must be one of frictionless, coulomb, cohesive, rolling, found 'glue'"},
        {"dimension = 3", "dimension = 3\nlaw = \"frictionless\"",
         "bad.toml:20: pair 'plate'-'glass': unknown key 'friction': it is of law = \"coulomb\" or \"cohesive\" or "
         "\"rolling\", and the law is \"frictionless\""},
        {"restitution = 0.1", "restitution = 1.1",
         "bad.toml:20: pair 'plate'-'glass': restitution must be in [0, 1], found 1.1"},
        {"[\"plate\", \"glass\"]", "[\"plate\"]", "bad.toml:18: [[pair]] 0: materials must be 2 strings"},
        {"[\"plate\", \"glass\"]", "[\"plate\", \"a\\nb\"]",
         "bad.toml:18: pair 'plate'-'a?b': materials 'a?b' is not a [[material]]"},
        {"[[wall]]", "[[pair]]\nmaterials = [\"glass\", \"plate\"]\n[[wall]]",
         "bad.toml:21: pair 'glass'-'plate': is given twice"},
        // walls
        {"side = \"x-\"\n", "", "bad.toml:21: wall 'left': needs side, or normal and through"},
        {"side = \"x-\"", "side = \"w\"",
         "bad.toml:23: wall 'left': side must be one of x-, x+, y-, y+, z-, z+, found 'w'"},
        {"motion = \"fixed\"", "motion = \"free\"",
         "bad.toml:25: wall 'left': motion must be one of fixed, velocity, "},
        {"motion = \"fixed\"", "motion = \"velocity\"", "bad.toml:21: wall 'left': velocity is missing"},
        {"motion = \"fixed\"", "motion = \"fixed\"\nforce = 1",
         "bad.toml:26: wall 'left': unknown key 'force' (known here: name, side, material, motion)"},
        {"motion = \"fixed\"", "motion = \"pressure\"\npressure = 1",
         "bad.toml:21: wall 'left': pressure needs a wall on every side of the box, found none on 'x+'"},
        {"name = \"slope\"", "name = \"left\"", "bad.toml:27: wall 'left': name is given twice"},
        {"normal = [0.6, 0, 0.8]\nthrough = [0, 0, 1]", "side = \"x-\"",
         "bad.toml:28: wall 'slope': side 'x-' is taken by wall 'left'"},
        {"[0.6, 0, 0.8]", "[0.6, 0, 0.81]", "bad.toml:28: wall 'slope': normal must have length 1, found 1.00"},
        {"through = [0, 0, 1]\n", "", "bad.toml:26: wall 'slope': through is missing"},
        {"mass = 2", "mass = 0", "bad.toml:33: wall 'slope': mass must be > 0, found 0"},
        {"velocity = [0, 1, 0]", "velocity = [1, 0, 0]", "bad.toml:34: wall 'slope': velocity must be tangential"},
        // step and solver
        {"h = 1e-3", "h = -1e-3", "bad.toml:36: step: h must be > 0, found -0.001"},
        {"count = 50", "count = 0", "bad.toml:37: step: count must be >= 1, found 0"},
        {"count = 50", "count = 3000000000", "bad.toml:37: step: count must be <= 2147483647, found 3000000000"},
        {"count = 50", "count = 50\ntheta = 1.5", "bad.toml:38: step: theta must be in [0, 1], found 1.5"},
        {"tolerance = 1e-6", "tolerance = 0", "bad.toml:39: solver: tolerance must be > 0, found 0"},
        {"tolerance = 1e-6", "window = -1", "bad.toml:39: solver: window must be >= 0, found -1"},
        {"tolerance = 1e-6", "window = 9", "bad.toml:39: solver: window must be <= 8, found 9"},
        {"tolerance = 1e-6", "distance = 0", "bad.toml:39: solver: distance must be > 0, found 0"},
        {"tolerance = 1e-6", "distance = 1\nmax_distance = 1",
         "bad.toml:39: solver: distance is the earlier name of max_distance, which is given too"},
        {"tolerance = 1e-6", "relaxation = 2", "bad.toml:39: solver: relaxation must be in (0, 2), found 2"},
        {"tolerance = 1e-6", "check_every = -1", "bad.toml:39: solver: check_every must be >= 0, found -1"},
        {"tolerance = 1e-6", "sweep = 2",
         "bad.toml:39: solver: unknown key 'sweep' (known here: tolerance, max_velocity_error, "},
    };
    const Scratch scratch;
    for (const Bad& bad : cases) {
        const std::string line = complaint_about(scratch, replaced(good, bad.from, bad.to));
        CAPTURE(bad.from, bad.to);
        CHECK_THAT(line, Catch::StartsWith(bad.line));
        CHECK(line.find('\n') == std::string::npos);
    }
}

TEST_CASE("a scene needs a material, and a wall one plane", "[scene][bad-input]") {
    const Scratch scratch;
    const std::string head = "name = 'a'\ndimension = 2\nstep = {h = 1, count = 1}\n";
    CHECK(complaint_about(scratch, head) == "bad.toml:1: no [[material]]");

    const std::string wall = "[[wall]]\nname = 'a'\nside = 'x-'\nnormal = [1, 0]\nmaterial = 'm'\nmotion = 'fixed'\n";
    CHECK(complaint_about(scratch, head + "material = [{name = 'm', density = 1}]\n" + wall) ==
          "bad.toml:8: wall 'a': unknown key 'normal' (known here: name, side, material, motion)");
}

TEST_CASE("a scene file that is not there, or is a folder, is named", "[scene][bad-input]") {
    const Scratch scratch;
    CHECK_THROWS_WITH(read_scene(scratch.path("none.toml")),
                      scratch.path("none.toml") + ": cannot open: No such file or directory");
    CHECK_THROWS_WITH(read_scene(scratch.path("")), Catch::Contains("is a folder"));
}
