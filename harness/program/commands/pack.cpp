#include "commands/pack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "commands/child_process.hpp"
#include "commands/number_option.hpp"
#include "commands/pack_generators.hpp"
#include "commands/packing_checks.hpp"
#include "files/replace_file.hpp"
#include "files/say.hpp"
#include "files/toml_table.hpp"

namespace nscdd {

namespace {

const std::vector<std::string> generators{"auto", "lammps", "own"};

// Sets `generator` to that of the file where the command line names none.
PackSpecification read_specification(const std::string& path, std::optional<std::string>& generator) {
    const toml::table root = parse_toml(path);
    TomlTable table(root, path, "");
    for (const char* key : {"material", "step", "wall"})
        if (root.contains(key))
            table.fail(key, "is of a scene, which `nscdd run` reads; a specification has no such table");
    PackSpecification spec;
    spec.path = path;
    spec.dimension = table.integer("dimension", detail::OptionRange{2});
    if (spec.dimension > 3) table.fail("dimension", fmt::format("must be 2 or 3, found {}", spec.dimension));
    spec.grains = table.integer("grains", detail::OptionRange{1});
    spec.seed = table.integer("seed", detail::OptionRange{0}, 1);
    spec.radius = table.number("radius", {1e-50, 1e50}, 0.5);
    spec.spread = table.number("spread", {0, 0.9}, 0.0);
    spec.largest = spec.radius * (1 + spec.spread);
    if (auto radii = table.table("radii")) {
        for (const char* key : {"radius", "spread"})
            if (root.contains(key)) table.fail(key, "is given, and [radii] too");
        spec.radii = read_radii(*radii, spec.dimension);
        spec.drawn = draw_radii(*spec.radii, spec.grains, spec.dimension, static_cast<std::uint64_t>(spec.seed), path);
        spec.radius = std::accumulate(spec.drawn.begin(), spec.drawn.end(), 0.0) / spec.grains;
        spec.largest = std::ranges::max(spec.drawn);
        spec.spread = 1;  // no bounds of a jammed packing are known for it
    }
    spec.aspect = table.vector("aspect", spec.dimension, Eigen::VectorXd::Ones(spec.dimension));
    if (spec.aspect.minCoeff() <= 0) table.fail("aspect", "must be positive");
    if (table.has("periodic")) spec.periodic = table.axes("periodic", spec.dimension);
    spec.loose_fraction = spec.dimension == 3 ? 0.3 : 0.45;  // random placing gets slow above
    spec.solid_fraction = table.number("solid_fraction", any_number, spec.solid_fraction);
    if (table.has("solid_fraction") && !(spec.solid_fraction > 0.3 && spec.solid_fraction < 0.9))
        table.fail("solid_fraction",
                   fmt::format("must be above the loose start's 0.3 (0.45 in 2D) and below 0.9, found {}",
                               spec.solid_fraction));
    if (table.has("generator")) {
        const std::string& named = generators[static_cast<std::size_t>(table.choice("generator", generators))];
        if (!generator) generator = named;
    }
    table.finish();
    return spec;
}

bool choose_lammps(const std::string& generator) {
    const bool found = generator != "own" && on_path("lmp");
    if (generator == "lammps" && !found)
        throw InputError(
            "generator lammps: there is no lmp on PATH (scripts/setup installs it); --generator own needs none");
    return found;
}

}  // namespace

CLI::App* add_pack(CLI::App& app, PackArguments& arguments) {
    CLI::App* command = app.add_subcommand(
        "pack", "Generate a packing: by LAMMPS where it is, else by our own contact dynamics; checked");
    command
        ->add_option("specification", arguments.specification,
                     "TOML: dimension, grains, radius and spread or [radii], aspect, periodic, seed, solid_fraction, "
                     "generator")
        ->required()
        ->check(file_name());
    command->add_option("-o,--output", arguments.output, "HDF5 file to write (x, radius, box, periodic)")
        ->required()
        ->check(file_name());
    command
        ->add_option("--generator", arguments.generator,
                     "auto: LAMMPS if lmp is on PATH; lammps; own. Default: the specification's, or auto")
        ->check(CLI::IsMember(generators));
    command->add_flag("--quiet", arguments.quiet, "No progress");
    return command;
}

int pack(const PackArguments& arguments, const Provenance& provenance) {
    std::optional<std::string> generator = arguments.generator;
    const PackSpecification spec = read_specification(arguments.specification, generator);
    check_outputs({{"--output", arguments.output, 40 * static_cast<std::uint64_t>(spec.grains)}},
                  {{"the specification", arguments.specification}});
    const bool lammps = choose_lammps(generator.value_or("auto"));
    auto [packing, by] = lammps ? pack_by_lammps(spec, arguments.output) : pack_by_walls(spec, arguments.quiet);
    const PackingMeasures measures = remove_overlaps(packing);
    check_packing(arguments.specification, measures, {spec.dimension, spec.spread, spec.solid_fraction});
    std::map<std::string, std::string> attributes = {
        {"source", "nscdd pack by " + by},
        {"command", provenance.command},
        {"commit", provenance.commit},
        {"seed", std::to_string(spec.seed)},
        {"solid_fraction", fmt::format("{:.6f}", measures.solid_fraction)},
        {"solid_fraction_core", fmt::format("{:.6f}", measures.core_fraction)},
        {"coordination", fmt::format("{:.4f}", measures.core_coordination)},
        {"rattlers", fmt::format("{:.4f}", measures.rattlers)},
        {"largest_overlap", fmt::format("{:.2e}", measures.overlap)}};
    if (spec.radii)
        attributes["radii"] =
            confirm_radii(*spec.radii, packing.radius, 1 - measures.shrink, spec.dimension, arguments.specification);
    write_packing(arguments.output, packing, attributes);
    say("{}: {} grains by {}, in a box of {:.4g} m\n", arguments.output, packing.size(), by,
        fmt::join(packing.box, " x "));
    say("solid fraction {:.4f}, {:.4f} in the core of {} grains; coordination there {:.3f} without rattlers ({:.1f} % "
        "of all); largest overlap {:.1e} d, taken away by radii shrunk by {:.1e}\n",
        measures.solid_fraction, measures.core_fraction, measures.core_grains, measures.core_coordination,
        100 * measures.rattlers, measures.overlap, measures.shrink);
    if (spec.radii) say("{}\n", attributes["radii"]);
    return 0;
}

}  // namespace nscdd
