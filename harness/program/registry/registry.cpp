#include "registry/registry.hpp"

#include "registry/partitions.hpp"
#include "registry/schemes.hpp"

namespace nscdd {

std::span<const SchemeInfo> offered_schemes() {
    static const std::vector<SchemeInfo> infos = infos_of<SchemeInfo>(schemes);
    return infos;
}

std::span<const PartitionInfo> offered_partitions() {
    static const std::vector<PartitionInfo> infos = infos_of<PartitionInfo>(partitions);
    return infos;
}

const SchemeInfo& offered_scheme(const std::string& name) {
    for (const SchemeInfo& scheme : offered_schemes())
        if (name == scheme.name) return scheme;
    throw std::logic_error(name + " is not offered");
}

}  // namespace nscdd
