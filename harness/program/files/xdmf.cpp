#include "files/xdmf.hpp"

#include <fmt/format.h>

namespace nscdd::xdmf {

std::string escape(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

std::string item(std::string_view file, std::string_view dataset, std::string_view type, std::size_t rows,
                 int columns) {
    const std::string extent = columns == 1 ? fmt::format("{}", rows) : fmt::format("{} {}", rows, columns);
    return fmt::format(R"(<DataItem Dimensions="{}" NumberType="{}" Precision="{}" Format="HDF">{}:/{}</DataItem>)",
                       extent, type, type == "Int" ? 4 : 8, escape(file), dataset);
}

std::string attribute(std::string_view name, std::string_view kind, std::string_view center, std::string_view item) {
    return fmt::format("        <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">{}</Attribute>\n", name, kind,
                       center, item);
}

std::string document(std::string_view grids) {
    return fmt::format("<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n{}  </Domain>\n</Xdmf>\n", grids);
}

}  // namespace nscdd::xdmf
