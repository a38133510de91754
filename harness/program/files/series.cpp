#include "files/series.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

namespace nscdd {
namespace {

bool is_csv(const std::string& path) { return std::filesystem::path(path).extension() == ".csv"; }

// As RFC 4180 quotes fields.
std::string quoted(const std::string& field) {
    if (field.find_first_of(",\"\n\r") == std::string::npos) return field;
    std::string out = "\"";
    for (const char c : field) {
        if (c == '"') out += '"';
        out += c;
    }
    return out + '"';
}

std::string header(const SeriesValue& value) {
    std::vector<std::string> names;
    for (const auto& name : column_names(value)) names.push_back(quoted(name));
    return fmt::format("{}", fmt::join(names, ","));
}

}  // namespace

std::vector<std::string> column_names(const SeriesValue& value) {
    if (value.shape.empty()) return {value.name};
    std::vector<std::string> names;
    for (const auto& label : value.labels) names.push_back(value.name + "_" + label);
    return names;
}

void SeriesWriter::check_name(const std::string& path) {
    const auto ending = std::filesystem::path(path).extension();
    if (ending != ".csv" && ending != ".h5" && ending != ".hdf5")
        throw InputError(fmt::format("--series {}: expected a name that ends in .h5, .hdf5 or .csv", path));
}

SeriesWriter::SeriesWriter(FileSet& files, const std::string& path, const SeriesHead& head)
    : path_(path), head_(head), files_(&files), csv_(is_csv(path)) {
    if (!csv_) return;
    text_.open(files.begin(path), std::ios::binary);
    if (!text_) throw OutputError(fmt::format("{}: cannot write: {}", path_, std::strerror(errno)));
}

void SeriesWriter::write_line(const std::string& line) {
    errno = 0;
    text_ << line << '\n' << std::flush;
    if (!text_) throw OutputError(fmt::format("{}: cannot write: {}", path_, std::strerror(errno)));
}

void SeriesWriter::add(const SeriesRow& row) {
    ++rows_;
    if (!csv_) {
        if (columns_.empty()) {
            columns_ = row;
            return;
        }
        for (std::size_t k = 0; k < row.size(); ++k)
            columns_[k].values.insert(columns_[k].values.end(), row[k].values.begin(), row[k].values.end());
        return;
    }
    std::vector<std::string> headers, fields;
    for (const auto& value : row) {
        headers.push_back(header(value));
        for (const double number : value.values)
            fields.push_back(std::isnan(number) ? "nan" : fmt::format("{}", number));
    }
    if (rows_ == 1) write_line(fmt::format("{}", fmt::join(headers, ",")));
    write_line(fmt::format("{}", fmt::join(fields, ",")));
}

void SeriesWriter::save() {
    if (csv_) {
        text_.close();
        if (!text_) throw OutputError(fmt::format("{}: cannot write: {}", path_, std::strerror(errno)));
        return;
    }
    hdf5::Writer file(*files_, path_);
    file.attribute("scene", head_.scene);
    file.attribute("dim", static_cast<std::int64_t>(head_.dim));
    file.attribute("h", head_.h);
    file.attribute("energy_tolerance", head_.energy_tolerance);
    file.write("box_at_start", head_.box, {head_.box.size()});
    file.attribute("unit", std::string("m"), "box_at_start");
    for (const auto& column : columns_) {
        hdf5::Shape shape{rows_};
        shape.insert(shape.end(), column.shape.begin(), column.shape.end());
        file.write(column.name, column.values, shape);
        file.attribute("unit", column.unit, column.name);
        file.attribute("meaning", column.meaning, column.name);
        file.attribute("columns", header(column), column.name);
    }
    file.save();
}

}  // namespace nscdd
