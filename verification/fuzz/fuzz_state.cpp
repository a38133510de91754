// Packings and states: the shapes and values of a sound HDF5 file.
#include "files/packing.hpp"
#include "files/state.hpp"
#include "hdf5_image.hpp"

using namespace nscdd;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::MemoryFile file;
    FuzzedDataProvider bytes(data, size);
    const hsize_t n = 1 + bytes.ConsumeIntegralInRange<hsize_t>(0, 3),
                  dim = 2 + bytes.ConsumeIntegralInRange<hsize_t>(0, 1),
                  w = bytes.ConsumeIntegralInRange<hsize_t>(0, 2), c = bytes.ConsumeIntegralInRange<hsize_t>(0, 3);
    {
        fuzz::Hdf5Image image(bytes);
        const auto reals = [&](const char* name, hdf5::Shape shape) {
            image.dataset(name, shape, std::vector<double>(n * dim + w * dim + c * dim, 1), false);
        };
        const auto integers = [&](const char* name, hsize_t extent, double value) {
            image.dataset(name, {extent}, std::vector<double>(extent, value), true);
        };
        reals("x", {n, dim}), reals("radius", {n}), reals("box", {dim});
        reals("velocity", {n, dim}), reals("spin", {n, dim == 3 ? hsize_t{3} : hsize_t{1}});
        integers("material", n, 0), integers("subdomain", n, 0), integers("multiplicity", n, 1);
        reals("walls/offset", {w}), reals("walls/normal", {w, dim}), reals("walls/velocity", {w, dim});
        image.texts("walls/name", w), reals("walls/normal_speed", {w});
        image.texts("materials/name", 1), reals("materials/density", {1});
        image.texts("rough/kind", 1), reals("rough/partition", {c}), reals("rough/imbalance", {1});
        integers("rough/steps_since", 1, 4);
        reals("rough/x", {n, dim}), reals("rough/offset", {w}), reals("rough/skin", {1});
        integers("contacts/i", c, 0), integers("contacts/j", c, 0), integers("contacts/subdomain", c, 0);
        reals("contacts/impulse", {c, dim}), reals("contacts/normal", {c, dim}), reals("contacts/gap", {c});
        reals("contacts/normal_impulse", {c});
        image.attribute("time", 0.5, H5T_NATIVE_DOUBLE);
        image.attribute("step", 3, H5T_NATIVE_INT64);
        image.attribute("steps_left", 2, H5T_NATIVE_INT64);
        image.text_attribute("scene");
        image.save(file);
    }
    fuzz::refuses_in_one_line([&] { read_packing(file.path()); });
    fuzz::refuses_in_one_line([&] { read_state(file.path()); });
    fuzz::refuses_in_one_line([&] { read_state(file.path(), {1, 3}); });
    return 0;
}
