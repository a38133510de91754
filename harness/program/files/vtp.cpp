#include "files/vtp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "files/error.hpp"

namespace nscdd {

static_assert(std::endian::native == std::endian::little, "the byte order that the files name");

void Vtp::declare(const std::string& section, const std::string& name, bool integer, std::size_t components,
                  std::size_t tuples) {
    Array array{section, name, integer, components};
    array.bytes = tuples * components * (integer ? sizeof(int) : sizeof(double));
    array.offset = arrays_.empty() ? 0 : arrays_.back().offset + sizeof(std::uint64_t) + arrays_.back().bytes;
    arrays_.push_back(array);
}

std::string Vtp::xml(std::size_t points, const std::vector<std::size_t>& cells) const {
    std::string text = fmt::format(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n<PolyData>\n<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" "
        "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
        points, cells[0], cells[1], cells[2]);
    for (const char* section : {"PointData", "CellData", "Points", "Verts", "Lines", "Polys"}) {
        text += fmt::format("<{}>\n", section);
        for (const Array& array : arrays_)
            if (array.section == section)
                text += fmt::format(
                    "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
                    "offset=\"{}\"/>\n",
                    array.integer ? "Int32" : "Float64", array.name, array.components, array.offset);
        text += fmt::format("</{}>\n", section);
    }
    return text + "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_";
}

void Vtp::begin(const std::string& file, const std::string& told, std::size_t points, std::vector<std::size_t> cells) {
    told_ = told;
    out_.open(file, std::ios::binary | std::ios::trunc);
    const std::string head = xml(points, cells);
    out_ << head;
    data_ = head.size();
    for (const Array& array : arrays_) {
        out_.seekp(static_cast<std::streamoff>(data_ + array.offset));
        out_.write(reinterpret_cast<const char*>(&array.bytes), sizeof array.bytes);
    }
    check();
}

void Vtp::put(const std::string& section, const std::string& name, const std::vector<double>& values) {
    put_bytes(section, name, values.data(), values.size() * sizeof(double));
}
void Vtp::put(const std::string& section, const std::string& name, const std::vector<int>& values) {
    put_bytes(section, name, values.data(), values.size() * sizeof(int));
}

void Vtp::put_bytes(const std::string& section, const std::string& name, const void* data, std::size_t bytes) {
    const auto array =
        std::ranges::find_if(arrays_, [&](const Array& a) { return a.section == section && a.name == name; });
    if (array == arrays_.end() || array->written + bytes > array->bytes)
        throw std::logic_error(fmt::format("Vtp: {}: no room for {} bytes in {} {}", told_, bytes, section, name));
    out_.seekp(static_cast<std::streamoff>(data_ + array->offset + sizeof(std::uint64_t) + array->written));
    out_.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
    array->written += bytes;
    check();
}

void Vtp::end() {
    for (const Array& array : arrays_)
        if (array.written != array.bytes)
            throw std::logic_error(fmt::format("Vtp: {}: {} {} has {} of {} bytes", told_, array.section, array.name,
                                               array.written, array.bytes));
    if (!arrays_.empty())
        out_.seekp(
            static_cast<std::streamoff>(data_ + arrays_.back().offset + sizeof(std::uint64_t) + arrays_.back().bytes));
    out_ << "\n</AppendedData>\n</VTKFile>\n";
    out_.close();
    check();
    arrays_.clear();
}

void Vtp::check() const {
    if (!out_) throw OutputError(fmt::format("{}: cannot write: {}", told_, std::strerror(errno)));
}

}  // namespace nscdd
