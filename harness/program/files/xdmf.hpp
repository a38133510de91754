// Pieces of XDMF, the XML beside an HDF5 file through which ParaView reads it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace nscdd::xdmf {

std::string escape(std::string_view text);

// A dataset of an HDF5 file, of `rows` rows. Every one is whole: ParaView's XDMF 3 reader knows neither parts of
// datasets (HyperSlab) nor joined ones (Function), and skips what it does not know. type: "Float" or "Int".
std::string item(std::string_view file, std::string_view dataset, std::string_view type, std::size_t rows, int columns);

// kind: "Scalar" or "Vector", of three columns. center: "Node" or "Cell".
std::string attribute(std::string_view name, std::string_view kind, std::string_view center, std::string_view item);

// <Xdmf> around grids.
std::string document(std::string_view grids);

}  // namespace nscdd::xdmf
