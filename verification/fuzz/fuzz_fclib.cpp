// FCLIB problems, local and global, with and without rolling resistance: the shapes, indices and values of a sound HDF5
// file; what is read is condensed and solved a little.
#include "hdf5_image.hpp"
#include "model/local_form.hpp"
#include "nscdd/reference/block_nlgs.hpp"

using namespace nscdd;

namespace {

// The identity on top of zeros, by columns, by rows or as triplets.
void matrix(fuzz::Hdf5Image& image, FuzzedDataProvider& bytes, const std::string& group, int rows, int columns) {
    const int layout = bytes.ConsumeIntegralInRange(0, 2), diagonal = std::min(rows, columns);
    std::vector<double> i, p;
    for (int k = 0; k < diagonal; ++k) i.push_back(k);
    if (layout == 2) p = i;
    for (int k = 0; layout < 2 && k <= (layout == 0 ? columns : rows); ++k) p.push_back(std::min(k, diagonal));
    const auto scalar = [&](const char* name, double value) { image.dataset(group + name, {1}, {value}, true); };
    scalar("/m", rows), scalar("/n", columns), scalar("/nz", layout == 2 ? diagonal : -1 - layout);
    image.dataset(group + "/i", {i.size()}, i, true);
    image.dataset(group + "/p", {p.size()}, p, true);
    image.dataset(group + "/x", {i.size()}, std::vector<double>(i.size(), 1), false);
}

template <int dim, bool rolls>
void solve(const LocalProblem& local) {
    const DelassusProblem<dim, rolls> problem = to_blocks<dim, rolls>(local);
    LocalVectors<dim, rolls> r(problem.contact_count(), DelassusProblem<dim, rolls>::Vec::Zero());
    block_nlgs(problem, r, {.check_every = 1, .max_iterations = 5});
    error_measures(problem, r);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::MemoryFile file;
    FuzzedDataProvider bytes(data, size);
    const int contacts = 1 + bytes.ConsumeIntegralInRange(0, 3), dim = 2 + bytes.ConsumeIntegralInRange(0, 1);
    const bool global = bytes.ConsumeBool(), rolls = bytes.ConsumeBool();
    const int components = rolls ? 2 * dim - 1 : dim, size_of_r = contacts * components,
              dof = size_of_r + (global ? bytes.ConsumeIntegralInRange(-4, 4) : 0);
    {
        fuzz::Hdf5Image image(bytes);
        const std::string group = std::string(global ? "fclib_global" : "fclib_local") + (rolls ? "_rolling" : "");
        const auto vector = [&](const char* name, int extent) {
            image.dataset(group + "/vectors/" + name, {static_cast<hsize_t>(extent)},
                          std::vector<double>(static_cast<std::size_t>(extent), -0.5), false);
        };
        image.dataset(group + "/spacedim", {1}, {double(components)}, true);
        for (const char* name : {"mu", "mu_r"})
            if (rolls || name == std::string("mu"))
                image.dataset(group + "/vectors/" + name, {static_cast<hsize_t>(contacts)},
                              std::vector<double>(static_cast<std::size_t>(contacts), 0.3), false);
        if (global) {
            matrix(image, bytes, group + "/M", std::max(dof, 0), std::max(dof, 0));
            matrix(image, bytes, group + "/H", std::max(dof, 0), size_of_r);
            vector("f", std::max(dof, 0)), vector("w", size_of_r);
        } else {
            matrix(image, bytes, group + "/W", size_of_r, size_of_r);
            vector("q", size_of_r);
        }
        image.save(file);
    }
    fuzz::refuses_in_one_line([&] {
        const auto problem = read_fclib(file.path());
        const auto* as_global = std::get_if<GlobalProblem>(&problem);
        try {
            const LocalProblem local = as_global ? condense(*as_global) : std::get<LocalProblem>(problem);
            if (local.rolls())
                local.dim == 2 ? solve<2, true>(local) : solve<3, true>(local);
            else
                local.dim == 2 ? solve<2, false>(local) : solve<3, false>(local);
        } catch (const InputError&) {
            throw;
        } catch (const std::runtime_error&) {  // singular, no mobility along a normal, not finite
        }
    });
    return 0;
}
