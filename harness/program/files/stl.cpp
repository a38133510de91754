#include "files/stl.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "files/error.hpp"

namespace nscdd {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers of binary STL files are little-endian");

constexpr std::size_t head = 84, record = 50;  // bytes: 80 of text and the number; 12 floats and 2 bytes of colour

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

std::vector<StlTriangle> from_binary(const std::string& path, const std::string& bytes) {
    const std::size_t count = (bytes.size() - head) / record;
    std::vector<StlTriangle> triangles(count);
    for (std::size_t t = 0; t < count; ++t)
        for (std::size_t k = 0; k < 9; ++k) {
            const float value = number_at<float>(bytes, head + t * record + (3 + k) * sizeof(float));  // 3: the normal
            if (!std::isfinite(value)) throw InputError(fmt::format("{}: triangle {} is not finite", path, t));
            triangles[t][k / 3][static_cast<Eigen::Index>(k % 3)] = double{value};
        }
    return triangles;
}

std::string lower(std::string word) {
    std::ranges::transform(word, word.begin(), [](unsigned char c) { return std::tolower(c); });
    return word;
}

// Text begins with "solid", in letters of any size and behind blanks.
bool is_text(const std::string& bytes) {
    const std::size_t begin = bytes.find_first_not_of(" \t\r\n");
    return begin != bytes.npos && lower(bytes.substr(begin, 5)) == "solid" && bytes.find('\0') == bytes.npos;
}

std::vector<StlTriangle> from_text(const std::string& path, const std::string& text) {
    std::vector<StlTriangle> triangles;
    std::istringstream lines(text);
    std::size_t corner = 0;
    int number = 0;
    const auto fail = [&](const std::string& problem) {
        throw InputError(fmt::format("{}:{}: {}", path, number, problem));
    };
    for (std::string line; std::getline(lines, line);) {
        ++number;
        std::istringstream words(line);
        std::string word;
        words >> word;
        word = lower(word);
        if (word == "facet" || word == "endfacet") {
            if (corner != 0) fail("a facet has three vertices");
        } else if (word == "vertex") {
            if (corner == 0) triangles.emplace_back();
            for (double& x : triangles.back()[corner]) {
                words >> word;
                char* end = nullptr;
                x = std::strtod(word.c_str(), &end);
                if (!words || *end != '\0' || !std::isfinite(x)) fail("a vertex has three finite numbers");
            }
            corner = (corner + 1) % 3;
        } else if (!word.empty() && word != "solid" && word != "outer" && word != "endloop" && word != "endsolid") {
            fail(fmt::format("'{}' is no word of an STL file", word.substr(0, 20)));
        }
    }
    if (corner != 0) fail("a facet has three vertices");
    return triangles;
}

}  // namespace

std::vector<StlTriangle> read_stl(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream all;
    if (!file || !std::filesystem::is_regular_file(path) || !(all << file.rdbuf()))
        throw InputError(path + ": cannot be read");
    const std::string bytes = std::move(all).str();
    // A binary file may begin with "solid", too, but its size follows from its number of triangles.
    const bool counted = bytes.size() >= head;
    const std::size_t said = counted ? number_at<std::uint32_t>(bytes, head - 4) : 0;
    std::vector<StlTriangle> triangles;
    if (counted && bytes.size() == head + said * record)
        triangles = from_binary(path, bytes);
    else if (is_text(bytes))
        triangles = from_text(path, bytes);
    else
        throw InputError(counted ? fmt::format("{}: says that it has {} triangles, which take {} bytes, found {}", path,
                                               said, head + said * record, bytes.size())
                                 : path + ": is no STL file");
    if (triangles.empty()) throw InputError(path + ": has no triangle");
    return triangles;
}

}  // namespace nscdd
