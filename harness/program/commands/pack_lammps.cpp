#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>

#include "commands/child_process.hpp"
#include "commands/lammps_input.hpp"
#include "commands/pack_generators.hpp"
#include "files/replace_file.hpp"

namespace nscdd {

namespace {

namespace fs = std::filesystem;

// A folder beside a file, removed with all that is in it.
class WorkFolder {
  public:
    explicit WorkFolder(const std::string& beside) : path_(beside + ".lammps.XXXXXX") {
        if (!::mkdtemp(path_.data()))
            throw OutputError(fmt::format("{}: no folder can be made beside it: {}", beside, std::strerror(errno)));
    }
    ~WorkFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;

    const std::string& path() const { return path_; }
    std::string file(const char* name) const { return path_ + "/" + name; }

  private:
    std::string path_;
};

// Lengths of LAMMPS are ours times `unit`. Its box leaves room around the walls, in which a grain may overlap them.
template <class M>
std::string grains_data(const std::vector<Grain<M>>& grains, const Cell<M>& cell, double unit) {
    std::string text = fmt::format("grains\n\n{} atoms\n1 atom types\n", grains.size());
    const char* const axes = "xyz";
    for (int d = 0; d < 3; ++d) {
        const bool walls = d < M::dim && !cell.periodic[static_cast<std::size_t>(d)];
        const double low = walls ? -1 : d < M::dim ? 0 : -0.5, high = d < M::dim ? cell.size[d] * unit + walls : 0.5;
        text += fmt::format("{} {} {}lo {}hi\n", low, high, axes[d], axes[d]);
    }
    text += "\nAtoms # sphere\n\n";
    for (const auto& grain : grains) {
        text += fmt::format("{} 1 {} 1", grain.id + 1, 2 * grain.radius * unit);
        for (int d = 0; d < 3; ++d) text += fmt::format(" {}", d < M::dim ? grain.position[d] * unit : 0.0);
        text += '\n';
    }
    return text;
}

// Centres and radii in LAMMPS' lengths, grain by grain.
void read_dump(const std::string& path, std::size_t grains, int dim, Packing& packing) {
    std::istringstream in(read_file(path));
    std::string line;
    while (std::getline(in, line) && !line.starts_with("ITEM: ATOMS")) {
    }
    std::size_t id = 0;
    double x[3] = {}, radius = 0;
    while (in >> id >> x[0] >> x[1] >> x[2] >> radius) {
        packing.radius.push_back(radius);
        packing.x.insert(packing.x.end(), x, x + dim);
        if (id != packing.size() || !(radius > 0)) break;
    }
    if (packing.size() != grains || id != grains || !in.eof())
        throw InputError(fmt::format("the packing that lmp wrote is not the {} grains that it was given", grains));
}

std::string version(const std::string& log) {
    std::ifstream in(log);
    for (std::string line; std::getline(in, line);)
        if (line.starts_with("LAMMPS (")) return line;
    return "LAMMPS";
}

template <class M>
Generated pack_model(const PackSpecification& spec, const std::string& output) {
    Cell<M> cell;
    const std::vector<Grain<M>> grains = throw_grains<M>(spec, cell);
    const double begin = total_mass(grains) / cell.size.prod();
    const double end = spec.solid_fraction > 0 ? spec.solid_fraction : M::dim == 3 ? 0.64 : 0.84;
    const double unit = std::pow(begin / end, 1.0 / M::dim) / (2 * spec.radius);  // mean diameter 1 at the end

    const WorkFolder folder(output);
    replace_file(folder.file("pack.lmp"), lammps_input);
    replace_file(folder.file("grains.data"), grains_data<M>(grains, cell, unit));
    std::vector<std::string> words{"lmp", "-in", "pack.lmp", "-log", "none"};
    const typename M::Vec edges = cell.size * unit;
    const auto set = [&](const char* name, double value) {
        words.insert(words.end(), {"-var", name, fmt::format("{}", value)});
    };
    words.insert(words.end(), {"-var", "dim", std::to_string(M::dim)});
    for (int d = 0; d < 3; ++d) {
        const bool walls = d < M::dim && !cell.periodic[static_cast<std::size_t>(d)];
        words.insert(words.end(), {"-var", std::string("b") + "xyz"[d], walls ? "f" : "p"});
    }
    set("lx", edges[0]);
    set("ly", edges[1]);
    set("lz", M::dim == 3 ? edges[M::dim - 1] : 1.0);
    set("volume", edges.prod());
    set("begin", begin);
    set("target", spec.solid_fraction);
    const std::string log = folder.file("log");
    run_program(words, log, folder.path());

    const std::string dump = folder.file("packed.dump");
    if (!fs::exists(dump)) throw InputError("lmp ended without an error and without a packing (packed.dump)");
    Packing packing;
    packing.dim = M::dim;
    read_dump(dump, grains.size(), M::dim, packing);
    // Back to the radii of the specification, with box and places scaled to them.
    const double grown = std::accumulate(packing.radius.begin(), packing.radius.end(), 0.0);
    double drawn = 0;
    for (const auto& grain : grains) drawn += grain.radius;
    for (double& x : packing.x) x *= drawn / grown;
    for (const auto& grain : grains) packing.radius[static_cast<std::size_t>(grain.id)] = grain.radius;
    for (int d = 0; d < M::dim; ++d) packing.box.push_back(edges[d] * drawn / grown);
    note_periodic(cell, packing);
    return {std::move(packing), version(log)};
}

}  // namespace

Generated pack_by_lammps(const PackSpecification& spec, const std::string& output) {
    return spec.dimension == 3 ? pack_model<Model<3, Frictionless>>(spec, output)
                               : pack_model<Model<2, Frictionless>>(spec, output);
}

}  // namespace nscdd
