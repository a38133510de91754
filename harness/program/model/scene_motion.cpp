#include "model/scene_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "files/ranges.hpp"

namespace nscdd {

ScenePath read_oscillation(TomlTable& table, int dim, const Eigen::VectorXd& along) {
    const Eigen::VectorXd direction =
        along.size() > 0 ? table.vector("direction", dim, along) : table.vector("direction", dim);
    if (!(direction.norm() > 0)) table.fail("direction", "must not be 0");
    ScenePath path;
    path.kind = ScenePath::Kind::Oscillating;
    path.amplitude = table.number("amplitude", any_number) * direction.normalized();
    path.frequency = table.number("frequency", positive);
    path.phase = table.number("phase", any_number, 0.0);
    return path;
}

ScenePath read_path_table(TomlTable& table, int dim, const std::string& scene_file) {
    const std::string file = (std::filesystem::path(scene_file).parent_path() / table.text("file")).string();
    std::ifstream in(file);
    if (!in || !std::filesystem::is_regular_file(file)) table.fail("file", fmt::format("cannot read '{}'", file));
    ScenePath path;
    path.kind = ScenePath::Kind::Table;
    path.file = file;
    int number = 0;
    for (std::string line; std::getline(in, line);) {
        const auto fail = [&](const std::string& problem) {
            throw InputError(fmt::format("{}:{}: {}", file, number, problem));
        };
        ++number;
        line = line.substr(0, line.find('#'));
        std::ranges::replace(line, ',', ' ');
        std::istringstream words(line);
        std::vector<double> row;
        for (std::string word; words >> word;) {
            char* end = nullptr;
            row.push_back(std::strtod(word.c_str(), &end));
            if (*end != '\0' || !std::isfinite(row.back())) fail(fmt::format("'{}' is not a finite number", word));
        }
        if (row.empty()) continue;
        if (row.size() != static_cast<std::size_t>(1 + dim))
            fail(fmt::format("needs a time and {} coordinates, found {} numbers", dim, row.size()));
        if (!path.times.empty() && !(row[0] > path.times.back())) fail("times must ascend");
        path.times.push_back(row[0]);
        path.places.emplace_back(Eigen::Map<const Eigen::VectorXd>(row.data() + 1, dim));
    }
    if (path.times.empty()) throw InputError(fmt::format("{}: has no time and place", file));
    return path;
}

}  // namespace nscdd
