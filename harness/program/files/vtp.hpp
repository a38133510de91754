// A file of VTK's poly data (.vtp) that is filled piece by piece: arrays are raw, behind the XML that names them.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

namespace nscdd {

class Vtp {
  public:
    // An array of `tuples` times `components` values of `section`: PointData, CellData, Points, Verts, Lines or Polys.
    // `integer`: of int, else of double.
    void declare(const std::string& section, const std::string& name, bool integer, std::size_t components,
                 std::size_t tuples);
    // `cells`: numbers of Verts, Lines and Polys. Throws OutputError, which names `told`; so do all that follow.
    void begin(const std::string& file, const std::string& told, std::size_t points, std::vector<std::size_t> cells);
    // Values of an array behind those that it has.
    void put(const std::string& section, const std::string& name, const std::vector<double>& values);
    void put(const std::string& section, const std::string& name, const std::vector<int>& values);
    // Throws std::logic_error where an array lacks values.
    void end();

  private:
    struct Array {
        std::string section, name;
        bool integer = false;
        std::size_t components = 1;
        std::uint64_t bytes = 0, offset = 0, written = 0;
    };
    std::string xml(std::size_t points, const std::vector<std::size_t>& cells) const;
    void put_bytes(const std::string& section, const std::string& name, const void* data, std::size_t bytes);
    void check() const;

    std::string told_;
    std::ofstream out_;
    std::uint64_t data_ = 0;  // where the arrays begin
    std::vector<Array> arrays_;
};

}  // namespace nscdd
